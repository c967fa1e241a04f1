"""Coarse search for the optimum of a set of hypotheses, with one model step per sample."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from estimation.fits.greybox.descent import descend
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.hypotheses import LATEST, Hypothesis
from estimation.fits.hypothesis_search.decimation import cost_over_noise, decimated
from estimation.fits.hypothesis_search.explanation import Trial
from estimation.fits.hypothesis_search.fit_objections import QUIET
from estimation.fits.hypothesis_search.wide_log import usual_values, with_balance, without_delays
from estimation.fits.hypothesis_search.wide_problem import (
    AIR_ONSET,
    AIR_WIDTH,
    STEP_AT,
    STEP_WIDTH,
    flow_bounds,
    hypothesis_problem,
    parameters_at_end,
)
from estimation.models.wide_flow import LINEAR
from plant.arrays import Array

SETTLING = 40
"""Most evaluations of the model in one descent [count]."""

SLIGHT = 1e-4
"""Share of the cost that a further step must promise with long model steps [fraction]: their errors are larger."""

NEAR_RADIUS = 2.0
"""First trust radius of a search [dimensionless]: it begins where the plain form or a simpler hypothesis ended."""

FINEST_DELAY = 1e-3
"""Resolution of a delay in the search [s]; the remainder becomes part of the lag."""

MAY_VANISH, VANISHED = ("leakage_coefficient", "flow_bias", "makeup_conductance"), 1e-2
"""Parameters that a search may wrongly reduce to nothing, and the share of the rig's value below which it has."""

ONSETS, WIDTHS = np.linspace(0.03, 0.97, 21), (0.02, 0.07, 0.25)
"""Middle times of air entry that are tried once all else is known, and how long the entry takes [fraction of a log]."""

STEP_NEAR, STEP_WIDTHS = np.linspace(-0.02, 0.02, 41), (5e-4, 2e-3, 1e-2)
"""The same for a step of leakage, relative to the time that a descent finds: the cost has a local minimum at any quick
step. On rigs that leak little, a step changes pressure within milliseconds."""

LEAST_BETTER = 10.0
"""Gain in log-likelihood for which a change is moved to another time [dimensionless]: the required gain of a
hypothesis."""


def search_coarsely(log: GreyBoxLog, tried: Trial, wanted: float = np.inf, every: int = 1) -> Trial:
    """Return a set of hypotheses at its optimum, with one model step per sample or per few samples.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.
    tried : Trial
        The set, at the end of its search so far.
    wanted : float
        Cost above which the result is of no use, so that the search ends [dimensionless].
    every : int
        How many samples are merged into one, see `decimated` [count].
    """
    early, known = coarse_log(log, tried.delays, tried.together, every), parameters_at_end(tried.together[:-1])
    tried = replace(tried, void=False)
    best = _coarse_descent(early, tried, tried.point.theta, *known, wanted=wanted)
    if (revived := _start_with_rig_values(log, best, *known)) is not None:
        best = min(best, _coarse_descent(early, best, revived, *known, wanted=wanted), key=lambda one: one.cost)
    if len(tried.together[-1].delays) > 1:
        best = _with_best_delay(log, best, every, *known)
    if any(one.from_entry for one in tried.together):
        times = [(max(onset - 0.5 * width, 0.0), width) for width in WIDTHS for onset in ONSETS]
        best = _with_best_time(early, best, (AIR_ONSET, AIR_WIDTH), times, wanted)
    if any(one.from_change for one in tried.together):
        at = best.values[STEP_AT]
        times = [(min(max(at + off, 0.0), 1.0), width) for width in STEP_WIDTHS for off in STEP_NEAR]
        best = _with_best_time(early, best, (STEP_AT, STEP_WIDTH), times, wanted)
    return void_if_quiet(log, best)


def void_if_quiet(log: GreyBoxLog, tried: Trial) -> Trial:
    """Return a trial; void if its residuals are far smaller than the effect of position noise.

    For oil as stiff as steel that noise is so large that it explains any log. No other explanation would cost as
    little.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.
    tried : Trial
        The trial.
    """
    return replace(tried, void=log.passes_on and cost_over_noise(log, tried.point.cost) < QUIET)


def _coarse_descent(log: GreyBoxLog, tried: Trial, start: Array, *more: str, wanted: float) -> Trial:
    """Return a set of hypotheses after a descent with long model steps."""
    return after_descent(log, tried, start, SETTLING, *more, wanted=wanted, least_share=SLIGHT)


