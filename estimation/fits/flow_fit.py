"""`fit_flow(record, parameters, ...) -> FormFit`: bulk modulus, leakage and flow bias of a log, by the flow form."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from operator import attrgetter

import numpy as np

from estimation.fits.between_samples import with_course
from estimation.fits.delivery import contradicted
from estimation.fits.explain import VANISHED, WORTH, explain
from estimation.fits.flow_log import carried, flow_log, homed_at_stop, outruns_pump, without_strays
from estimation.fits.flow_search import MAKEUP_TRIED, balanced, flow_starts
from estimation.fits.form_fit import DISCRETISED, FormFit, weighed, with_structure
from estimation.fits.greybox_fit import GreyBoxFit
from estimation.fits.greybox_log import GreyBoxLog
from estimation.fits.hypotheses import (
    BEGUN,
    DELIVERY,
    ENCODER_ZERO,
    HYPOTHESES,
    LEAST_DELIVERY,
    LEAST_ZERO,
    MAKEUP_BENDS,
    MAY_HIDE,
    OFFSET_AT_REST,
    PLAY,
    PRESSURE_LATE,
    SPEED_LATE,
    START_LOAD,
    Hypothesis,
)
from estimation.fits.lateness import most_late
from estimation.fits.left_open import valves_unseen, wear_open
from estimation.fits.play import (
    NO_PLAY,
    PLAY_SENSED,
    ShownPlay,
    play_left,
    play_structure,
    play_untaken,
    sensed_play,
)
from estimation.fits.promises import promised, promised_each, slopes_of
from estimation.fits.small_teeth import with_small_teeth
from estimation.fits.speed_instead import speed_instead
from estimation.fits.teeth import Turning
from estimation.fits.toothed import asked_for_teeth, toothed
from estimation.models.completed_flow import CRACKS, balances_mass
from estimation.models.flow import HELD_FLOW_FORM, STIFFNESS
from estimation.models.inner_circuit import BEND
from estimation.notes import EstimateCode
from plant.eha.model import EhaParameters
from plant.errors import LogError
from plant.log.record import Record
from plant.notes import Note

FLOW_CHANNELS = ("position_m", "differential_pressure_pa")
"""Channels that the flow form needs beside motor speed."""

REPORTED = ("leakage_coefficient", "flow_bias")
"""What is worth telling of the parameters found along with bulk modulus."""

LARGEST_CHI_SQUARE = 1.2
"""Mean squared normalised residual above which the model is said to leave something out [dimensionless]."""

DOUBTED = 1.1
"""The same above which a log that begins under load or in motion is not explained: its fit has many valleys, and the
sensors' noise is known to a twentieth [dimensionless]."""

LARGEST_AUTOCORRELATION = 0.1
"""Correlation of neighbouring residuals above which the same is said [dimensionless]."""

NOISY = (1.44, 0.3)
"""The same two where noise of position counts: it is known to a fifth, and an encoder's steps are not white."""

LATE_WORTH = 20.0
"""Gain in log-likelihood from which speed or position is said to come late or early, if no hypothesis says more. On
logs of 18 kinds of strange rigs, and on 18 of a foreign bench, the gain of a right explanation is 6 at most, and that
of a position that lags by 3 ms is 390 to 2800. A log is asked from `WORTH` on: half a millisecond may gain 10, and move
bulk modulus by seven deviations [dimensionless]."""

LATE_SHARE = 0.25
"""Share of what a log leaves unexplained that this must take up to be named beside it [fraction]."""

ZERO_WORTH = 30.0
"""Gain in log-likelihood that the slopes must promise before a log that the plain form explains is asked for its
encoder's zero [dimensionless]. They promise 100 at least where one is off by 60 mm or more, 2.5 at most on logs of 30
other kinds, and 14 on one of a play, which a zero would explain wrongly."""

FARTHEST_LEAD = 0.99
"""Lead of the motor on the line between samples from which its speed may lag instead [sample times]: one is most."""

TOO_WIDE = 20.0
"""Conductance of make-up valves over the first guess from which a search begins with the guess too [dimensionless]."""

ALWAYS_ASKED = (DELIVERY, ENCODER_ZERO, *MAY_HIDE)
"""What a log that the plain form explains is asked all the same, where the slopes promise a gain: each may hide."""

MOST_ASKED = 50_000
"""A longer log is not asked what is strange about it: the answer takes minutes [samples]."""

STRUCTURE = 2e-4
"""Relative standard deviation of bulk modulus from what the balance leaves out where no make-up valve may crack: in a
log that the plain form does not explain, and with gaps in motor speed. Likeliest on 71 validation logs [fraction]."""

