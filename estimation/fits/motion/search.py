"""`search_results(searches)`: ends of searches for the motion form's unknowns, on ever longer beginnings.

A start first descends under larger noise, and is then searched on the first seconds; if it explains these, on more of
the log. Both structures of friction are searched in turn, so that neither is searched in vain if the other explains the
log.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from estimation.fits.greybox.descent import Point, descend, descend_together
from estimation.fits.greybox.driven import driven_samples
from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.greybox.problem import search_bounds
from estimation.fits.greybox.side_by_side import LANES
from estimation.fits.motion.chatter import bristle_limits
from estimation.fits.motion.force_scale import bulk_modulus
from estimation.fits.motion.noise_annealing import RETURNING, annealed
from estimation.models.greybox import GreyBoxModel
from estimation.models.motion import LINEAR, UNKNOWNS
from plant.arrays import Array
from plant.solvers.steps import parameter_names

SCREENED = 4.0
"""Beginning on which starts are compared [s]."""

SEARCHED = 10.0
"""Beginning on which a start that explains that is carried on [s]; a longer log goes on from where it ends."""

UNCHANGED = (1.0, 1.0)
"""Factors that leave the noise as it is [dimensionless]."""

WAYS: tuple[tuple[tuple[float, float], tuple[float, float]], ...] = (
    ((1.0, 1e6), (1.0, 1e3)),
    (UNCHANGED, UNCHANGED),
    ((1e2, 1e6), (1.0, 1e3)),
)
"""Factors on variance and random walk of the residual while starts are screened, and during the approach. With the
true, small noise the least error of leakage accumulates in position and hides other ways down; with a larger walk
increments count. If the piston sticks, the direct descent is often shorter."""

SCREENING, NEARING, FINISHING = 10, 12, 25
"""Evaluations of the model in the three stages."""

NEAR_ENOUGH = 0.01
"""Cost that a further step of the approach must promise [dimensionless]."""

ENOUGH = 0.1
"""The same for the search on a beginning of the log [dimensionless]."""

FINALISTS = 3
"""Starts that are searched further in each way, the likeliest of each way first, until one explains the log."""

STEP_FACTOR = 2
"""Factor on the length of model steps during the approach."""

MOST_WORK = 10_000_000
"""Steps of eight runs side by side from which only the likeliest start of each structure of friction is tried. The
structure that is tried first has half of them, unless it explains the beginning. A start that was begun is finished.
The limit is a count, not a time, so that every machine finds the same."""

EXPLAINED = 1.1
"""Mean squared normalised residual up to which a form explains the log [dimensionless]."""

HOPELESS = 3.0
"""The same from which only the likeliest start of each way is tried [dimensionless]."""

FOREIGN = 10.0
"""The same, on the first `SEARCHED` seconds, from which what nearly explains the first `SCREENED` is not left for a
deeper minimum [dimensionless]. Judged: such ends had 100 to 600, and the beginning held little that moves."""

SLIGHT = 1e-3
"""Cost that a further step must promise if nothing explains the log, over that of an explanation [fraction]."""

SLIGHT_SHARE = 0.002
"""Share of the cost that a further step must promise if no number will be believed [fraction]: the distance from an
explanation is then known well enough. With a hundredth, long descents with slow first steps were given up."""

SAME_COST, SAME_MODULUS = 0.02, 0.01
"""Relative difference of costs, and of bulk moduli, up to which two starts reached the same local minimum
[fraction]."""


@dataclass(eq=False)
class SharedState:
    """State that all searches of a log share.

    Parameters
    ----------
    screened : dict
        Screened starts, likeliest first, by way. Under larger noise the structures of friction hardly differ, so both
        share one screening.
    work : int
        Steps of eight runs side by side that were taken [steps].
    """

    screened: dict[int, list[Point]] = field(default_factory=dict[int, list[Point]])
    work: int = 0

    def at(self, problem: FreedProblem) -> Callable[[Array], Point]:
        """Return a problem's cost as a function of the coordinates, with its work counted."""
        return partial(self._at, problem)

    def at_each(self, problem: FreedProblem) -> Callable[[Sequence[Array]], list[Point]]:
        """Return a function that gives the cost at several points side by side, with its work counted."""
        return partial(self._at_each, problem)

    def _at(self, problem: FreedProblem, theta: Array) -> Point:
        self._count(problem, 1 + len(theta))
        return problem.at(theta)

    def _at_each(self, problem: FreedProblem, thetas: Sequence[Array]) -> list[Point]:
        self._count(problem, len(thetas) * (1 + len(thetas[0])))
        return problem.at_each(thetas)

    def _count(self, problem: FreedProblem, runs: int) -> None:
        self.work += int(np.sum(problem.log.steps)) * -(-runs // LANES)


@dataclass(frozen=True, eq=False)
class MotionSearch:
    """The search for the unknowns under one structure of friction.

    Parameters
    ----------
    whole : FreedProblem
        The problem on the whole log.
    part, short : FreedProblem
        The same on its first `SEARCHED` and `SCREENED` seconds.
    guesses : list of ndarray, shape (unknowns,)
        Starts [dimensionless].
    bounds : tuple of ndarray, shape (unknowns,)
        Bounds of the search [dimensionless].
    near : tuple of ndarray, shape (unknowns,)
        Bounds during the approach: as far as model steps follow the bristle [dimensionless].
    """

    whole: FreedProblem
    part: FreedProblem
    short: FreedProblem
    guesses: list[Array]
    bounds: tuple[Array, Array]
    near: tuple[Array, Array]

    @classmethod
    def of(cls, form: GreyBoxModel, log: GreyBoxLog, starts: Sequence[dict[str, float]]) -> "MotionSearch":
        """Return the search of a form on a log.

        Parameters
        ----------
        form : GreyBoxModel
            One of `estimation.models.motion.MOTION_FORMS`.
        starts : sequence of dict
            First guesses of the unknowns [SI].
        """
        whole = FreedProblem(form, log, UNKNOWNS, LINEAR)
        guesses = [whole.model.theta(start) for start in starts]
        lead = {"speed_lead": (0.0, 0.5 * log.sample_time)}
        soft = bristle_limits(log, parameter_names(form.parameters))
        bounds, near = (search_bounds(whole.model, guesses, limits) for limits in (lead, lead | soft))
        speed = log.drives[:, form.drives.index("motor_speed_rad_s")]
        lengths = (driven_samples(speed, round(length / log.sample_time)) for length in (SEARCHED, SCREENED))
        part, short = (whole.on(log.beginning(samples)) for samples in lengths)
        return cls(whole, part, short, guesses, bounds, near)

    def ends_of_approach(self, rank: int, begun: SharedState, worth: Callable[[], bool]) -> Iterator[Array]:
        """Yield the ends of the approach for the starts of a rank, on the short beginning under larger noise.

        An end that does not explain the log even with the larger noise is left out, and so is one that equals another
        of its rank.

        Parameters
        ----------
        rank : int
            0 for the likeliest start of each way.
        begun : SharedState
            What was screened so far, and the work; updated here.
        worth : callable
            Whether another start after the very first is approached, called before each.

        Yields
        ------
        ndarray, shape (unknowns,)
            Fitted coordinates [dimensionless].
        """
        reached: list[Point] = []
        for way, (first, second) in enumerate(WAYS):
            if rank + way > 0 and not worth():
                return
            if way not in begun.screened:
                screen = begun.at_each(rough_problem(self.short, first))
                points = descend_together(screen, self.guesses, SCREENING, self.near, NEAR_ENOUGH)
                begun.screened[way] = sorted(points, key=cost_of)
            start = begun.screened[way][rank].theta
            if second == UNCHANGED:
                yield start
                continue
            near = descend(begun.at(rough_problem(self.short, second)), start, NEARING, self.near, NEAR_ENOUGH)
            if near.cost < explained_cost(self.short) and not any(self.is_same_basin(near, other) for other in reached):
                yield near.theta
            reached.append(near)

    def is_same_basin(self, one: Point, other: Point) -> bool:
        """Return whether two points of the short beginning lie in the same basin."""
        moved = abs(np.log(bulk_modulus(self.whole, one) / bulk_modulus(self.whole, other)))
        return abs(one.cost - other.cost) < SAME_COST * other.cost and bool(moved < SAME_MODULUS)


@dataclass(frozen=True, eq=False)
class SearchResult:
    """Result of a search.

    Parameters
    ----------
    search : MotionSearch
        The search.
    point : Point
        The best point that it found, on the longest beginning that it reached.
    explains : bool
        Whether it explains the log's first `SEARCHED` seconds.
    """

    search: MotionSearch
    point: Point
    explains: bool


def search_results(searches: Sequence[MotionSearch]) -> list[SearchResult]:
    """Return the results of several searches, in their order; all stop once one explains the log.

    Parameters
    ----------
    searches : sequence of MotionSearch
        One per structure of friction.
    """
    begun = SharedState()
    tries = [_Tries(search, begun) for search in searches]
    for rank in range(FINALISTS):
        for place, one in enumerate(tries, start=1):
            share = place / len(tries)
            for near in one.search.ends_of_approach(rank, begun, partial(one.may_go_on, share)):
                if (found := one.optimum_if_explained(near)) is not None:
                    return [
                        SearchResult(each.search, found if each is one else each.best, each is one) for each in tries
                    ]
        if begun.work > MOST_WORK or all(one.best.cost > HOPELESS * explained_cost(one.search.short) for one in tries):
            break
    likelier = min(tries, key=lambda one: one.best.cost)
    last, explains = likelier.ended()
    ends = [(last, explains) if one is likelier else (one.best, False) for one in tries]
    return [SearchResult(one.search, *end) for one, end in zip(tries, ends, strict=True)]


class _Tries:
    """Trials of one search.

    Parameters
    ----------
    search : MotionSearch
        The search.
    begun : SharedState
        Its work is counted there.
    """

    def __init__(self, search: MotionSearch, begun: SharedState) -> None:
        self.search, self._begun = search, begun
        self.best = search.short.at(search.guesses[0])
        self._followed: list[tuple[Point, Point]] = []

    def may_go_on(self, share: float) -> bool:
        """Return whether another start may be tried: within a share of `MOST_WORK`, or all where one is promising."""
        promising = self.best.cost < explained_cost(self.search.short)
        return self._begun.work <= MOST_WORK * (1.0 if promising else share)

    def optimum_if_explained(self, near: Array) -> Point | None:
        """Return the optimum from a start on the first `SEARCHED` seconds if it explains them.

        What explains the shorter beginning is searched once per local minimum, and once in all after `MOST_WORK`.
        """
        search, wanted = self.search, explained_cost(self.search.short)
        point, at = Point(near, np.inf, np.zeros(0), np.zeros((0, 0))), self._begun.at(search.short)
        for bounds in (search.near, search.bounds):
            point = descend(at, point.theta, FINISHING, bounds, ENOUGH, wanted=wanted)
        self.best = min(self.best, point, key=cost_of)
        known = any(search.is_same_basin(point, other) for other, _ in self._followed)
        if point.cost >= wanted or known or (self._followed and self._begun.work > MOST_WORK):
            return None
        wanted = explained_cost(search.part)
        more = descend(self._begun.at(search.part), point.theta, FINISHING, search.bounds, ENOUGH, wanted=wanted)
        self._followed.append((point, more))
        return more if more.cost < wanted else None

    def ended(self) -> tuple[Point, bool]:
        """Return the optimum on the shorter beginning if no start explains the log, or a point that explains more.

        A near explanation of the beginning is annealed: in which local minimum a descent ends depends on rounding.
        """
        search, at = self.search, self._begun.at
        short, bounds, wanted = search.short, search.bounds, explained_cost(search.short)
        if self._followed:
            _, more = min(self._followed, key=lambda pair: pair[1].cost)
            return short.at(more.theta), False
        promising, share = SLIGHT * wanted, SLIGHT_SHARE if self._begun.work > MOST_WORK else 0.0
        point = descend(at(short), self.best.theta, RETURNING, bounds, promising, least_share=share)
        if point.cost < HOPELESS * wanted and self._explains_more(point):
            point = annealed(short, point, bounds, promising, SAME_COST * wanted, at, share)
        found = self.optimum_if_explained(point.theta) if point.cost < wanted else None
        return (point, False) if found is None else (found, True)

    def _explains_more(self, point: Point) -> bool:
        """Return whether more of the log is nearly explained from a point that nearly explains its beginning."""
        search, wanted = self.search, FOREIGN * explained_cost(self.search.part)
        at = self._begun.at(search.part)
        return descend(at, point.theta, FINISHING, search.bounds, ENOUGH, wanted=wanted, good=wanted).cost < wanted


def rough_problem(problem: FreedProblem, factors: tuple[float, float]) -> FreedProblem:
    """Return a problem with more noise and longer model steps.

    Parameters
    ----------
    factors : tuple of float
        Factors on variance and random walk [dimensionless].
    """
    log = problem.log.with_larger_noise(*factors)
    return problem.on(replace(log, steps=np.maximum(log.steps // STEP_FACTOR, 1)))


def explained_cost(problem: FreedProblem) -> float:
    """Return the cost up to which a point explains a log [dimensionless].

    Returns
    -------
    float
        Half a sum of squares [dimensionless].
    """
    return 0.5 * EXPLAINED * len(problem.log.measured)


def cost_of(point: Point) -> float:
    """Return the misfit of a point [dimensionless]."""
    return point.cost
