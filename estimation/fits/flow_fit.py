"""`fit_flow(record, parameters, ...) -> FormFit`: bulk modulus, leakage and flow bias of a log, by the flow form."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from operator import attrgetter

import numpy as np

from estimation.fits.asked import ALWAYS_ASKED, asked_of, near_starts
from estimation.fits.between_samples import with_course
from estimation.fits.delivery import contradicted
from estimation.fits.explain import WORTH, explain
from estimation.fits.flow_log import carried, flow_log, homed_at_stop, without_strays
from estimation.fits.flow_search import balanced, flow_starts, lower_valley
from estimation.fits.form_fit import DISCRETISED, FormFit, weighed, with_structure
from estimation.fits.greybox_fit import GreyBoxFit
from estimation.fits.hypotheses import (
    BEGUN,
    ENCODER_ZERO,
    HYPOTHESES,
    PLAY,
    PRESSURE_LATE,
    Hypothesis,
)
from estimation.fits.left_open import valves_unseen, wear_open
from estimation.fits.objections import doubted, fit_explains, fit_explains_all, limits, objections
from estimation.fits.play import (
    NO_PLAY,
    play_left,
    play_structure,
    play_untaken,
    sensed_play,
)
from estimation.fits.small_teeth import with_small_teeth
from estimation.fits.speed_instead import speed_instead
from estimation.fits.teeth import Turning
from estimation.fits.toothed import asked_for_teeth, toothed
from estimation.models.completed_flow import CRACKS, balances_mass
from estimation.models.flow import HELD_FLOW_FORM
from estimation.notes import EstimateCode
from plant.eha.model import EhaParameters
from plant.errors import LogError
from plant.log.record import Record

FLOW_CHANNELS = ("position_m", "differential_pressure_pa")
"""Channels that the flow form needs beside motor speed."""

REPORTED = ("leakage_coefficient", "flow_bias")
"""What is worth telling of the parameters found along with bulk modulus."""

STRUCTURE = 2e-4
"""Relative standard deviation of bulk modulus from what the balance leaves out where no make-up valve may crack: in a
log that the plain form does not explain, and with gaps in motor speed. Likeliest on 71 validation logs [fraction]."""

FILTERED = 1e-3
"""The same of a log whose pressure was filtered: the filter is fitted as a lag of first order. 16 training logs with a
moving average of 2 to 6 ms have their bulk modulus 0.1 % too low."""

SURER = 1.4
"""What a difference of log-likelihood between balances is divided by [dimensionless]: they leave out less than the
motion form does. With `BY_MASS` the likeliest on 876 logs of our plants and of the open benchmark."""

BY_MASS = 2.0
"""Weight of the balance by mass before a log is seen, that of each other being 1 [dimensionless]: oil is denser under
pressure, but simulators and textbooks balance volumes."""

LITTLE = 0.01
"""Share of what the plain form leaves beside noise that the best hypothesis must take up before pairs are tried
[fraction]."""

_cost = attrgetter("cost")


def require_flow_channels(record: Record) -> None:
    """Refuse a record without the channels that the flow form needs.

    Raises
    ------
    LogError
        If one is missing.
    """
    lacking = [channel for channel in FLOW_CHANNELS if channel not in record]
    if lacking:
        raise LogError(f"the flow form needs {' and '.join(FLOW_CHANNELS)}, the record lacks {', '.join(lacking)}")


def fit_flow(
    record: Record,
    parameters: EhaParameters,
    bulk_modulus: float,
    uncertainties: Mapping[str, float] | None = None,
    variances: Mapping[str, float] | None = None,
    *,
    loaded: bool = False,
    moving: bool = False,
    filtered: bool = False,
    speed_held: bool = False,
    speed_offset: float = 0.0,
    valley: Mapping[str, float] | None = None,
) -> FormFit:
    """Fit the flow form to a log, balanced by volume, by mass, and by volume in held chambers, and weigh the three.

    What a pump's teeth deliver is taken up first (`estimation.fits.toothed`). A log that it does not explain is asked
    what is strange about rig, oil or logger (`estimation.fits.explain`).
    Gross outliers are taken out, and what the pump delivered while its speed is missing is read off the pressure after.
    Where oil is so much stiffer than the rig file's that noise of position counts, a log is fitted anew from there.

    Parameters
    ----------
    record : Record
        The log, with position and differential pressure.
    parameters : EhaParameters
        Geometry and pump are taken from it; leakage and flow bias are first guesses.
    bulk_modulus : float
        First guess of effective bulk modulus [Pa].
    uncertainties : Mapping[str, float], optional
        Relative standard deviation of the actuator's parameters [fraction]; none by default.
    variances : Mapping[str, float], optional
        Measurement variances of the channels of a log whose gross outliers are missing already [SI squared]; both are
        done here if not given.
    loaded : bool
        Whether the log begins under load, and not at rest.
    moving : bool
        Whether the motor turns when it begins: both chambers may then stand at any pressure.
    filtered : bool
        Whether the pressure was filtered: it is then late, and by how much is fitted whatever that gains.
    speed_held : bool
        Whether motor speed came slower than the rest: of a log that the plain form does not explain the motor's course
        is then what is not known, and nothing is asked.
    speed_offset : float
        First guess of how much the logged speed exceeds the shaft's [rad/s].
    valley : Mapping[str, float], optional
        Values of the plain form's unknowns from which searches begin as well, see `lower_valley` [SI].

    Returns
    -------
    FormFit
        The best of several starts.

    Raises
    ------
    LogError
        If a channel is missing.
    """
    require_flow_channels(record)
    sensed = sensed_play(record)
    if variances is None:
        record, variances = without_strays(record)
    how = {"loaded": loaded, "moving": moving, "filtered": filtered, "speed_held": speed_held}
    again = partial(fit_flow, record, uncertainties=uncertainties, variances=variances, **how)
    log = flow_log(record, parameters, uncertainties or {}, variances)
    starts = flow_starts(parameters, max(bulk_modulus, 1e-2 * parameters.bulk_modulus))
    explains = partial(fit_explains, noisy=log.passes_on)
    largest, _ = limits(log.passes_on, int(np.count_nonzero(np.isfinite(log.measured[:, 0]))))
    fitted = partial(balanced, parameters=parameters, starts=starts, valley=valley)
    unturned = with_course(log, fitted, parameters)
    log, fits, teeth, teeth_left = toothed(unturned, fitted, explains, largest, speed_offset)
    turning = Turning(log.teeth, log.speed_offset)
    beforehand = [BY_MASS if balances_mass(fit.model) else 1.0 for fit in fits]
    best = min(fits, key=_cost)
    found = with_small_teeth(weighed(fits, SURER, beforehand), best.small_teeth)
    swinging = min((fit for fit in fits if fit.model.rates is not HELD_FLOW_FORM.rates), key=_cost)
    stiff = replace(parameters, bulk_modulus=swinging.values["bulk_modulus"])
    stiffer = not log.passes_on and stiff.bulk_modulus > parameters.bulk_modulus  # noise counts more in stiff oil alone
    if stiffer and explains(swinging) and flow_log(record, stiff, uncertainties or {}, variances).passes_on:
        return again(stiff, stiff.bulk_modulus, speed_offset=speed_offset)
    log = carried(log, parameters, swinging.values)
    asked, open_ends = asked_of(log, parameters, swinging, best, sensed, loaded=loaded, moving=moving)
    asked = (PRESSURE_LATE, *asked) if filtered and PRESSURE_LATE not in asked else asked
    asked = () if speed_held and not explains(swinging) else asked
    remarks = (*teeth, *open_ends, *valves_unseen(best))
    softer = parameters.piston_area * sensed.yields / parameters.chamber_volume
    untaken, play = play_untaken(sensed, softer * swinging.values["bulk_modulus"])
    if BEGUN in asked:  # so many valleys that one is believed only where sensors' noise is all that it leaves
        explains = partial(fit_explains_all, noisy=log.passes_on)
    if asked:
        near = near_starts(swinging, starts, explains, in_motion=loaded or moving)
        near = [best.values, *near] if best is not swinging and explains(best) else near
        paired = any(one not in (*ALWAYS_ASKED, PLAY) for one in asked)
        by_mass = balances_mass(swinging.model)
        strange = explain(
            asked_for_teeth(log),
            parameters,
            near,
            explains,
            asked=asked,
            paired=paired,
            hopeless=_hopeless(swinging, asked),
            by_mass=by_mass,
        )
        one = strange.fit
        if (
            _known(strange.names, one)
            and explains(one)
            and one.cost < _wanted(strange.names, best, swinging, homed=homed_at_stop(log), late=filtered)
        ):
            place = (strange.values, parameters.pump_displacement, one.cost - WORTH)
            if not speed_offset and (turned := speed_instead(unturned, fitted, *place)):
                return again(parameters, bulk_modulus, speed_offset=turned)
            wanted = one.cost + WORTH
            if valley is None and (lower := lower_valley(log, swinging, strange.values, wanted)):
                return again(parameters, bulk_modulus, speed_offset=speed_offset, valley=lower)
            bound = one.std["bulk_modulus"] / one.values["bulk_modulus"]
            left, open_play = float(np.hypot(FILTERED if filtered else STRUCTURE, untaken)), play
            if PLAY.name in strange.names:
                modulus = one.values["bulk_modulus"]
                moved = abs(modulus / swinging.values["bulk_modulus"] - 1.0)
                left, open_play = play_structure(moved, softer * modulus), ()
            believed = with_structure(with_small_teeth(strange.values, one.small_teeth), left)
            shown = play_left(one.play, NO_PLAY if PLAY.name in strange.names else sensed)
            reasons = (*shown, *contradicted(strange, parameters))
            remarks = (*teeth, *wear_open(strange.delivery_open), *open_play)
            return FormFit(believed, bound, one.chi_square[0], reasons, one.rig_slopes, strange, remarks, turning)
    sure = CRACKS[0] in best.values or best.model.rates is HELD_FLOW_FORM.rates
    believed = with_structure(found, float(np.hypot(DISCRETISED if sure else STRUCTURE, untaken)))
    reasons = (*objections(best, log.passes_on), *play_left(swinging.play, sensed)) or teeth_left
    if BEGUN in asked and not reasons and not explains(best):
        reasons = (EstimateCode.PRESSURE_RESIDUALS_LARGE.note(ratio=best.chi_square[0] ** 0.5),)
    (value, std), remarks = found["bulk_modulus"], (*remarks, *play)
    return FormFit(believed, std / value, best.chi_square[0], reasons, best.rig_slopes, None, remarks, turning)


def _hopeless(swinging: GreyBoxFit, asked: Sequence[Hypothesis]) -> float:
    """Return the cost from which the best of all hypotheses takes up so little that no two of them explain a log.

    What they all leave alone is then no actuator's: bursts of a few samples that a cable picks up, or a noise that
    varies.
    """
    if len(asked) < len(HYPOTHESES):
        return np.inf
    left = swinging.cost * (1.0 - 1.0 / max(swinging.chi_square[0], 1.0))
    return swinging.cost - max(WORTH, LITTLE * left)


def _wanted(names: Sequence[str], best: GreyBoxFit, swinging: GreyBoxFit, *, homed: bool, late: bool) -> float:
    """Return the cost below which what is strange is believed rather than the plain form.

    No actuator holds its chambers' volumes. So the zero of an encoder that may have been homed at a stop (``homed``)
    need explain a log no better than held volumes do, and the lag of a filter (``late``) no better than none. How a
    play is crossed is not known: with a second hypothesis it may explain a log that has neither.
    """
    if PLAY.name in names and len(names) > 1:
        return -np.inf
    if tuple(names) == (PRESSURE_LATE.name,) and late:
        return best.cost + WORTH
    if tuple(names) == (ENCODER_ZERO.name,) and homed:
        return min(best.cost + WORTH, swinging.cost - WORTH)
    return best.cost - WORTH


def _known(names: Sequence[str], fit: GreyBoxFit) -> bool:
    """Return whether a play's fit leaves no more than the sensors' noise: what is left is how the piston crosses it."""
    return PLAY.name not in names or not doubted(fit)
