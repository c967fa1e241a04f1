"""`rough_optima(log, ...)`: optima of the flow form's balances with long model steps.

Runs without slopes are cheap, so many guesses are compared first and the likeliest is followed. If that search explains
the log, no other is made; otherwise searches begin at the leakages and flow biases of all conditions.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import ceil

import numpy as np

from estimation.fits.flow.accumulator import first_stiffness
from estimation.fits.flow.guesses import guesses_about
from estimation.fits.greybox.descent import Point, cached_cost, descend
from estimation.fits.greybox.driven import driven_samples
from estimation.fits.greybox.fit import NEAR_ENOUGH, Search, coarse_optimum, explains_log
from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.greybox.problem import Problem
from estimation.fits.greybox.side_by_side import LANES
from estimation.fits.hypothesis_search.wide_problem import flow_bounds
from estimation.models.flow import (
    FLOW_FORM,
    HELD_FLOW_FORM,
    MASS_FLOW_FORM,
    STIFFNESS,
    form_with_relief,
    reaches_relief,
)
from estimation.models.greybox import GreyBoxModel
from plant.arrays import Array
from plant.eha.model import EhaParameters
from plant.spare_processors import map_cases

GUESSED_WITHIN = 0.3
"""First trust radius of a search from the likeliest guess [dimensionless]: half the distance between guesses of
leakage."""

SCREENED_SECONDS = 4.0
"""Length of the log's beginning on which starts are compared, at least: it tells wrong minima from right ones [s]."""

ROUGH_ENOUGH = 0.05
"""Half the sum of squares that a further step must promise while model steps are long [dimensionless]: their errors
shift the optimum by more than that. With 0.3, logs of a sine, whose minima are flat, took twice as many short steps
afterwards."""

UNLIKELY = 36.0
"""Difference of log-likelihood from which a balance has no weight beside another [dimensionless]."""

RIVAL_COST = 2.0 * UNLIKELY
"""The same between searches with long model steps, which have errors [dimensionless]."""


@dataclass(frozen=True, eq=False)
class RoughOptimum:
    """Optimum of one balance with long model steps.

    Parameters
    ----------
    problem : Problem
        The balance of the log, as it was searched.
    point : Point
        The optimum.
    bounds : tuple of ndarray, shape (unknowns,)
        Lowest and highest coordinates of the search [dimensionless].
    """

    problem: Problem
    point: Point
    bounds: tuple[Array, Array]

    @property
    def values(self) -> Mapping[str, float]:
        """The unknowns, with an accumulator's stiffness if the balance has none [SI]."""
        return {STIFFNESS: first_stiffness(self.problem.log), **self.problem.model.values(self.point.theta)}


def rough_optima(
    log: GreyBoxLog, parameters: EhaParameters, starts: Sequence[Mapping[str, float]]
) -> list[RoughOptimum]:
    """Return the optima of the balances with long model steps.

    A single rod may pump up both chambers, which a balance of volumes cannot follow. If no balance explains its log,
    the others start from the balance by mass, and their results count if they are far lower.

    Parameters
    ----------
    log : GreyBoxLog
        The log, as the flow form sees it.
    starts : sequence of Mapping[str, float]
        Where searches begin [SI].

    Returns
    -------
    list of RoughOptimum
        By volume, by mass, and by volume in held chambers.
    """
    relieved = reaches_relief(log.measured, parameters.relief_pressure)
    volume, mass, held = (
        form_with_relief(form) if relieved else form for form in (FLOW_FORM, MASS_FLOW_FORM, HELD_FLOW_FORM)
    )
    rough = _optima_from_first([volume, mass, held], log, parameters, starts)
    if not parameters.single_rod or any(map(_explains, rough)):
        return rough
    by_mass, by_volume, of_held = _optima_from_first([mass, volume, held], log, parameters, starts)
    least = min(one.point.cost for one in rough)
    return [by_volume, by_mass, of_held] if by_mass.point.cost < least - RIVAL_COST else rough


def _optima_from_first(
    forms: Sequence[GreyBoxModel], log: GreyBoxLog, parameters: EhaParameters, starts: Sequence[Mapping[str, float]]
) -> list[RoughOptimum]:
    """Return the optima of the balances with long model steps, each searched from the first one's."""
    afar = log.with_noise_at(parameters.bulk_modulus)
    begun = FreedProblem.of(forms[0], afar.beginning(_search(afar).screened).coarsened())
    guess, near = _optimum_from_guess(begun, afar, parameters, starts)
    screen = cached_cost(begun.at)
    if not near:  # in a wrong valley a search of the whole log uses up all its steps
        first = _best_optimum(forms[0], log, afar, starts, hopeful=True, screen=screen)
        if _explains(first):
            return [first, *_optima_of_others(forms[1:], log, afar, first)]
    first = _best_optimum(forms[0], log, afar, [guess], alone=True)
    others = _optima_of_others(forms[1:], log, afar, first, alone=True)
    if _explains(first) or _explains(others[0]):
        return _with_lost_restarted([first, *others], forms, log, afar)
    first = _best_optimum(forms[0], log, afar, [*starts, first.values], screen=screen)
    return [first, *_optima_of_others(forms[1:], log, afar, first)]


