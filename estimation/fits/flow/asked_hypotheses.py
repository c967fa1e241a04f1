"""`hypotheses_asked(log, parameters, ...)`: hypotheses to test beside the plain flow form, and their starts."""

from collections.abc import Callable, Mapping, Sequence

from estimation.fits.flow.accumulator import is_far_stiffer
from estimation.fits.flow.log import homed_at_stop
from estimation.fits.flow.plain import PlainFits
from estimation.fits.flow.search import MAKEUP_TRIED
from estimation.fits.flow.wide_valves import outruns_pump
from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.greybox.lateness import most_late
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.greybox.play import NO_PLAY, ShownPlay, play_shows
from estimation.fits.hypotheses import (
    BEGUN,
    CHECKS_HIDDEN,
    DELIVERY,
    ENCODER_ZERO,
    HYPOTHESES,
    LARGE_CRACK,
    LEAST_DELIVERY,
    MAKEUP_BENDS,
    MAKEUP_HIDDEN,
    MAY_HIDE,
    OFFSET_AT_REST,
    PLAY,
    PRESSURE_LATE,
    PRESSURE_SIDES,
    SPEED_LATE,
    START_LOAD,
    UNLIKE_CRACKS,
    Hypothesis,
)
from estimation.fits.hypothesis_search.coarse_search import VANISHED
from estimation.fits.hypothesis_search.explain import WORTH
from estimation.fits.hypothesis_search.fit_objections import doubted, fit_explains, is_too_close
from estimation.fits.hypothesis_search.not_excluded import open_wear_note, share_lost
from estimation.fits.hypothesis_search.predicted_gains import PredictedGain, predicted_gain, predicted_gains, slopes_of
from estimation.fits.hypothesis_search.wide_log import HELD
from estimation.fits.hypothesis_search.wide_problem import widest_makeup
from estimation.models.completed_flow import CRACKS, balances_mass
from estimation.models.wide_flow import LINEAR
from plant.eha.model import EhaParameters
from plant.notes import Note

ZERO_WORTH = 30.0
"""Gain in log-likelihood that the slopes must promise before a log that the plain form explains is asked for its
encoder's zero [dimensionless]. They promise 100 at least where one is off by 60 mm or more, 2.5 at most on logs of 30
other kinds, and 14 on one of a play, which a zero would explain wrongly."""

FARTHEST_LEAD = 0.99
"""Lead of the motor on the line between samples from which its speed may lag instead [sample times]: one is most. The
other way, which slow logs may have, the pressure may be late: 2.5 ms at 500 Hz put bulk modulus 5.6 % too high."""

TOO_WIDE = 20.0
"""Conductance of make-up valves over the first guess from which a search begins with the guess too [dimensionless]."""

WIDEST = 0.9
"""Conductance of make-up valves over the most that model steps resolve, from which a log is asked all that is strange
though the plain form explains it [fraction]. Of 48 sound logs it is 0.42 at most, 0.09 where oil is not stiff. A
pressure that lags by 2 ms went into valves as wide as could be, bulk modulus 1 % too low at 1.07 times the noise."""

ALWAYS_ASKED = (DELIVERY, ENCODER_ZERO, *MAY_HIDE)
"""What a log that the plain form explains is asked all the same, where the slopes promise a gain: each may hide."""

LEAST_ZERO, LEAST_SHIFT = 5e-3, 3.6e-3
"""Least reading of the encoder in the middle position that is sought [m], and the same over a chamber's length there,
where that is less [fraction]: 5 mm change a chamber of the paper's actuator by 0.35 %, one of a drone's by a tenth."""

ZERO_SIZE = LINEAR[ENCODER_ZERO.free[0]]
"""Size in which slopes promise it [m]."""

MOST_ASKED = 70_000
"""A longer log is not asked what is strange about it: the answer takes minutes [samples]."""


