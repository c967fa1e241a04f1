"""The least-squares problem of a log under hypotheses, its starts and its bounds."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.greybox.problem import search_bounds
from estimation.fits.greybox.ridge import Ridge
from estimation.fits.greybox.side_by_side import LANES
from estimation.fits.hypotheses import DELIVERY, LEAKAGE_TURBULENT, LEAST_DELIVERY, LIMITS, Hypothesis
from estimation.fits.hypothesis_search.form_fit import LONGEST_STEP
from estimation.fits.hypothesis_search.lost_flow import likeliest_entry, likeliest_step
from estimation.fits.hypothesis_search.wide_log import LEAST_PEAK, START_LEVEL, shut_in_pressure, usual_values
from estimation.log_checks.channel_names import POSITION, SPEED
from estimation.models.filtered_flow import (
    FILTER_TIME,
    FILTERED_FLOW_FORM,
    FILTERED_QUICK_FLOW_FORM,
    FILTERED_TURBULENT_FLOW_FORM,
    FILTERED_TURBULENT_QUICK_FLOW_FORM,
)
from estimation.models.flow import FLOW_FORM, STIFFNESS, form_with_relief, reaches_relief
from estimation.models.greybox import GreyBoxModel
from estimation.models.wide_flow import (
    LINEAR,
    QUICK_FLOW_FORM,
    QUICKNESS,
    TURBULENT_FLOW_FORM,
    TURBULENT_QUICK_FLOW_FORM,
    WIDE_FLOW_FORM,
)
from plant.arrays import Array
from plant.solvers.steps import parameter_names

RELIEF_START = 1e-10
"""First guess of the slope of a relief valve that opens early [m^3/(s Pa)]."""

SHARPEST_RELIEF = 3e-3
"""Least pressure rise above its setting within which a relief valve passes the largest flow of the log [fraction].
Valves need 0.05 to 0.2. At a sharper corner, which no sensor resolves, the model chatters: slopes are then so steep
that the deviation of bulk modulus comes out twenty times too small."""

LEAST_SETTING = 0.3
"""Least setting at which a relief valve is sought, as a share of the log's largest pressure [fraction]; judged: one
that passes all that is pumped at three times its setting is a leak."""

FASTEST_MAKEUP, FASTEST_FOLLOWED = 0.5 * LONGEST_STEP, 0.02 * LONGEST_STEP
"""Least time in which an open make-up valve fills a chamber, and the same with implicit steps [s]. At a fifth of a
model step the model may chatter, as at a sharp relief valve: the deviation of bulk modulus came out nine times too
small. Implicit steps do not chatter; valves of random rigs need 0.013 ms and more."""

FARTHEST_ZERO = 0.3
"""Largest start of the search for an encoder's zero, over a chamber's length in mid-stroke [fraction]; judged. 60 mm is
4 % in the paper's actuator, and more than a drone's has."""

MOST_VOLUME = 2.0
"""Factor within which a chamber's volume is searched about the rig file's [dimensionless]: 4.6 prior deviations.
Volumes 4 and 80 times as large replaced an encoder's zero."""

MOST_DEVIATIONS = 5.0
"""Prior deviations by which an accumulator may be stiffer at most [dimensionless]; judged."""

MOST_WORN = 0.2
"""Largest loss of displacement at which the search for a worn pump begins [fraction]; judged."""

FORMS = {
    (False, False, False): WIDE_FLOW_FORM,
    (False, False, True): QUICK_FLOW_FORM,
    (False, True, False): TURBULENT_FLOW_FORM,
    (False, True, True): TURBULENT_QUICK_FLOW_FORM,
    (True, False, False): FILTERED_FLOW_FORM,
    (True, False, True): FILTERED_QUICK_FLOW_FORM,
    (True, True, False): FILTERED_TURBULENT_FLOW_FORM,
    (True, True, True): FILTERED_TURBULENT_QUICK_FLOW_FORM,
}
"""Forms, by whether pressure passes a second-order filter, a leak is turbulent, and bubbles have an exponent."""

FLOW_BIAS = "flow_bias"

POSITION_ZERO = "position_zero"

AIR_ONSET, AIR_WIDTH = "air_onset", "air_width"

STEP_AT, STEP_WIDTH = "step_at", "step_width"

FIRST_WIDTH = 0.02
"""Duration of a step of leakage at which a search begins [fraction of the log]: four pieces."""

START_PRESSURE = "start_pressure"

MISREAD_PARAMETERS = {"pressure_offset", "pressure_drift", "pressure_sides"}
"""Parameters in which the displayed pressure is linear."""

SHARES_TRIED = 0.7 ** np.arange(8)
"""Shares of the predicted size of these that are tried [fraction]: side by side they take as long as one."""