def _with_best_delay(log: GreyBoxLog, best: Trial, every: int, *known: str) -> Trial:
    """Return a set of hypotheses with the delay of its last one searched in steps of `FINEST_DELAY`."""
    channel, early = best.together[-1].late, min(best.together[-1].delays) < 0.0
    least, most = (-LATEST, 0.0) if early else (0.0, LATEST)
    for step in (FINEST_DELAY, -FINEST_DELAY):
        while least <= (delay := best.delays.get(channel, 0.0) + step) <= most:
            moved = replace(best, delays={channel: delay})
            later = coarse_log(log, moved.delays, moved.together, every)
            moved = _coarse_descent(later, moved, best.point.theta, *known, wanted=best.cost)
            if moved.cost >= best.cost:
                break
            best = moved
    return best


def _with_best_time(
    log: GreyBoxLog, tried: Trial, names: tuple[str, str], times: Sequence[tuple[float, float]], wanted: float
) -> Trial:
    """Return a set of hypotheses with the likeliest time and width of its change.

    A descent finds only the nearest time, and none if the change is quick.
    """
    more = parameters_at_end(tried.together)
    problem = hypothesis_problem(log, tried.together, *more)
    places = [problem.model.unknowns.index(name) for name in names]
    theta = problem.model.theta({**usual_values(log), **tried.values})
    asked = [(at / LINEAR[names[0]], np.log(width)) for at, width in times]
    for _ in range(len(WIDTHS)):
        thetas = np.repeat(theta[None], len(asked) + 1, axis=0)
        thetas[1:, places] = asked
        start = thetas[int(np.argmin(problem.costs([*thetas])))]
        further = _coarse_descent(log, tried, start, *more, wanted=wanted)
        if further.cost > tried.cost - LEAST_BETTER:
            break
        tried, theta = further, further.point.theta
    return tried


def _start_with_rig_values(log: GreyBoxLog, tried: Trial, *more: str) -> Array | None:
    """Return a start with the rig's value of what has almost vanished: a logarithm does not come back from there."""
    lost = vanished_values(log, tried.values)
    return hypothesis_problem(log, tried.together, *more).model.theta({**tried.values, **lost}) if lost else None


def vanished_values(log: GreyBoxLog, values: Mapping[str, float]) -> dict[str, float]:
    """Return the rig's values of parameters that have almost vanished.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.
    values : Mapping[str, float]
        What a search has found [SI].

    Returns
    -------
    dict
        By name, of `MAY_VANISH` [SI].
    """
    usual = usual_values(log)
    return {name: usual[name] for name in MAY_VANISH if values[name] < VANISHED * usual[name]}


def after_descent(
    log: GreyBoxLog,
    tried: Trial,
    start: Array,
    evaluations: int,
    *more: str,
    wanted: float = np.inf,
    least_share: float = 0.0,
) -> Trial:
    """Return a set of hypotheses after a descent from a start.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.
    tried : Trial
        The set.
    start : ndarray, shape (unknowns,)
        Fitted coordinates [dimensionless].
    evaluations : int
        Most evaluations of the model [count].
    *more : str
        Unknowns that are fitted beside those of the hypotheses.
    wanted : float
        See `search_coarsely` [dimensionless].
    least_share : float
        Share of the cost that a further step must promise [fraction].

    Returns
    -------
    Trial
        The set where the search ended.
    """
    problem = hypothesis_problem(log, tried.together, *more)
    bounds = flow_bounds(problem.model, [start], log)
    point = descend(problem.at, start, evaluations, bounds, radius=NEAR_RADIUS, wanted=wanted, least_share=least_share)
    return replace(tried, point=point, values=problem.model.values(point.theta))


def coarse_log(
    log: GreyBoxLog, delays: Mapping[str, float], together: tuple[Hypothesis, ...], every: int = 1
) -> GreyBoxLog:
    """Return a log with one model step per sample, as the coarse search uses it.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.
    delays : Mapping[str, float]
        Delay of each late channel [s].
    together : tuple of Hypothesis
        The set of hypotheses; mass is balanced if one of them requires it.
    every : int
        How many samples are merged into one, see `decimated` [count].
    """
    row = decimated(without_delays(log, delays), every)
    return with_balance(row, 1.0) if any(one.by_mass for one in together) else row