def hypotheses_asked(
    log: GreyBoxLog,
    parameters: EhaParameters,
    swinging: GreyBoxFit,
    best: GreyBoxFit,
    sensed: ShownPlay = NO_PLAY,
    *,
    loaded: bool,
    moving: bool,
    worth: float = WORTH,
) -> tuple[tuple[Hypothesis, ...], tuple[Note, ...]]:
    """Return the hypotheses to test on a log, given its best fits with varying and with held volumes.

    Held volumes may explain a log whose encoder was homed at a stop: it is asked all the same.

    Parameters
    ----------
    log : GreyBoxLog
        The log, as the plain flow form sees it.
    parameters : EhaParameters
        The actuator.
    swinging, best : GreyBoxFit
        Its likelier fit with volumes that swing, and its likeliest.
    sensed : ShownPlay
        The play that two channels of motion show.
    loaded : bool
        Whether the log begins under load, and not at rest.
    moving : bool
        Whether the motor turns when it begins.
    worth : float, optional
        Gain in log-likelihood that slopes must promise where the plain form explains the log [dimensionless].

    Returns
    -------
    tuple of Hypothesis
        What is asked.
    tuple of Note
        What the log leaves open.
    """
    if len(log.drives) > MOST_ASKED:
        return (), ()
    if loaded:  # a sensor that reads too much looks loaded at rest
        return (BEGUN, OFFSET_AT_REST), ()
    if is_too_close(swinging, log.passes_on):
        return (), ()
    all_strange = (*HYPOTHESES, MAKEUP_BENDS) if outruns_pump(log, parameters) else HYPOTHESES
    if not fit_explains(swinging, log.passes_on) or most_late(swinging.late)[2] > WORTH:
        return (BEGUN,) if moving else all_strange, ()
    by_mass = balances_mass(swinging.model)
    promises = predicted_gains(
        log.stepped(swinging.steps),
        parameters,
        swinging.values,
        ALWAYS_ASKED,
        by_mass=by_mass,
        slopes=slopes_of(swinging, log),
    )
    delivery, zero, *hidden = _possible(promises, swinging)
    shows_zero = best is swinging or homed_at_stop(log)
    if best is not swinging and shows_zero:  # volumes that swing may have led the fit astray: slopes promise nothing
        zero = max(zero, predicted_gain(log, parameters, best.values, ENCODER_ZERO))
    if is_far_stiffer(log, swinging.values):  # else slopes promise what the accumulator leaves of a zero: nothing
        zero = max(zero, predicted_gain(log, parameters, _unheld(swinging.values), ENCODER_ZERO, by_mass=by_mass))
    worn = delivery.gain > worth and abs(delivery.size) > LEAST_DELIVERY
    shifted = shows_zero and zero.gain > ZERO_WORTH and abs(zero.size) * ZERO_SIZE > _least_zero(parameters)
    plays = play_shows(swinging.play, sensed)
    lead = swinging.values.get("speed_lead", 0.0) / log.sample_time
    behind, ahead = lead > FARTHEST_LEAD, lead < -FARTHEST_LEAD
    tried = (DELIVERY, worn), (ENCODER_ZERO, shifted), (PLAY, plays), (SPEED_LATE, behind), (PRESSURE_LATE, ahead)
    asked = tuple(one for one, worthwhile in tried if worthwhile)
    asked += tuple(one for one, promise in zip(MAY_HIDE, hidden, strict=True) if promise.gain > worth)
    asked += tuple(one for one in _late_valves(swinging) if one not in asked)
    remarks = open_wear_note(delivery, share_lost(log, swinging.values, parameters.pump_displacement))
    if at_widest(swinging, parameters, log):
        return (BEGUN,) if moving else all_strange, remarks
    if not moving:
        return HYPOTHESES if not log.passes_on and doubted(swinging) else asked, remarks
    # chambers shut in far above the accumulator take no make-up for seconds, and a search from rest ends without any
    fed = swinging.values["makeup_conductance"] > VANISHED * parameters.makeup_conductance
    lost = swinging is best and not fed and doubted(swinging)
    begun = predicted_gain(log.coarsened(), parameters, swinging.values, START_LOAD, by_mass=by_mass)
    return (BEGUN, *asked) if lost or _possible([begun], swinging)[0].gain > WORTH else asked, remarks


def at_widest(fit: GreyBoxFit, parameters: EhaParameters, log: GreyBoxLog) -> bool:
    """Return whether the make-up valves of a plain fit are as wide as may be: no valve is, so they took something up.

    Parameters
    ----------
    fit : GreyBoxFit
        The plain form's.
    parameters : EhaParameters
        The actuator.
    log : GreyBoxLog
        Its log.
    """
    stiff = max(parameters.bulk_modulus, fit.values["bulk_modulus"])
    return fit.values.get("makeup_conductance", 0.0) > WIDEST * widest_makeup(parameters.chamber_volume, stiff, log)


def is_astray(log: GreyBoxLog, fit: GreyBoxFit, parameters: EhaParameters) -> bool:
    """Return whether a plain fit took up what is strange, and so is at a wrong minimum though it explains its log.

    Parameters
    ----------
    log : GreyBoxLog
        The log.
    fit : GreyBoxFit
        The plain form's.
    parameters : EhaParameters
        The actuator.
    """
    return at_widest(fit, parameters, log) or is_far_stiffer(log, fit.values)


