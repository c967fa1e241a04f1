"""Ranking of sets of hypotheses: optimum on few samples, refinement on all samples, final fit."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.hypothesis_search.coarse_search import coarse_log, search_coarsely
from estimation.fits.hypothesis_search.decimation import NO_DECIMATION, Decimation, cost_over_noise
from estimation.fits.hypothesis_search.explanation import Trial
from estimation.fits.hypothesis_search.final_fits import (
    NEGLIGIBLE_SHARE,
    REACHED,
    RIVAL_DISTANCE,
    UNFINISHED,
    final_fit,
    is_hopeless,
)
from estimation.fits.hypothesis_search.screening import NEARLY_BEST, screen
from estimation.fits.hypothesis_search.wide_log import usual_values
from estimation.fits.hypothesis_search.wide_problem import hypothesis_problem, parameters_at_end

FINALISTS, CARRIED = 3, 2
"""Hypotheses that are searched further, and starts of each [count]."""

NEARLY_AS_GOOD = 1.1
"""Factor on the cost of a finished set before others are compared with it [dimensionless]: the others have long model
steps, which have errors."""

STRAYED_RATIO = 1.05
"""Cost of a set with all samples over that with few, from which it has left its minimum [dimensionless]; the two mostly
differ by 1 %."""

MUCH_LEFT = 0.2
"""Largest share of the previous cost that the best set may leave, to be searched again with all samples [fraction]."""


def likeliest_sets(
    log: GreyBoxLog,
    tried: Iterable[Iterable[Trial]],
    known: float = np.inf,
    spared: Decimation = NO_DECIMATION,
    useful: float = np.inf,
) -> list[Trial]:
    """Return the most likely sets of hypotheses, each searched from several starts, best first.

    The first set is searched in any case: a few steps from a start do not show which predicted gain is largest. A set
    that cannot come close to the best, or to a known cost, is not searched to its optimum. If few samples were used
    (``spared``), all are used at the end. A set that leaves far more than any explanation is not fitted to the end.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.
    tried : iterable of iterable of Trial
        The sets, each from its starts.
    known : float
        The least cost so far [dimensionless].
    spared : Decimation
        Samples and starts of the search.
    useful : float
        Cost above which a set is of no use [dimensionless].

    Returns
    -------
    list of Trial
        Those that were searched and came near the best.
    """
    return refined_sets(log, ranked_optima(log, tried, known, spared), known, spared, useful)


def ranked_optima(
    log: GreyBoxLog, tried: Iterable[Iterable[Trial]], known: float = np.inf, spared: Decimation = NO_DECIMATION
) -> list[Trial]:
    """Return the most likely sets of hypotheses at their optima, on a decimated log if allowed.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.
    tried : iterable of iterable of Trial
        The sets, each from its starts.
    known : float
        The least cost so far [dimensionless].
    spared : Decimation
        Samples and starts of the search.

    Returns
    -------
    list of Trial
        Those that were searched, the best first.
    """
    known *= NEARLY_AS_GOOD
    first, *others = [ranked(one) for one in tried]
    sets = [first, *sorted(others, key=lambda one: one[0].cost)[: FINALISTS - 1]]
    carried = [[one[0], *(start for start in one[1:CARRIED] if start.cost < NEARLY_BEST * one[0].cost)] for one in sets]
    ended: list[Trial] = []
    for one in carried:
        wanted = min((known, *(other.cost for other in ended))) + RIVAL_DISTANCE
        best = search_coarsely(log, one[0], wanted, spared.every)
        for start in one[1:]:
            if differ_in_optimum(one[0], start):
                best = min(best, search_coarsely(log, start, min(wanted, best.cost), spared.every), key=_cost)
        ended.append(best)
    return ranked(ended)


def refined_sets(
    log: GreyBoxLog,
    ended: Sequence[Trial],
    known: float = np.inf,
    spared: Decimation = NO_DECIMATION,
    useful: float = np.inf,
) -> list[Trial]:
    """Return sets of hypotheses at their optima on all samples, the most likely with their final fit.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.
    ended : sequence of Trial
        The sets, at the end of a search that may have used few samples.
    known : float
        The least cost so far [dimensionless].
    spared : Decimation
        Samples and starts of the search.
    useful : float
        Cost above which a set is of no use [dimensionless].

    Returns
    -------
    list of Trial
        Those near the best, the best first.
    """
    known *= NEARLY_AS_GOOD
    if spared.every > 1:
        ended = [*_searched_on_all_samples(log, ended, known, spared)]
    best = min((known, *(one.cost for one in ended)))
    near = [one for one in ranked(ended) if one.cost <= best + RIVAL_DISTANCE]
    return ranked(one if is_hopeless(log, one.cost) else final_fit(log, one, useful) for one in near)


def _searched_on_all_samples(
    log: GreyBoxLog, ended: Iterable[Trial], known: float, spared: Decimation
) -> Iterator[Trial]:
    """Yield sets of hypotheses searched on with all samples, if they may still explain the log.

    A decimated log may have a minimum of its own, and a search with all samples may end in another. So the best set is
    searched again with all samples if it explains much but not all, or less than on few samples.
    """
    for place, one in enumerate(ranked(ended)):
        near = one.cost <= NEARLY_AS_GOOD * known + RIVAL_DISTANCE
        much = place == 0 and cost_over_noise(log, one.cost) < MUCH_LEFT * spared.left
        if near and (much or cost_over_noise(log, one.cost) < UNFINISHED):
            problem = hypothesis_problem(
                coarse_log(log, one.delays, one.together), one.together, *parameters_at_end(one.together[:-1])
            )
            theta = problem.model.theta({**usual_values(log), **one.values})
            begun = replace(one, point=replace(one.point, theta=theta))
            further = search_coarsely(log, begun, NEARLY_AS_GOOD * known + RIVAL_DISTANCE)
            fits = cost_over_noise(log, further.cost) < REACHED and further.cost < STRAYED_RATIO * one.cost
            if (
                place == 0
                and not fits
                and cost_over_noise(log, further.cost) < max(MUCH_LEFT * spared.left, UNFINISHED)
            ):
                again = ranked(screen(log, one.together, spared.starts))[:CARRIED]
                again = [start for start in again if differ_in_optimum(further, start)]
                further = min([further, *(search_coarsely(log, start, further.cost) for start in again)], key=_cost)
            known = min(known, further.cost)
            yield further
        else:
            yield one


def differ_in_optimum(one: Trial, other: Trial) -> bool:
    """Return whether two searches of one set ended at different optima, judged by the curvature of the cost.

    Parameters
    ----------
    one, other : Trial
        A set of hypotheses, from two starts.

    Returns
    -------
    bool
        Whether they did.
    """
    ours, theirs = ({name: delay for name, delay in tried.delays.items() if delay} for tried in (one, other))
    unlike = len(one.point.theta) != len(other.point.theta) or ours != theirs
    if unlike or abs(one.cost - other.cost) > NEGLIGIBLE_SHARE * one.cost:
        return True
    step = other.point.theta - one.point.theta
    return bool(0.5 * step @ one.point.gram @ step > NEGLIGIBLE_SHARE * one.cost)


def ranked(tried: Iterable[Trial]) -> list[Trial]:
    """Return the trials, best first.

    Parameters
    ----------
    tried : iterable of Trial
        In any order.

    Returns
    -------
    list of Trial
        By cost.
    """
    return sorted(tried, key=_cost)


def _cost(tried: Trial) -> float:
    return tried.cost
