"""`explain(log, parameters, ...) -> Explanation`: the hypotheses that explain a log, alone or in pairs.

A log that the plain flow form does not explain is fitted first under the hypotheses with the largest predicted gain,
then under the others, then under pairs with the likeliest. No hypothesis is added without need: it would only widen the
interval.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from estimation.fits.greybox.descent import Point
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.hypotheses import DELIVERY, ENCODER_ZERO, HYPOTHESES, START_LOAD, VOLUME, Hypothesis
from estimation.fits.hypothesis_search.coarse_search import coarse_log, vanished_values
from estimation.fits.hypothesis_search.commonly_hidden import fit_of_delivery, rig_and_load, with_delivery, with_zero
from estimation.fits.hypothesis_search.conclusion import Accepted, conclude, is_explained
from estimation.fits.hypothesis_search.decimation import SHORT_LOG, Decimation, cost_over_noise, decimation_for
from estimation.fits.hypothesis_search.decimation_limit import decimation_limit
from estimation.fits.hypothesis_search.explanation import Explanation, Trial
from estimation.fits.hypothesis_search.final_fits import (
    EQUAL_DISTANCE,
    REQUIRED_GAIN,
    with_pressure_filter,
    without_vanished_effect,
)
from estimation.fits.hypothesis_search.predicted_gains import by_predicted_gain, predicted_gain_beside
from estimation.fits.hypothesis_search.ranking import (
    NEARLY_AS_GOOD,
    differ_in_optimum,
    likeliest_sets,
    ranked,
    ranked_optima,
    refined_sets,
)
from estimation.fits.hypothesis_search.screening import NEARLY_BEST, promising_starts, screen, screened_hypotheses
from estimation.fits.hypothesis_search.stuck_valve import stuck_instead
from estimation.fits.hypothesis_search.wide_log import (
    usual_values,
    widened_log,
    with_balance,
    without_delays,
)
from estimation.fits.hypothesis_search.wide_problem import hypothesis_problem, own_starts
from plant.eha.model import EhaParameters

NOISE_COST = 1.05
"""Cost of an explanation over that of noise below which no other set of hypotheses is searched [dimensionless]."""

VOLUME_GAIN = 50.0
"""Predicted gain in log-likelihood of another volume beside a pump that delivers less, from which the two are searched
together [dimensionless]; judged."""


def explain(
    log: GreyBoxLog,
    parameters: EhaParameters,
    starts: Sequence[Mapping[str, float]],
    accepted: Accepted,
    *,
    asked: Sequence[Hypothesis] = HYPOTHESES,
    paired: bool = True,
    hopeless: float = np.inf,
    by_mass: bool = False,
    homed: bool = False,
    useful: float = np.inf,
) -> Explanation | None:
    """Return the hypotheses that explain a log best, alone or in pairs.

    Parameters
    ----------
    log : GreyBoxLog
        The log, as the plain flow form sees it.
    starts : sequence of Mapping[str, float]
        First guesses of the plain form's unknowns [SI].
    accepted : callable
        ``accepted(fit)``: whether a fit explains the log.
    asked : sequence of Hypothesis
        Hypotheses that are tried alone; in pairs each may be joined by any other.
    paired : bool
        Whether pairs are tried if no hypothesis explains the log alone.
    hopeless : float
        Cost of the best single hypothesis from which no pairs are tried [dimensionless].
    by_mass : bool
        Whether mass is balanced while hypotheses are compared, as in the likelier plain fit; else volume. At high
        pressure the two differ by more than the effects that are searched for.
    homed : bool
        Whether the log shows that its encoder was homed at a stop.
    useful : float
        Cost above which a single hypothesis is of no use [dimensionless].

    Returns
    -------
    Explanation or None
        The likeliest; the gate decides whether it explains the log. None if it leaves far too much.
    """
    wide = with_balance(widened_log(log, parameters, starts[0]), 1.0 if by_mass else 0.0)
    plain = _plain_point(wide, starts[0])
    likely, others, _ = by_predicted_gain(wide, (), starts[0], asked)
    if homed and ENCODER_ZERO in others:  # far from mid-travel neither slopes nor a few steps predict its gain
        likely, others = [ENCODER_ZERO, *likely], [one for one in others if one is not ENCODER_ZERO]
    left = cost_over_noise(wide, plain.cost)
    spared = Decimation(decimation_limit(wide, starts[0], decimation_for(wide, left)), left, starts)
    finished = _single_hypotheses(wide, plain.cost, likely, others, spared, accepted, useful)
    if paired:
        finished = ranked([*finished, *fit_of_delivery(wide, finished, spared, accepted)])
    finished = _distinct([with_pressure_filter(wide, finished[0]), *finished])
    if paired and homed:
        finished = _distinct([*finished, *with_zero(wide, finished[0], spared, accepted)])
    if paired and finished[0].cost < hopeless and not _explains_by_itself(wide, finished[0], accepted):
        finished = _best_and_pairs(wide, finished, starts[0], accepted)
        if begun := [one for one in asked if one.from_first_sample and one.free == START_LOAD.free]:
            finished = _distinct([*finished, *rig_and_load(wide, begun[0], finished[0], spared, accepted)])
        finished = _distinct([with_pressure_filter(wide, finished[0]), *finished])
    if is_explained(finished[0], accepted):
        finished = _with_smaller_set(without_vanished_effect(wide, finished[0]), finished, accepted)
        stuck = [one for one in stuck_instead(wide, finished[0], spared) if is_explained(one, accepted)]
        finished = [*stuck, *finished[len(stuck) :]]
    if paired:
        worn = with_delivery(wide, finished[0], spared, accepted)
        finished = _distinct([*_cheaper_pairs(finished[0], worn, finished[0].cost), *finished])
    best = finished[0]
    if not best.fits:
        return None
    rivals = [one for one in finished[1:] if one.fits and one.cost < best.cost + EQUAL_DISTANCE]
    return conclude(wide, parameters, (best, *rivals), accepted)


def _single_hypotheses(
    log: GreyBoxLog,
    plain: float,
    likely: Sequence[Hypothesis],
    others: Sequence[Hypothesis],
    spared: Decimation,
    accepted: Accepted,
    useful: float = np.inf,
) -> list[Trial]:
    """Return single hypotheses, best first: those of largest predicted gain, and all if these do not explain the log.

    If the plain form leaves little, starts from which the first hypothesis got nowhere are not tried again.
    """
    starts, every = spared.starts, spared.every
    begun = [[*screen(log, (likely[0],), starts, every=every)]]
    if decimation_for(log, spared.left) == 1 and len(log.drives) >= SHORT_LOG:
        places = [i for i, start in enumerate(starts) if start in promising_starts(starts, begun)]
        ways = [begun[0][i] for i in places]
        places = [i for n, i in enumerate(places) if all(differ_in_optimum(one, ways[n]) for one in ways[:n])]
        starts, begun = [starts[i] for i in places], [[begun[0][i] for i in places]]
    begun += [[*screen(log, (one,), starts, every=every)] for one in likely[1:]]
    ended = ranked_optima(log, begun, spared=spared)
    finished = refined_sets(log, ended, spared=spared._replace(starts=promising_starts(starts, begun)), useful=useful)
    if is_explained(finished[0], accepted) and finished[0].cost < plain - REQUIRED_GAIN:
        # a stuck valve was reported as a small step of leakage, with residuals of 1.1 times the noise
        others = [one for one in others if one.far] if cost_over_noise(log, finished[0].cost) > NOISE_COST else []
    if not others:
        return finished
    known = finished[0].cost
    more = screened_hypotheses(log, others, starts, promising_starts(starts, begun), known, every)
    return ranked([*finished, *likeliest_sets(log, more, known, spared)])


def _best_and_pairs(
    log: GreyBoxLog, singles: Sequence[Trial], plain: Mapping[str, float], accepted: Accepted
) -> list[Trial]:
    """Return the best single hypothesis, and the pairs that explain a log better than it.

    Pairs with the second best are tried too if it is about as good, unless a pair with the best explains the log to the
    noise, or leaves so much that no pair will explain it.
    """
    first, second = singles[0], singles[1] if len(singles) > 1 else None
    pairs = _hypothesis_pairs(log, first, plain, accepted)
    explained = bool(pairs) and is_explained(pairs[0], accepted)
    near = explained or cost_over_noise(log, first.cost) < NEARLY_BEST
    sought = not (explained and cost_over_noise(log, pairs[0].cost) < NOISE_COST)
    as_good = second and second.cost <= NEARLY_AS_GOOD * first.cost and not _is_same_fit(first, second)
    if second and near and as_good and sought:
        least = min(one.cost for one in (first, *pairs))
        pairs += _hypothesis_pairs(log, second, plain, accepted, rivalled=least)
    return _distinct([first, *pairs])


def _hypothesis_pairs(
    log: GreyBoxLog, first: Trial, plain: Mapping[str, float], accepted: Accepted, *, rivalled: float = np.inf
) -> list[Trial]:
    """Return the pairs of hypotheses that explain a log better than the first one alone, best first.

    The second hypotheses with the largest predicted gain, and those that slopes cannot predict, are tried first; all
    others only if these do not explain the log. Slopes are taken where the first hypothesis has moved to absorb the
    second one's effect. The best pair is fitted to the end in any case. Beside a rival of the best, ``rivalled`` is the
    lowest cost so far, and a pair counts only if it costs less.
    """
    late = without_delays(log, first.delays)
    taken = {one.name for one in first.together}
    asked = [one for one in HYPOTHESES if one.name not in taken]
    likely, others, _ = by_predicted_gain(late, first.together, first.values, asked)
    begun = [_restart_values(log, first), {**plain, **own_starts(log, first.together[-1])[0]}]
    left = cost_over_noise(log, first.cost)
    every = decimation_limit(log, first.coarse or first.values, decimation_for(log, left), first.together, first.delays)
    spared = Decimation(every, left, begun)
    long, useful = len(log.drives) >= SHORT_LOG, min(first.cost, rivalled) - REQUIRED_GAIN
    if long:  # only pairs that explain the log are reported
        useful = min(useful, NEARLY_BEST * first.cost / left)
    at_first = [*likely, *(one for one in others if one.far)]
    nearer = [[*screen(late, (*first.together, one), begun, every=spared.every)] for one in at_first]
    least = min(first.cost, rivalled)
    ended = ranked_optima(late, nearer, least, spared) if nearer else []
    pairs = refined_sets(late, ended, least, spared, useful)
    useful = _useful_cost(pairs, useful)
    if not pairs or not is_explained(pairs[0], accepted):
        known = min([least, *(one.cost for one in pairs[:1])])
        wanted, begun = NEARLY_AS_GOOD * known, promising_starts(begun, nearer) if long and nearer else begun
        more = [screen(late, (*first.together, one), begun, wanted, spared.every) for one in others if not one.far]
        if more:
            pairs = ranked([*pairs, *likeliest_sets(late, more, known, spared, useful)])
    return _cheaper_pairs(first, pairs, least)


def _cheaper_pairs(first: Trial, pairs: Iterable[Trial], least: float) -> list[Trial]:
    """Return the pairs that cost less than all before, with the delays of the first hypothesis."""
    better = (one for one in pairs if one.cost < least - REQUIRED_GAIN)
    return [replace(one, delays={**first.delays, **one.delays}) for one in better]


def _useful_cost(pairs: Sequence[Trial], useful: float) -> float:
    """Return the cost above which no further pair counts, given the known ones, the best first."""
    return min(useful, pairs[0].cost + EQUAL_DISTANCE) if pairs and pairs[0].fits else useful


def _plain_point(log: GreyBoxLog, plain: Mapping[str, float]) -> Point:
    """Return the end of the plain form's search, with one model step per sample."""
    problem = hypothesis_problem(coarse_log(log, {}, ()), ())
    return problem.at(problem.model.theta({**usual_values(log), **plain}))


