"""`likeliest(searches) -> list[Ended]`: where searches for the motion form's unknowns end, on ever longer beginnings.

A start is brought near under larger noise, then searched on the first seconds; what explains those goes on to more of
the log. Both structures of friction are searched in turn, so that neither is searched in vain where the other explains.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimation.fits.descent import Point, descend, descend_together
from estimation.fits.freed_problem import FreedProblem
from estimation.fits.greybox_log import GreyBoxLog
from estimation.fits.greybox_problem import search_bounds
from estimation.models.greybox import GreyBoxModel
from estimation.models.motion import LINEAR, UNKNOWNS
from plant.arrays import Array

SCREENED = 4_000
"""Samples on which starts are compared."""

SEARCHED = 10_000
"""Samples on which a start that explains those is carried on; a longer log goes on from where it ends."""

UNCHANGED = (1.0, 1.0)
"""Factors that leave the noise as it is [dimensionless]."""

WAYS: tuple[tuple[tuple[float, float], tuple[float, float]], ...] = (
    ((1.0, 1e6), (1.0, 1e3)),
    (UNCHANGED, UNCHANGED),
    ((1e2, 1e6), (1.0, 1e3)),
)
"""Ways down to the optimum: factors on variance and random walk of the residual while starts are screened and while
they are brought near. With the true, small noise the least misfit of leakage piles up into the position and hides other
ways down; with a larger walk what counts is increments. Where the piston sticks, straight down is often the shorter."""

SCREENING, NEARING, FINISHING = 10, 12, 25
"""Evaluations of the model in the three stages."""

NEAR_ENOUGH = 0.01
"""Cost that a further step must promise while a start is only brought near [dimensionless]."""

ENOUGH = 0.1
"""The same while one is searched on the short beginning [dimensionless]."""

FINALISTS = 3
"""Starts that are carried on each way, the likeliest of each way first, until one explains the log."""

ROUGHLY = 2
"""By how many times model steps are longer while a start is only brought near."""

EXPLAINED = 1.1
"""Mean squared normalised residual up to which a form explains the log [dimensionless]."""

HOPELESS = 3.0
"""The same from which no other than the likeliest start of each way is tried [dimensionless]."""

SAME_COST, SAME_MODULUS = 0.02, 0.01
"""Relative difference of misfits, and of bulk moduli, up to which two starts came to the same pit [fraction]."""


@dataclass(frozen=True, eq=False)
class MotionSearch:
    """The search for the unknowns under one structure of friction.

    Parameters
    ----------
    whole : FreedProblem
        The problem on the whole log.
    part, short : FreedProblem
        The same on its first `SEARCHED` and `SCREENED` samples.
    guesses : list of ndarray, shape (unknowns,)
        Where it begins [dimensionless].
    bounds : tuple of ndarray, shape (unknowns,)
        How far it may go [dimensionless].
    """

    whole: FreedProblem
    part: FreedProblem
    short: FreedProblem
    guesses: list[Array]
    bounds: tuple[Array, Array]

    @classmethod
    def of(cls, form: GreyBoxModel, log: GreyBoxLog, starts: Sequence[dict[str, float]]) -> "MotionSearch":
        """Return the search of a form on a log.

        Parameters
        ----------
        form : GreyBoxModel
            One of `estimation.models.motion.MOTION_FORMS`.
        log : GreyBoxLog
            The log.
        starts : sequence of dict
            First guesses of the unknowns [SI].

        Returns
        -------
        MotionSearch
            The search.
        """
        whole = FreedProblem(form, log, UNKNOWNS, LINEAR)
        guesses = [whole.model.theta(start) for start in starts]
        bounds = search_bounds(whole.model, guesses, {"speed_lead": (0.0, 0.5 * log.sample_time)})
        part, short = (whole.on(log.beginning(samples)) for samples in (SEARCHED, SCREENED))
        return cls(whole, part, short, guesses, bounds)

    def brought_near(self, rank: int, screened: dict[int, list[Point]]) -> Iterator[Array]:
        """Yield where the starts of a rank lead on the short beginning under larger noise.

        One whose misfit is over what explains the log with the larger noise too is left out, and one that comes to
        where another of its rank did.

        Parameters
        ----------
        rank : int
            0 for the likeliest start of each way.
        screened : dict
            Starts as they were screened, likeliest first, by way; filled in here.

        Yields
        ------
        ndarray, shape (unknowns,)
            Fitted coordinates [dimensionless].
        """
        reached: list[Point] = []
        for way, (first, second) in enumerate(WAYS):
            if way not in screened:
                screen = self._roughly(first)
                points = descend_together(screen.at_each, self.guesses, SCREENING, self.bounds, NEAR_ENOUGH)
                screened[way] = sorted(points, key=cost_of)
            begun = screened[way][rank].theta
            if second == UNCHANGED:
                yield begun
                continue
            near = descend(self._roughly(second).at, begun, NEARING, self.bounds, NEAR_ENOUGH)
            if near.cost < explained(self.short) and not any(self._same_pit(near, other) for other in reached):
                yield near.theta
            reached.append(near)

    def _roughly(self, factors: tuple[float, float]) -> FreedProblem:
        """Return the problem on the short beginning with more noise and longer model steps."""
        log = self.short.log.softened(*factors)
        return self.short.on(replace(log, steps=np.maximum(log.steps // ROUGHLY, 1)))

    def _same_pit(self, one: Point, other: Point) -> bool:
        moved = abs(np.log(bulk_modulus(self.whole, one) / bulk_modulus(self.whole, other)))
        return abs(one.cost - other.cost) < SAME_COST * other.cost and bool(moved < SAME_MODULUS)


@dataclass(frozen=True, eq=False)
class Ended:
    """Where a search ended.

    Parameters
    ----------
    search : MotionSearch
        The search.
    point : Point
        The best point that it found, on the longest beginning that it came to.
    explains : bool
        Whether it explains the log's first `SEARCHED` samples.
    """

    search: MotionSearch
    point: Point
    explains: bool


def likeliest(searches: Sequence[MotionSearch]) -> list[Ended]:
    """Return where each of several searches ended, in their order; all end where one explains the log.

    Parameters
    ----------
    searches : sequence of MotionSearch
        One a structure of friction.

    Returns
    -------
    list of Ended
        One of each.
    """
    best = [search.short.at(search.guesses[0]) for search in searches]
    screened: list[dict[int, list[Point]]] = [{} for _ in searches]
    for rank in range(FINALISTS):
        for i, search in enumerate(searches):
            wanted = explained(search.short)
            for near in search.brought_near(rank, screened[i]):
                point = descend(search.short.at, near, FINISHING, search.bounds, ENOUGH, wanted=wanted)
                best[i] = min(best[i], point, key=cost_of)
                if point.cost >= wanted:
                    continue
                more = descend(search.part.at, point.theta, FINISHING, search.bounds, wanted=explained(search.part))
                if more.cost < explained(search.part):
                    best[i] = more
                    return [Ended(one, at, one is search) for one, at in zip(searches, best, strict=True)]
        if all(point.cost > HOPELESS * explained(one.short) for one, point in zip(searches, best, strict=True)):
            break
    ends = [descend(one.short.at, at.theta, FINISHING, one.bounds) for one, at in zip(searches, best, strict=True)]
    return [Ended(one, at, explains=False) for one, at in zip(searches, ends, strict=True)]


def explained(problem: FreedProblem) -> float:
    """Return the misfit up to which a point explains a log [dimensionless].

    Parameters
    ----------
    problem : FreedProblem
        The problem.

    Returns
    -------
    float
        Half a sum of squares [dimensionless].
    """
    return 0.5 * EXPLAINED * len(problem.log.measured)


def bulk_modulus(problem: FreedProblem, point: Point) -> float:
    """Return the bulk modulus of a point [Pa]."""
    return problem.model.values(point.theta)["bulk_modulus"]


def cost_of(point: Point) -> float:
    """Return the misfit of a point [dimensionless]."""
    return point.cost