LEVELS_TRIED = (0.0, 0.3, 0.8)
"""Levels above the accumulator's pressure at which both sides may begin, as shares of the largest [fraction]."""

MOST_BIASED = 2.0
"""Factor by which position noise may bias the first bulk modulus [dimensionless]. Far above it there is a second
minimum, where noise that grows with the oil's stiffness explains everything."""


def hypothesis_problem(log: GreyBoxLog, together: Sequence[Hypothesis], *more: str) -> FreedProblem:
    """Return the least-squares problem of a log under hypotheses.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.
    together : sequence of Hypothesis
        Hypotheses whose unknowns are fitted beside the plain form's.
    *more : str
        Parameters that are fitted in any case.

    Returns
    -------
    FreedProblem
        The problem; relief is fitted if the log reaches its setting. A channel whose lag is fitted is not tested for a
        delay.
    """
    extra = [*(name for one in together for name in (*one.free, *one.beside)), *more]
    relieved = reaches_relief(log.measured, usual_values(log)["relief_pressure"])
    plain = form_with_relief(FLOW_FORM) if relieved else FLOW_FORM
    held = {name for one in together for name in one.instead}
    known = [name for name in plain.unknowns if name not in held]
    late = {one.late for one in together if any(name.endswith("_lag") for name in one.free)}
    log = replace(log, timed=tuple(channel for channel in log.timed if channel not in late))
    form = FORMS[FILTER_TIME in extra, LEAKAGE_TURBULENT.free[0] in extra, QUICKNESS in extra]
    free = tuple(dict.fromkeys((*known, *extra)))
    ridge = Ridge(DELIVERY.free[0], FLOW_BIAS, flow_speed(log)) if DELIVERY.free[0] in free else None
    return FreedProblem(form, log, free, LINEAR, ridge)


def parameters_at_end(together: Iterable[Hypothesis]) -> list[str]:
    """Return the parameters that a hypothesis fits only at the end of its search; beside another one, from the start.

    Returns
    -------
    list of str
        Parameters of the wide form.
    """
    return [name for one in together for name in one.at_end]


def flow_speed(log: GreyBoxLog) -> float:
    """Return the motor speed at which a worn pump loses as much flow as the flow bias.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.

    Returns
    -------
    float
        Least squares over the samples, weighted by speed [rad/s]; zero where the motor rests.
    """
    speed = np.abs(log.drives[:, WIDE_FLOW_FORM.drives.index(SPEED)])
    total = float(np.nansum(speed))
    return float(np.nansum(speed * speed)) / total if total > 0.0 else 0.0


def worn_start(log: GreyBoxLog, plain: Mapping[str, float]) -> Sequence[Mapping[str, float]]:
    """Return a second start of the search for pump delivery: healthy flow bias, all other loss by wear.

    At one speed the two nearly cancel, and a search along their ridge ends before it reaches a worn pump.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.
    plain : Mapping[str, float]
        Parameters of the plain fit [SI].

    Returns
    -------
    sequence of Mapping[str, float]
        One first guess; none if the flow bias is hardly larger than a healthy one [SI].
    """
    usual = usual_values(log)
    displacement, bias = usual[DELIVERY.free[0]], plain[FLOW_BIAS]
    full = displacement * flow_speed(log)
    lost = min((bias - usual[FLOW_BIAS]) / full, MOST_WORN) if full > 0.0 else 0.0
    if lost <= LEAST_DELIVERY:
        return []
    return [{DELIVERY.free[0]: (1.0 - lost) * displacement, FLOW_BIAS: bias - lost * full}]


def misread_start(problem: FreedProblem, guess: Array, one: Hypothesis) -> Sequence[Array]:
    """Return a second start of the search for what a gauge misreads: the amount that explains most beside a guess.

    The displayed pressure is linear in it. A search step by step is held up by valves that switch, long before it
    reaches a drift of some bar. Large residuals count less than their square, so slopes predict too much.

    Parameters
    ----------
    guess : ndarray, shape (unknowns,)
        First guess [dimensionless].
    one : Hypothesis
        The hypothesis.

    Returns
    -------
    sequence of ndarray, shape (unknowns,)
        One first guess; none for another hypothesis, or if no amount explains more [dimensionless].
    """
    if not set(one.free) <= MISREAD_PARAMETERS:
        return []
    point, step = problem.at(guess), np.zeros(len(guess))
    places = [problem.model.unknowns.index(name) for name in one.free]
    step[places] = np.linalg.lstsq(point.gram[np.ix_(places, places)], point.gradient[places])[0]
    begun = [guess - share * step for share in SHARES_TRIED]
    costs = problem.costs(begun, LANES)
    return [begun[int(np.argmin(costs))]] if np.min(costs) < point.cost else []