FILTERED = 1e-3
"""The same of a log whose pressure was filtered: the filter is fitted as a lag of first order. 16 training logs with a
moving average of 2 to 6 ms have their bulk modulus 0.1 % too low."""

SURER = 2.0
"""What a difference of log-likelihood between balances is divided by [dimensionless]: they leave out less than the
motion form does. With `BY_MASS` the likeliest on 285 logs of our plants and of the open benchmark."""

BY_MASS = 2.0
"""Weight of the balance by mass before a log is seen, that of each other being 1 [dimensionless]: oil is denser under
pressure, but simulators and textbooks balance volumes."""

_cost = attrgetter("cost")


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
    speed_offset: float = 0.0,
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
    speed_offset : float
        First guess of how much the logged speed exceeds the shaft's [rad/s].

    Returns
    -------
    FormFit
        The best of several starts.

    Raises
    ------
    LogError
        If a channel is missing.
    """
    lacking = [channel for channel in FLOW_CHANNELS if channel not in record]
    if lacking:
        raise LogError(f"the flow form needs {' and '.join(FLOW_CHANNELS)}, the record lacks {', '.join(lacking)}")
    sensed = sensed_play(record)
    if variances is None:
        record, variances = without_strays(record)
    how = {"loaded": loaded, "moving": moving, "filtered": filtered}
    again = partial(fit_flow, record, uncertainties=uncertainties, variances=variances, **how)
    log = flow_log(record, parameters, uncertainties or {}, variances)
    starts = flow_starts(parameters, max(bulk_modulus, 1e-2 * parameters.bulk_modulus))
    explains = partial(_explains, noisy=log.passes_on)
    largest = NOISY[0] if log.passes_on else LARGEST_CHI_SQUARE
    unturned = with_course(log, fitted := partial(balanced, parameters=parameters, starts=starts), parameters)
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
    asked, open_ends = _asked(log, parameters, swinging, best, sensed, loaded=loaded, moving=moving)
    asked = (PRESSURE_LATE, *asked) if filtered and PRESSURE_LATE not in asked else asked
    remarks = (*teeth, *open_ends, *valves_unseen(best))
    softer = parameters.piston_area * sensed.yields / parameters.chamber_volume
    untaken, play = play_untaken(sensed, softer * swinging.values["bulk_modulus"])
    if BEGUN in asked:  # so many valleys that one is believed only where sensors' noise is all that it leaves
        explains = partial(_explains_all, noisy=log.passes_on)
    if asked:
        near = _near(swinging, starts, explains, in_motion=loaded or moving)
        near = [best.values, *near] if best is not swinging and explains(best) else near
        paired = any(one not in (*ALWAYS_ASKED, PLAY) for one in asked)
        by_mass = balances_mass(swinging.model)
        strange = explain(asked_for_teeth(log), parameters, near, explains, asked=asked, paired=paired, by_mass=by_mass)
        one = strange.fit
        if (
            _known(strange.names, one)
            and explains(one)
            and one.cost < _wanted(strange.names, best, swinging, homed=homed_at_stop(log), late=filtered)
        ):
            place = (strange.values, parameters.pump_displacement, one.cost - WORTH)
            if not speed_offset and (turned := speed_instead(unturned, fitted, *place)):
                return again(parameters, bulk_modulus, speed_offset=turned)
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
    reasons = (*_objections(best, log.passes_on), *play_left(swinging.play, sensed)) or teeth_left
    if BEGUN in asked and not reasons and not explains(best):
        reasons = (EstimateCode.PRESSURE_RESIDUALS_LARGE.note(ratio=best.chi_square[0] ** 0.5),)
    (value, std), remarks = found["bulk_modulus"], (*remarks, *play)
    return FormFit(believed, std / value, best.chi_square[0], reasons, best.rig_slopes, None, remarks, turning)


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


def _asked(
    log: GreyBoxLog,
    parameters: EhaParameters,
    swinging: GreyBoxFit,
    best: GreyBoxFit,
    sensed: ShownPlay = NO_PLAY,
    *,
    loaded: bool,
    moving: bool,
) -> tuple[tuple[Hypothesis, ...], tuple[Note, ...]]:
    """Return what a log is asked beside the plain form, given its likelier fit with volumes that swing, and its best.

    A remark says what it leaves open. Held volumes may explain a log whose encoder was homed at a stop: it is asked all
    the same.
    """
    if len(log.drives) > MOST_ASKED:
        return (), ()
    if loaded:  # a sensor that reads too much looks loaded at rest
        return (BEGUN, OFFSET_AT_REST), ()
    if not _explains(swinging, log.passes_on) or most_late(swinging.late)[2] > WORTH:
        pulled = (MAKEUP_BENDS,) if outruns_pump(log, parameters) else ()
        return (BEGUN,) if moving else (*HYPOTHESES, *pulled), ()
    by_mass = balances_mass(swinging.model)
    delivery, zero, *hidden = promised_each(
        log, parameters, swinging.values, ALWAYS_ASKED, by_mass=by_mass, slopes=slopes_of(swinging, log)
    )
    shows_zero = best is swinging or homed_at_stop(log)
    if best is not swinging and shows_zero:  # volumes that swing may have led the fit astray: slopes promise nothing
        zero = max(zero, promised(log, parameters, best.values, ENCODER_ZERO))
    worn = delivery.gain > WORTH and delivery.size > LEAST_DELIVERY
    shifted = shows_zero and zero.gain > ZERO_WORTH and zero.size > LEAST_ZERO
    plays = bool(play_left(swinging.play, sensed)) or sensed.gain > PLAY_SENSED
    behind = swinging.values.get("speed_lead", 0.0) > FARTHEST_LEAD * log.sample_time
    tried = (DELIVERY, worn), (ENCODER_ZERO, shifted), (PLAY, plays), (SPEED_LATE, behind)
    asked = tuple(one for one, worthwhile in tried if worthwhile)
    asked += tuple(one for one, promise in zip(MAY_HIDE, hidden, strict=True) if promise.gain > WORTH)
    remarks = () if DELIVERY in asked else wear_open(delivery.deviation)
    if not moving:
        return asked if _explains_all(swinging, log.passes_on) else HYPOTHESES, remarks
    # chambers shut in far above the accumulator take no make-up for seconds, and a search from rest ends without any
    fed = swinging.values["makeup_conductance"] > VANISHED * parameters.makeup_conductance
    lost = swinging is best and not fed and swinging.chi_square[0] > DOUBTED
    begun = promised(log.coarsened(), parameters, swinging.values, START_LOAD, by_mass=by_mass)
    return (BEGUN, *asked) if lost or begun.gain > WORTH else asked, remarks


def _near(
    fit: GreyBoxFit,
    starts: Sequence[Mapping[str, float]],
    explains: Callable[[GreyBoxFit], bool],
    *,
    in_motion: bool,
) -> Sequence[Mapping[str, float]]:
    """Return where the search for what is strange begins: a fit that explains the log is in no wrong valley.

    But one that begins at rest may be where the log does not (``in_motion``): without make-up, which is then tried too.
    So it is where make-up valves ended far wider than any, since the model is too rough there to find a way back.
    """
    fed = {**fit.values, "makeup_conductance": MAKEUP_TRIED[0]}
    if explains(fit):
        return [fit.values, fed] if in_motion else [fit.values]
    usual = [start for start in starts if start["makeup_conductance"] == MAKEUP_TRIED[0]]
    lost = fit.values["makeup_conductance"] > TOO_WIDE * MAKEUP_TRIED[0]
    near = [fit.values, fed] if lost else [fit.values]
    held = (STIFFNESS, *CRACKS, BEND)
    return [*({name: value for name, value in one.items() if name not in held} for one in near), *usual]


def _known(names: Sequence[str], fit: GreyBoxFit) -> bool:
    """Return whether a play's fit leaves no more than the sensors' noise: what is left is how the piston crosses it."""
    return PLAY.name not in names or fit.chi_square[0] <= DOUBTED


def _explains(fit: GreyBoxFit, noisy: bool) -> bool:
    return not _objections(fit, noisy)


def _explains_all(fit: GreyBoxFit, noisy: bool) -> bool:
    return _explains(fit, noisy) and (noisy or fit.chi_square[0] <= DOUBTED)


def _objections(fit: GreyBoxFit, noisy: bool) -> tuple[Note, ...]:
    """Return what speaks against a fit, ``noisy`` where the position's noise counts with the slopes."""
    reasons: list[Note] = []
    largest, correlated = NOISY if noisy else (LARGEST_CHI_SQUARE, LARGEST_AUTOCORRELATION)
    if fit.chi_square[0] > largest:
        reasons.append(EstimateCode.PRESSURE_RESIDUALS_LARGE.note(ratio=fit.chi_square[0] ** 0.5))
    if abs(fit.autocorrelation[0]) > correlated:
        reasons.append(EstimateCode.PRESSURE_RESIDUALS_CORRELATED.note(correlation=fit.autocorrelation[0]))
    channel, late, gain = most_late(fit.late)
    wanted = LATE_SHARE * fit.cost * (1.0 - 1.0 / fit.chi_square[0]) if reasons else 0.0
    if gain > max(LATE_WORTH, wanted):
        when = "late" if late > 0.0 else "early"
        reasons.insert(0, EstimateCode.CHANNEL_LATE.note(channel=channel, milliseconds=1e3 * abs(late), when=when))
    return tuple(reasons)