def _with_smaller_set(fewer: Trial, finished: Sequence[Trial], accepted: Accepted) -> list[Trial]:
    """Return the results with a smaller set of hypotheses in place of all that contain it, if it explains the log."""
    if fewer is finished[0] or not is_explained(fewer, accepted):
        return [*finished]
    return [fewer, *(one for one in finished[1:] if not all(each in one.together for each in fewer.together))]


def _explains_by_itself(log: GreyBoxLog, tried: Trial, accepted: Accepted) -> bool:
    """Return whether a set of hypotheses explains a log and is not a worn pump in place of a wrong area.

    A wrong area changes the ratio of delivery and a volume: both are tested then.
    """
    if not is_explained(tried, accepted):
        return False
    if tried.together != (DELIVERY,):
        return True
    return predicted_gain_beside(log, tried.together, tried.values, VOLUME).gain < VOLUME_GAIN


def _is_same_fit(one: Trial, other: Trial) -> bool:
    """Return whether two sets fit the same unknowns and reach the same optimum, such as a late and an early speed."""
    free, others = ({name for each in tried.together for name in each.free} for tried in (one, other))
    return free == others and not differ_in_optimum(one, other)


def _restart_values(log: GreyBoxLog, first: Trial) -> Mapping[str, float]:
    """Return the end of a search with long model steps as the next start, with vanished values reset."""
    ended = first.coarse or first.values
    return {**ended, **vanished_values(log, ended)}


def _distinct(tried: Iterable[Trial]) -> list[Trial]:
    """Return the best trial of each set of hypotheses, best first."""
    best: dict[frozenset[str], Trial] = {}
    for one in ranked(tried):
        best.setdefault(frozenset(each.name for each in one.together), one)
    return [*best.values()]