def asked_alone(plain: PlainFits, asked: Sequence[Hypothesis]) -> tuple[Hypothesis, ...]:
    """Return what is asked by itself after all else: gauges that differ, and a beginning in chambers shut in alike.

    Parameters
    ----------
    plain : PlainFits
        Fits of the plain form.
    asked : sequence of Hypothesis
        What the log is asked together: less than all is enough, and nothing is asked alone then.
    """
    if len(asked) < len(HYPOTHESES):
        return ()
    astray = is_astray(plain.log, plain.swinging, plain.start.parameters)
    return (PRESSURE_SIDES, BEGUN) if astray else (PRESSURE_SIDES,)


def _least_zero(p: EhaParameters) -> float:
    """Return the least reading of an encoder in the middle position that is sought [m]."""
    length = 2.0 * p.chamber_volume / p.piston_area
    return min(LEAST_ZERO, LEAST_SHIFT * length)


def _late_valves(fit: GreyBoxFit) -> tuple[Hypothesis, ...]:
    """Return what is asked of make-up valves that a plain fit has open late: slopes do not tell that one never does."""
    first, second = (fit.values.get(name, 0.0) for name in CRACKS)
    late, unlike = max(abs(first), abs(second)) > LARGE_CRACK, abs(first - second) > UNLIKE_CRACKS
    return (CHECKS_HIDDEN,) * late + (MAKEUP_HIDDEN,) * unlike


def worth_in(log: GreyBoxLog, left: float = 1.0) -> float:
    """Return what a hypothesis must gain: `WORTH` at each turn of a slow log.

    The motor passes turns alike, and what straight lines leave of one they leave of all: what a hypothesis gains there
    it gains once. What is strange is seen at each. Noise that is read off a slow log holds some of what the actuator
    does; where a hypothesis leaves less, it must gain as much of what it leaves.

    Parameters
    ----------
    log : GreyBoxLog
        The log.
    left : float
        Mean squared normalised residual under the hypothesis [dimensionless].

    Returns
    -------
    float
        Gain in log-likelihood [dimensionless].
    """
    return WORTH * log.passes * (1.0 if log.course is None else min(left, 1.0))


def _possible(promises: Sequence[PredictedGain], fit: GreyBoxFit) -> Sequence[PredictedGain]:
    """Return promises of what can be gained: none where one is of more than a fit leaves.

    Slopes were then taken where a chamber that nothing feeds is below vapour pressure, as no oil can be; how far they
    would move what is freed is as wrong.
    """
    if max(one.gain for one in promises) > fit.cost:
        return [one._replace(gain=0.0, size=0.0) for one in promises]
    return promises


def near_starts(
    fit: GreyBoxFit,
    starts: Sequence[Mapping[str, float]],
    explains: Callable[[GreyBoxFit], bool],
    *,
    in_motion: bool,
    astray: bool = False,
) -> Sequence[Mapping[str, float]]:
    """Return the starts of the search for hypotheses: a fit that explains the log is at no wrong minimum.

    One that begins at rest may be where the log does not (``in_motion``): without make-up, which is then tried too.
    So it is where make-up valves ended far wider than any, since the model is too rough there to find a way back, and
    where the accumulator took up what is strange.

    Parameters
    ----------
    fit : GreyBoxFit
        The plain form's.
    starts : sequence of Mapping[str, float]
        Where its search began [SI].
    explains : callable
        ``explains(fit)``: whether a fit explains the log.
    in_motion : bool
        Whether the log begins under load, or while the motor turns.
    astray : bool, optional
        Whether it is at a wrong minimum all the same, see `is_astray`.

    Returns
    -------
    sequence of Mapping[str, float]
        First guesses [SI].
    """
    fed = {**fit.values, "makeup_conductance": MAKEUP_TRIED[0]}
    if explains(fit) and not astray:
        return [fit.values, fed] if in_motion else [fit.values]
    usual = [start for start in starts if start["makeup_conductance"] == MAKEUP_TRIED[0]]
    lost = fit.values["makeup_conductance"] > TOO_WIDE * MAKEUP_TRIED[0]
    near = [fit.values, fed] if lost else [fit.values]
    return [*map(_unheld, near), *usual]


def _unheld(values: Mapping[str, float]) -> dict[str, float]:
    """Return values without those that a search for what is strange holds, see `HELD`."""
    return {name: value for name, value in values.items() if name not in HELD}