def _optima_of_others(
    forms: Sequence[GreyBoxModel], log: GreyBoxLog, afar: GreyBoxLog, first: RoughOptimum, *, alone: bool = False
) -> list[RoughOptimum]:
    """Return the optima of other forms, searched from the first one's, if they may count beside it."""
    wanted = first.point.cost + RIVAL_COST
    return map_cases(lambda form: _best_optimum(form, log, afar, [first.values], alone=alone, wanted=wanted), forms)


def _with_lost_restarted(
    rough: Sequence[RoughOptimum], forms: Sequence[GreyBoxModel], log: GreyBoxLog, afar: GreyBoxLog
) -> list[RoughOptimum]:
    """Return optima; those far behind the second are also searched from there.

    The first may end in a wrong minimum, and the third with it, while the second leaves it and explains the log.
    """
    second = rough[1]
    lost = [at for at, one in enumerate(rough) if one.point.cost > second.point.cost + RIVAL_COST]
    again = _optima_of_others([forms[at] for at in lost], log, afar, second, alone=True)
    nearer = dict(zip(lost, again, strict=True))
    return [min(one, nearer.get(at, one), key=lambda found: found.point.cost) for at, one in enumerate(rough)]


def _explains(one: RoughOptimum) -> bool:
    return explains_log(one.problem, one.point)


def _optimum_from_guess(
    problem: FreedProblem, log: GreyBoxLog, parameters: EhaParameters, starts: Sequence[Mapping[str, float]]
) -> tuple[Mapping[str, float], bool]:
    """Return the optimum from the likeliest guess about the first start, and whether it explains the log.

    The problem holds only the beginning of the log.
    """
    search = _search(log)
    around = {STIFFNESS: first_stiffness(log), **starts[0]}
    guesses = guesses_about(around, problem.model, parameters)
    likeliest = guesses[int(np.argmin(problem.costs(guesses, LANES)))]
    bounds = flow_bounds(problem.model, guesses, log)
    found = descend(problem.at, likeliest, search.evaluations, bounds, search.near_enough, GUESSED_WITHIN)
    return problem.model.values(found.theta), explains_log(problem, found)


def _search(log: GreyBoxLog) -> Search:
    # if the noise depends on bulk modulus, steps gain more than predicted
    near_enough = NEAR_ENOUGH if log.passes_on else ROUGH_ENOUGH
    return Search(screened=_samples_screened(log), near_enough=near_enough)


@lru_cache(maxsize=2)
def _samples_screened(log: GreyBoxLog) -> int:
    """Return the length of the beginning on which starts are compared, the same for all searches of a log [samples]."""
    speed = log.drives[:, FLOW_FORM.drives.index("motor_speed_rad_s")]
    return driven_samples(speed, ceil(SCREENED_SECONDS / log.sample_time))


def _best_optimum(
    form: GreyBoxModel,
    log: GreyBoxLog,
    afar: GreyBoxLog,
    starts: Sequence[Mapping[str, float]],
    *,
    alone: bool = False,
    wanted: float = np.inf,
    hopeful: bool = False,
    screen: Callable[[Array], Point] | None = None,
) -> RoughOptimum:
    """Return the best optimum from several starts, at first with position noise at the rig's bulk modulus."""
    search, fed = _search(log), {STIFFNESS: first_stiffness(log)}
    problem = FreedProblem.of(form, afar)
    guesses = [form.theta({**fed, **start}) for start in starts]
    bounds = flow_bounds(form, guesses, afar)
    if not log.passes_on:
        point = coarse_optimum(problem, guesses, search, bounds, wanted, hopeful=hopeful, screen=screen)
        return RoughOptimum(problem, point, bounds)
    point = coarse_optimum(problem, guesses, search, bounds, hopeful=hopeful, screen=screen)
    if np.isinf(point.cost):
        return RoughOptimum(problem, point, bounds)
    problem, modulus = problem.on(log), form.values(point.theta)["bulk_modulus"]
    guesses = [form.theta({**fed, **start, "bulk_modulus": modulus}) for start in starts]
    bounds = flow_bounds(form, guesses, log)
    again = [point.theta] if alone else [*guesses, point.theta]
    return RoughOptimum(problem, coarse_optimum(problem, again, search, bounds, wanted), bounds)
