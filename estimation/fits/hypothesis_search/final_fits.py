"""Final fits of sets of hypotheses: short model steps, balanced by volume and by mass."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from estimation.finding import NORMAL_95
from estimation.fits.greybox.descent import Point, descend
from estimation.fits.greybox.fit import Asked, GreyBoxFit, fit_at_solution
from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.greybox.play import omitted_play_note
from estimation.fits.greybox.spared_steps import LAST_EVALUATIONS, with_steps_where_needed
from estimation.fits.hypotheses import CHECKS_CRACK, PRESSURE_FILTERED, PRESSURE_LATE, Hypothesis
from estimation.fits.hypothesis_search.coarse_search import NEAR_RADIUS, after_descent, coarse_log
from estimation.fits.hypothesis_search.decimation import SHORT_LOG, cost_over_noise
from estimation.fits.hypothesis_search.explanation import Trial
from estimation.fits.hypothesis_search.fit_objections import is_too_close
from estimation.fits.hypothesis_search.wide_log import balances_mass, usual_values, with_balance, without_delays
from estimation.fits.hypothesis_search.wide_problem import flow_bounds, hypothesis_problem, parameters_at_end
from estimation.models.completed_flow import CRACKS
from estimation.models.flow import STIFFNESS
from estimation.models.wide_flow import QUICKNESS
from estimation.models.wrong_pressure import SETTLING
from plant.arrays import Array
from plant.components.oil import ATMOSPHERE

FINISHING = 12
"""Evaluations of the model in each round of the last search, with short model steps."""

ROUNDS = 6
"""Most rounds of the last search, while each gains enough to tell hypotheses apart [count]."""

UNFINISHED = 10.0
"""Cost over that of noise from which a set of hypotheses is not fitted with short model steps [dimensionless];
explanations reach 1.2."""

FINISHED, REACHED = 0.7, 1.5
"""A search with short model steps goes on while its steps promise to reduce the cost to the first share (six such
rounds make an eighth), but never needs to promise less than the second times the cost of noise [fractions]."""

FAR_BEHIND = 1.2
"""Cost after twelve evaluations over the cost that would be of use, above which the search ends [dimensionless]."""

UNBELIEVABLE_COST = float(np.finfo(np.float64).max)
"""Cost of a fit that does not mean what its hypotheses say, so that it is never believed [dimensionless]."""

VALVES = {*CRACKS, *CHECKS_CRACK.free}
"""Drops at which make-up valves open, of each and of both."""

LEAST_DEVIATION_RATIO = 0.7
"""Ratio of the deviation of bulk modulus after and before parameters are added, below which the model chatters
[dimensionless]: added parameters cannot reduce it. Two of 58 logs had 0.06 and 0.26, one of them 9 deviations off, and
all others 0.78 to 2."""

NEGLIGIBLE_SHARE = 1e-3
"""Share of the cost below which a gain means nothing, if far more than noise is left [fraction]; judged."""

REQUIRED_GAIN = 10.0
"""Gain in log-likelihood below which a hypothesis is not accepted, and a drift of pressure is even [dimensionless]."""

RIVAL_DISTANCE = 60.0
"""Difference of log-likelihood up to which a rival is fitted to the end, with short model steps [dimensionless]."""

EQUAL_DISTANCE = 15.0
"""Difference of log-likelihood up to which two sets of hypotheses explain a log equally well [dimensionless]."""


def final_fit(log: GreyBoxLog, tried: Trial, useful: float = np.inf, *details: str) -> Trial:
    """Return the final fit of a set of hypotheses, balanced by volume and by mass.

    Balanced by mass, the inner circuit is compliant as in the plain form. If a log does not distinguish the two
    balances, neither is used alone: they may differ by three deviations. The balance in which the set was searched
    comes first, and the other is dropped if it will not cost as little.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.
    tried : Trial
        The set, at the end of its search with long model steps.
    useful : float
        Cost above which it is of no use [dimensionless].
    *details : str
        Unknowns that are fitted as well in either balance.

    Returns
    -------
    Trial
        The set at the end of its search with short model steps, with its fits. If it no longer means what its
        hypotheses say, its cost is `UNBELIEVABLE_COST`.
    """
    row = without_delays(log, tried.delays)
    done: list[tuple[Trial, FreedProblem]] = []
    last = (*details, *parameters_at_end(tried.together))
    sought_by = balances_mass(coarse_log(log, {}, tried.together))
    for share in (1.0, 0.0) if sought_by else (0.0, 1.0):
        own, more = with_balance(row, share), (STIFFNESS, *last) if share else last
        problem, begun = hypothesis_problem(own, tried.together, *more), done[-1][0] if done else tried
        start = problem.model.theta({**usual_values(own), **begun.values})
        ended = _completed_search(problem, begun, start, *more, useful=useful)
        done.append((replace(ended, by_mass=bool(share)), problem))
        useful = min(useful, done[-1][0].cost + EQUAL_DISTANCE)
    done.sort(key=lambda one: one[0].cost)
    best = replace(done[0][0], coarse=tried.values)
    count = [one for one in done if one[0].cost <= best.cost + EQUAL_DISTANCE]
    first, *rivals = (_fit_at_end(problem, one.point, log) for one, problem in count)
    sound = best.meant and not is_too_close(first, log.passes_on)
    sound = sound and leaves_oil({**usual_values(row), **best.values}, first.std)
    if SETTLING in last:  # an even drift is better determined if it is fitted as one
        even = tuple(replace(one, at_end=()) if one.at_end == (SETTLING,) else one for one in tried.together)
        evenly = final_fit(log, replace(tried, together=even), best.cost + REQUIRED_GAIN, *details)
        if evenly.cost < best.cost + REQUIRED_GAIN:
            return replace(evenly, together=tried.together)
    if sound and all(one.told(best.values, first.std) for one in best.together):
        return replace(best, fits=(first, *(one for one in rivals if np.isfinite(one.std["bulk_modulus"]))))
    return replace(best, void=True, fits=(replace(first, cost=UNBELIEVABLE_COST),))


def leaves_oil(values: Mapping[str, float], std: Mapping[str, float]) -> bool:
    """Return whether the air that a fit finds leaves a liquid: air alone is never softer than oil that contains it.

    Parameters
    ----------
    values : Mapping[str, float]
        Parameters of the wide flow form [SI].
    std : Mapping[str, float]
        Their standard deviations; those without one are known [SI].

    Returns
    -------
    bool
        False if the bulk modulus of the liquid is surely negative (97.5 %, whatever the correlation of the two).
    """
    softness = values.get("air_softness", 0.0)
    if softness <= 0.0 or values["air_onset"] >= 0.0:  # `bulk_modulus` is the liquid's if air enters later
        return True
    stiffness, pressure, quickness = values["bulk_modulus"], values["stated_pressure"], values[QUICKNESS]
    bubbles = softness / pressure * (pressure / ATMOSPHERE) ** quickness  # over the oil's volume
    share = stiffness * (1.0 - quickness) * bubbles / pressure  # of the compliance that is due to air
    doubt = std.get("air_softness", 0.0) / softness + std.get("bulk_modulus", 0.0) / stiffness
    return not share * (1.0 - NORMAL_95 * doubt) > 1.0


def with_details(log: GreyBoxLog, tried: Trial) -> Trial:
    """Return the final fit of a set of hypotheses that explains a log, with the details of valves and accumulator free.

    While hypotheses are compared, the cracking drops of make-up valves and the accumulator are held, since they would
    absorb the effect. Once the effect is known they are fitted: to neglect a drop of 2 kPa puts leakage and bulk
    modulus several deviations off. See decision 378.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.
    tried : Trial
        The set, fitted to the end.

    Returns
    -------
    Trial
        The set; unchanged if it fits valves of its own, if it would no longer mean what it says, or if its valves
        chatter.
    """
    if VALVES & {name for one in tried.together for name in (*one.free, *one.beside)}:
        return tried
    further = final_fit(log, tried, np.inf, STIFFNESS, *CRACKS)
    if "pilot_share" in further.values and further.fits and omitted_play_note(further.fit.play):
        # corners of piloted valves end a search early, and its residuals then look like play
        again = final_fit(log, further, np.inf, STIFFNESS, *CRACKS)
        further = replace(again, coarse=tried.coarse) if again.cost < further.cost else further
    if further.cost > tried.cost:
        return tried
    known, before = (one.fit.std["bulk_modulus"] for one in (further, tried))
    return further if known >= LEAST_DEVIATION_RATIO * before else tried


def with_pressure_filter(log: GreyBoxLog, tried: Trial) -> Trial:
    """Return the final fit of a set with a second-order pressure filter in place of a delay and a lag, if likelier.

    The delay of a filter is no whole number of samples: a modelled delay of 8 ms for one of 7.5 ms put bulk modulus 4
    deviations off.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.
    tried : Trial
        The set, fitted to the end unless it is far from the log.

    Returns
    -------
    Trial
        The set unchanged if its pressure is not late or only lags, or if no filter explains the log better.
    """
    delay = tried.delays.get(PRESSURE_LATE.late, 0.0)
    if PRESSURE_LATE not in tried.together or delay <= 0.0:
        return tried
    name, time = PRESSURE_FILTERED.free
    lag = tried.values[name]
    late = delay + lag  # the impulse response keeps its first and second moments
    values = {**tried.values, name: late, time: (0.5 * (late**2 - lag**2)) ** 0.5}
    together = tuple(PRESSURE_FILTERED if one == PRESSURE_LATE else one for one in tried.together)
    delays = {channel: one for channel, one in tried.delays.items() if channel != PRESSURE_LATE.late}
    filtered = final_fit(log, replace(tried, together=together, values=values, delays=delays), tried.cost)
    return filtered if filtered.cost < tried.cost else tried


def without_vanished_effect(log: GreyBoxLog, tried: Trial) -> Trial:
    """Return the final fit of a set without a hypothesis whose effect vanished.

    A second hypothesis may lead a search out of a false minimum, and its effect then vanishes. Air in the oil was found
    together with a stuck make-up valve, whose conductance was 1.02 ± 0.05 times that of the other valve.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.
    tried : Trial
        Several hypotheses, with their final fit.

    Returns
    -------
    Trial
        The set unchanged if each of its effects is present or needed.
    """
    if len(tried.together) < 2 or not tried.fits:
        return tried
    for one in tried.together:
        if _is_absent(one, tried, (2.0 * REQUIRED_GAIN) ** 0.5):
            rest = tuple(other for other in tried.together if other != one)
            values = {**tried.values, **{name: tried.rig[name] for name in one.free}}
            fewer = final_fit(log, replace(tried, together=rest, values=values), tried.cost + REQUIRED_GAIN)
            if fewer.cost < tried.cost + REQUIRED_GAIN:
                return fewer
    return tried


def _is_absent(one: Hypothesis, tried: Trial, deviations: float) -> bool:
    """Return whether all unknowns of a hypothesis ended within so many deviations of "no effect"."""
    std, delayed_too = tried.fit.std, len(one.delays) > 1 and one.late in tried.delays
    near = (abs(tried.values[name] - tried.rig[name]) <= deviations * std.get(name, 0.0) for name in one.free)
    return not delayed_too and all(near)


def _fit_at_end(problem: FreedProblem, point: Point, log: GreyBoxLog) -> GreyBoxFit:
    least, _ = flow_bounds(problem.model, [point.theta], log)
    return fit_at_solution(problem, point, least=least, asked=Asked(warned=False))


def _completed_search(problem: FreedProblem, tried: Trial, start: Array, *more: str, useful: float = np.inf) -> Trial:
    """Return the end of a search with short model steps: first where they matter, at last everywhere."""
    best = _search_with_short_steps(problem, tried, start, *more, useful=useful)
    bounds = flow_bounds(problem.model, [best.point.theta], problem.log)
    point = descend(problem.at, best.point.theta, LAST_EVALUATIONS, bounds, radius=NEAR_RADIUS, wanted=useful)
    return replace(best, point=point, values=problem.model.values(point.theta))


def _search_with_short_steps(
    problem: FreedProblem, tried: Trial, start: Array, *more: str, useful: float = np.inf
) -> Trial:
    """Return the optimum with short model steps, which may be far from that with long ones.

    Each round determines anew which samples need them.
    """
    log = problem.log

    def further(one: Trial, theta: Array) -> Trial:
        wanted = min(useful, _cost_to_promise(log, one.cost))
        return after_descent(with_steps_where_needed(problem, theta).log, one, theta, FINISHING, *more, wanted=wanted)

    best = further(tried, start)
    for _ in range(ROUNDS - 1):
        if best.cost > FAR_BEHIND * useful:
            break
        again = further(best, best.point.theta)
        gained = best.cost - again.cost
        if gained > 0.0:
            best = again
        if gained < max(RIVAL_DISTANCE, NEGLIGIBLE_SHARE * best.cost):
            break
    return best


def _cost_to_promise(log: GreyBoxLog, cost: float) -> float:
    """Return the cost that a search with short model steps must promise to reach, or else it ends."""
    if len(log.drives) < SHORT_LOG or not np.isfinite(cost):
        return np.inf
    return max(FINISHED * cost, REACHED * cost / cost_over_noise(log, cost))


def is_hopeless(log: GreyBoxLog, cost: float) -> bool:
    """Return whether a long log is so far from explained that short model steps cannot help.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.
    cost : float
        Half the sum of squares that is left [dimensionless].
    """
    return len(log.drives) >= SHORT_LOG and cost_over_noise(log, cost) >= UNFINISHED