def own_starts(log: GreyBoxLog, one: Hypothesis) -> Sequence[Mapping[str, float]]:
    """Return the starts of the search under a hypothesis.

    Returns
    -------
    sequence of Mapping[str, float]
        First guesses [SI].
    """
    if one.from_first_sample:
        seen = log.measured[np.isfinite(log.measured[:, 0]), 0]
        begun = float(seen[0]) if len(seen) else 0.0
        if START_PRESSURE not in one.free:
            return [{one.free[0]: begun}]
        return [{START_PRESSURE: begun, START_LEVEL: share * shut_in_pressure(log)} for share in LEVELS_TRIED]
    if one.from_change:
        step = likeliest_step(log)
        if not step.share:
            return one.starts
        first = {"leakage_coefficient": step.after, "leakage_before": step.before / step.after - 1.0}
        return [{**first, STEP_AT: step.at, STEP_WIDTH: FIRST_WIDTH}]
    if one.from_entry:
        return [{**start, AIR_ONSET: likeliest_entry(log).at} for start in one.starts]
    if one.from_mid_travel:
        read = log.drives[:, WIDE_FLOW_FORM.drives.index(POSITION)]
        rig = usual_values(log)
        farthest = FARTHEST_ZERO * 2.0 * rig["chamber_volume"] / rig["piston_area"]
        near = [{POSITION_ZERO: float(np.clip(start[POSITION_ZERO], -farthest, farthest))} for start in one.starts]
        return [*near, {POSITION_ZERO: 0.5 * float(np.min(read) + np.max(read))}]
    if not one.shares_of_peak:
        return one.starts
    return [{"relief_pressure": share * _peak(log), "relief_conductance": RELIEF_START} for share in one.shares_of_peak]


def _peak(log: GreyBoxLog) -> float:
    """Return the largest differential pressure of a log [Pa]."""
    return max(float(np.nanmax(np.abs(log.measured))), LEAST_PEAK)


def widest_makeup(chamber_volume: float, bulk_modulus: float, log: GreyBoxLog) -> float:
    """Return the largest conductance of a make-up valve that model steps resolve.

    Parameters
    ----------
    chamber_volume : float
        Dead volume, half of a chamber's [m^3].
    bulk_modulus : float
        Bulk modulus of the oil [Pa].
    log : GreyBoxLog
        The log, whose steps may be implicit.

    Returns
    -------
    float
        Conductance [m^3/(s Pa)].
    """
    return 2.0 * chamber_volume / ((FASTEST_FOLLOWED if log.stiff else FASTEST_MAKEUP) * bulk_modulus)


def flow_bounds(model: GreyBoxModel, guesses: Sequence[Array], log: GreyBoxLog) -> tuple[Array, Array]:
    """Return the bounds of a search for the flow form's unknowns, plain or wide.

    Parameters
    ----------
    model : GreyBoxModel
        The flow form with its unknowns.
    guesses : sequence of ndarray, shape (unknowns,)
        Where it begins [dimensionless].
    log : GreyBoxLog
        The log, as the model sees it.

    Returns
    -------
    tuple of ndarray, shape (unknowns,)
        Lower and upper bounds [dimensionless].
    """
    rig = dict(zip(parameter_names(model.parameters), map(float, log.parameters), strict=True))
    most = rig["pump_displacement"] * float(np.max(np.abs(log.drives[:, 0])))
    relief = (0.0, max(most / (SHARPEST_RELIEF * rig["relief_pressure"]), rig["relief_conductance"]))
    stiffness, doubt = log.presumed[STIFFNESS]
    stiffest = stiffness * np.exp(MOST_DEVIATIONS * doubt)
    latest = 0.0 if log.course is None else -log.sample_time
    limits = {"speed_lead": (latest, log.sample_time), "relief_conductance": relief, STIFFNESS: (0.0, stiffest)}
    peak = _peak(log)  # a valve set higher never opens, so no slope leads back
    limits["relief_pressure"] = (LEAST_SETTING * peak, max(peak, rig["relief_pressure"]))
    limits[START_LEVEL] = (-rig["accumulator_pressure"], shut_in_pressure(log))
    place = model.unknowns.index("bulk_modulus")  # fitted as a logarithm
    softest, stiffest_guess = (float(np.exp(end(guess[place] for guess in guesses))) for end in (min, max))
    stiff = max(rig["bulk_modulus"], stiffest_guess)
    volume = rig["chamber_volume"]
    limits["chamber_volume"] = (volume / MOST_VOLUME, MOST_VOLUME * volume)
    limits["makeup_conductance"] = (0.0, widest_makeup(volume, stiff, log))
    if log.passes_on:
        limits["bulk_modulus"] = (softest / MOST_BIASED, MOST_BIASED * stiffest_guess)
    return search_bounds(model, guesses, {**LIMITS, **limits})
