"""Screening: a few steps from each start rank the hypotheses before any is searched to its optimum."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import product

import numpy as np

from estimation.fits.greybox.descent import Point
from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.greybox.parallel_descents import Way, descend_in_turn
from estimation.fits.hypotheses import DELIVERY, Hypothesis
from estimation.fits.hypothesis_search.coarse_search import NEAR_RADIUS, SLIGHT, coarse_log, void_if_quiet
from estimation.fits.hypothesis_search.explanation import Trial
from estimation.fits.hypothesis_search.wide_log import usual_values
from estimation.fits.hypothesis_search.wide_problem import (
    flow_bounds,
    hypothesis_problem,
    misread_start,
    own_starts,
    parameters_at_end,
    worn_start,
)

SCREENING = 7
"""Evaluations of the model per start [count]."""

NEARLY_BEST = 3.0
"""Cost over that of the best start up to which other starts count [dimensionless]."""


def screen(
    log: GreyBoxLog,
    together: tuple[Hypothesis, ...],
    starts: Sequence[Mapping[str, float]],
    wanted: float = np.inf,
    every: int = 1,
) -> Iterator[Trial]:
    """Yield the best point from each start after a few steps; fewer steps if it cannot win.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.
    together : tuple of Hypothesis
        The set of hypotheses, the new one last.
    starts : sequence of Mapping[str, float]
        Where searches begin [SI].
    wanted : float
        Cost above which a result is of no use [dimensionless].
    every : int
        How many samples are merged into one, see `decimated` [count].
    """
    absent = usual_values(log)
    asked = [{together[-1].late: delay} if delay else dict[str, float]() for delay in together[-1].delays]
    known = parameters_at_end(together[:-1])
    problems = [
        (delays, hypothesis_problem(coarse_log(log, delays, together, every), together, *known)) for delays in asked
    ]
    begun = own_starts(log, together[-1])
    ways: list[Way] = []
    of_way: list[tuple[int, Mapping[str, float], FreedProblem]] = []
    for place, start in enumerate(starts):
        worn = worn_start(log, {**absent, **start}) if together[-1] == DELIVERY else ()
        for (delays, problem), own in product(problems, (*begun, *worn)):
            guess = problem.model.theta({**absent, **start, **own})
            for begin in (guess, *misread_start(problem, guess, together[-1])):
                ways.append(Way(problem.at_each, begin, flow_bounds(problem.model, [begin], log)))
                of_way.append((place, delays, problem))
    tried: list[list[Trial]] = [[] for _ in starts]

    def after(way: int, point: Point) -> float:
        place, delays, problem = of_way[way]
        found = Trial(together, point, problem.model.values(point.theta), delays, absent)
        tried[place].append(void_if_quiet(log, found))
        return NEARLY_BEST * tried[place][-1].cost

    descend_in_turn(ways, SCREENING, wanted, after, radius=NEAR_RADIUS, least_share=SLIGHT)
    yield from (min(each, key=lambda one: one.cost) for each in tried)


def promising_starts(
    starts: Sequence[Mapping[str, float]], screened_each: Sequence[Sequence[Trial]]
) -> list[Mapping[str, float]]:
    """Return the starts from which good hypotheses ended near their own best.

    Parameters
    ----------
    starts : sequence of Mapping[str, float]
        Where searches began [SI].
    screened_each : sequence of sequence of Trial
        Results of the hypotheses from each start.

    Returns
    -------
    list of Mapping[str, float]
        Some of the starts, or all.
    """
    bests = [min(one.cost for one in each) for each in screened_each]
    near = [each for each, best in zip(screened_each, bests, strict=True) if best <= NEARLY_BEST * min(bests)]
    kept = [
        any(each[i].cost <= NEARLY_BEST * min(one.cost for one in each) for each in near) for i in range(len(starts))
    ]
    return [start for start, keep in zip(starts, kept, strict=True) if keep]


def screened_hypotheses(
    log: GreyBoxLog,
    asked: Iterable[Hypothesis],
    starts: Sequence[Mapping[str, float]],
    likely: Sequence[Mapping[str, float]],
    known: float,
    every: int,
) -> Iterator[Sequence[Trial]]:
    """Yield hypotheses from their starts, first those without a predicted gain; searches far from the best end early.

    The first ones begin at every start, the others at the ``likely`` ones. If one of the first costs less than all
    known, the others begin where it did.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.
    asked : iterable of Hypothesis
        The hypotheses.
    starts, likely : sequence of Mapping[str, float]
        Where searches begin [SI].
    known : float
        The least cost so far [dimensionless].
    every : int
        How many samples are merged into one, see `decimated` [count].
    """
    lower: list[Sequence[Trial]] = []
    for one in sorted(asked, key=lambda each: not each.far):
        from_these = starts if one.far else promising_starts(starts, lower) if lower else likely
        found = [*screen(log, (one,), from_these, NEARLY_BEST * known, every)]
        if one.far and min(each.cost for each in found) < known:
            lower.append(found)
        known = min(known, *(each.cost for each in found))
        yield found
