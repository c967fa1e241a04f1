"""`hypotheses_asked(log, parameters, ...)`: hypotheses to test beside the plain flow form, and their starts."""

from collections.abc import Callable, Mapping, Sequence

from estimation.fits.flow.accumulator import is_far_stiffer
from estimation.fits.flow.log import homed_at_stop
from estimation.fits.flow.plain import PlainFits
from estimation.fits.flow.search import MAKEUP_TRIED
from estimation.fits.flow.wide_valves import outruns_pump
from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.greybox.lateness import latest_channel
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.greybox.play import NO_PLAY, ShownPlay, shows_play
from estimation.fits.hypotheses import (
    BEGUN_UNDER_LOAD,
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
    ZERO_HIDDEN,
    Hypothesis,
)
from estimation.fits.hypothesis_search.coarse_search import VANISHED
from estimation.fits.hypothesis_search.explain import REQUIRED_GAIN
from estimation.fits.hypothesis_search.fit_objections import exceeds_noise, fit_explains, is_too_close
from estimation.fits.hypothesis_search.not_excluded import open_wear_note, share_lost
from estimation.fits.hypothesis_search.predicted_gains import (
    PredictedGain,
    predicted_gain,
    predicted_gains,
    shared_slopes,
)
from estimation.fits.hypothesis_search.wide_log import HELD_PARAMETERS
from estimation.fits.hypothesis_search.wide_problem import widest_makeup
from estimation.models.completed_flow import CRACKS, balances_mass
from estimation.models.wide_flow import LINEAR
from plant.eha.model import EhaParameters
from plant.notes import Note

ZERO_WORTH = 30.0
"""Gain in log-likelihood that slopes must promise before an encoder's zero is tested in a log that the plain form
explains [dimensionless]. They promise at least 100 if the zero is off by 60 mm or more. They promise at most 2.5 in
logs of 30 other kinds, and 14 in a log with encoder play, which a zero would explain wrongly."""

FARTHEST_LEAD = 0.99
"""Lead of the motor on the line between samples, from which the speed may lag instead [sample times]: the lead is at
most one sample time. A lead the other way, which slow logs may have, may be a late pressure: 2.5 ms at 500 Hz put bulk
modulus 5.6 % too high."""

TOO_WIDE = 20.0
"""Conductance of make-up valves over its first guess, from which a search also begins at the guess [dimensionless]."""

WIDEST_SHARE = 0.9
"""Conductance of make-up valves over the largest that model steps resolve, from which all effects are tested though the
plain form explains the log [fraction]. In 48 sound logs it is at most 0.42, and 0.09 if the oil is not stiff. A
pressure that lagged by 2 ms was fitted by valves at the limit, with bulk modulus 1 % too low and residuals of 1.07
times the noise."""

ALWAYS_ASKED = (DELIVERY, ENCODER_ZERO, *MAY_HIDE)
"""Effects that are tested even if the plain form explains the log, where slopes promise a gain: each may be hidden."""

UNPAIRED = (*ALWAYS_ASKED, ZERO_HIDDEN, CHECKS_HIDDEN, PLAY, PRESSURE_SIDES)
"""Hypotheses that are not tried in pairs unless another hypothesis is tested too."""

LEAST_ZERO, LEAST_SHIFT = 5e-3, 3.6e-3
"""Smallest encoder zero that is searched for [m], and the same over the length of a chamber in mid-stroke, if that is
smaller [fraction]. 5 mm change a chamber of the paper's actuator by 0.35 %, and one of a drone's by a tenth."""

ZERO_SIZE = LINEAR[ENCODER_ZERO.free[0]]
"""Size of an encoder zero for which slopes predict the gain [m]."""

LONGEST_TESTED = 70_000
"""Length of a log from which no effects are tested, since that would take minutes [samples]."""


def hypotheses_asked(
    log: GreyBoxLog,
    parameters: EhaParameters,
    swinging: GreyBoxFit,
    best: GreyBoxFit,
    sensed: ShownPlay = NO_PLAY,
    *,
    loaded: bool,
    moving: bool,
    worth: float = REQUIRED_GAIN,
) -> tuple[tuple[Hypothesis, ...], tuple[Note, ...]]:
    """Return the hypotheses to test on a log, given its best fits with varying and with held volumes.

    Held volumes may also fit a log whose encoder was homed at a stop, so such a log is tested all the same.

    Parameters
    ----------
    log : GreyBoxLog
        The log, as the plain flow form sees it.
    swinging, best : GreyBoxFit
        The best fit with varying volumes, and the best fit of all.
    sensed : ShownPlay
        The play between two motion channels.
    loaded : bool
        Whether the log begins under load, and not at rest.
    moving : bool
        Whether the motor turns when it begins.
    worth : float, optional
        Gain in log-likelihood that slopes must promise if the plain form explains the log [dimensionless].

    Returns
    -------
    tuple of Hypothesis
        What is asked.
    tuple of Note
        What the log leaves open.
    """
    if len(log.drives) > LONGEST_TESTED:
        return (), ()
    if loaded:  # at rest a sensor that reads too high looks like a load
        return (BEGUN_UNDER_LOAD, OFFSET_AT_REST), ()
    if is_too_close(swinging, log.passes_on):
        return (), ()
    all_strange = (*HYPOTHESES, MAKEUP_BENDS) if outruns_pump(log, parameters) else HYPOTHESES
    if not fit_explains(swinging, log.passes_on) or latest_channel(swinging.late)[2] > REQUIRED_GAIN:
        return (BEGUN_UNDER_LOAD,) if moving else all_strange, ()
    asked, delivery = _promising_hypotheses(log, parameters, swinging, best, sensed, worth)
    remarks = open_wear_note(delivery, share_lost(log, swinging.values, parameters.pump_displacement))
    if at_widest(swinging, parameters, log):
        return (BEGUN_UNDER_LOAD,) if moving else all_strange, remarks
    if moving:
        loaded = _may_begin_under_load(log, parameters, swinging, best)
        return (BEGUN_UNDER_LOAD, *asked) if loaded else asked, remarks
    return HYPOTHESES if not log.passes_on and exceeds_noise(swinging) else asked, remarks


def _promising_hypotheses(
    log: GreyBoxLog,
    parameters: EhaParameters,
    swinging: GreyBoxFit,
    best: GreyBoxFit,
    sensed: ShownPlay,
    worth: float,
) -> tuple[tuple[Hypothesis, ...], PredictedGain]:
    """Return the hypotheses worth a test though the plain form explains the log, and what another delivery promises."""
    by_mass = balances_mass(swinging.model)
    promises = predicted_gains(
        log.stepped(swinging.steps),
        parameters,
        swinging.values,
        ALWAYS_ASKED,
        by_mass=by_mass,
        slopes=shared_slopes(swinging, log),
    )
    delivery, zero, *hidden = _possible_gains(promises, swinging)
    sought = ZERO_HIDDEN if is_far_stiffer(log, swinging.values) else ENCODER_ZERO
    shows_zero = best is swinging or homed_at_stop(log)
    # the fit with varying volumes may be wrong: its slopes then predict no gain
    if best is not swinging and shows_zero:
        zero = max(zero, predicted_gain(log, parameters, best.values, ENCODER_ZERO))
    if sought is ZERO_HIDDEN:  # the accumulator has absorbed the zero, so slopes beside it predict no gain
        zero = max(
            zero, predicted_gain(log, parameters, _without_held_values(swinging.values), ENCODER_ZERO, by_mass=by_mass)
        )
    worn = delivery.gain > worth and abs(delivery.size) > LEAST_DELIVERY
    shifted = shows_zero and zero.gain > ZERO_WORTH and abs(zero.size) * ZERO_SIZE > _least_zero(parameters)
    plays = shows_play(swinging.play, sensed)
    lead = swinging.values.get("speed_lead", 0.0) / log.sample_time
    behind, ahead = lead > FARTHEST_LEAD, lead < -FARTHEST_LEAD
    tried = (DELIVERY, worn), (sought, shifted), (PLAY, plays), (SPEED_LATE, behind), (PRESSURE_LATE, ahead)
    asked = tuple(one for one, worthwhile in tried if worthwhile)
    asked += tuple(one for one, promise in zip(MAY_HIDE, hidden, strict=True) if promise.gain > worth)
    return asked + tuple(one for one in _late_valves(swinging) if one not in asked), delivery


def _may_begin_under_load(log: GreyBoxLog, parameters: EhaParameters, swinging: GreyBoxFit, best: GreyBoxFit) -> bool:
    """Return whether a log that begins in motion may begin under load.

    Chambers shut in far above the accumulator draw no make-up flow for seconds; a search from rest then loses it.
    """
    fed = swinging.values["makeup_conductance"] > VANISHED * parameters.makeup_conductance
    if swinging is best and not fed and exceeds_noise(swinging):
        return True
    by_mass = balances_mass(swinging.model)
    begun = predicted_gain(log.coarsened(), parameters, swinging.values, START_LOAD, by_mass=by_mass)
    return _possible_gains([begun], swinging)[0].gain > REQUIRED_GAIN


def at_widest(fit: GreyBoxFit, parameters: EhaParameters, log: GreyBoxLog) -> bool:
    """Return whether a plain fit's make-up valves are at their upper limit.

    No real valve is so wide, so they absorbed another effect.

    Parameters
    ----------
    fit : GreyBoxFit
        The plain form's.
    """
    stiff = max(parameters.bulk_modulus, fit.values["bulk_modulus"])
    return fit.values.get("makeup_conductance", 0.0) > WIDEST_SHARE * widest_makeup(
        parameters.chamber_volume, stiff, log
    )


def is_astray(log: GreyBoxLog, fit: GreyBoxFit, parameters: EhaParameters) -> bool:
    """Return whether a plain fit absorbed another effect, and so ended in a wrong minimum though it explains its log.

    Parameters
    ----------
    fit : GreyBoxFit
        The plain form's.
    """
    return at_widest(fit, parameters, log) or is_far_stiffer(log, fit.values)


def hypotheses_tested_alone(plain: PlainFits, asked: Sequence[Hypothesis]) -> tuple[Hypothesis, ...]:
    """Return the hypotheses that are tested after all others: unequal gauges, and equal pressure locked in at first.

    Parameters
    ----------
    asked : sequence of Hypothesis
        The hypotheses that are tested together. If these are not all, nothing is tested alone.
    """
    if len(asked) < len(HYPOTHESES):
        return ()
    astray = is_astray(plain.log, plain.swinging, plain.start.parameters)
    return (PRESSURE_SIDES, BEGUN_UNDER_LOAD) if astray else (PRESSURE_SIDES,)


def _least_zero(p: EhaParameters) -> float:
    """Return the smallest encoder zero that is searched for [m]."""
    length = 2.0 * p.chamber_volume / p.piston_area
    return min(LEAST_ZERO, LEAST_SHIFT * length)


def _late_valves(fit: GreyBoxFit) -> tuple[Hypothesis, ...]:
    """Return what is tested if make-up valves open late in a plain fit: slopes cannot tell that a valve never opens."""
    first, second = (fit.values.get(name, 0.0) for name in CRACKS)
    late, unlike = max(abs(first), abs(second)) > LARGE_CRACK, abs(first - second) > UNLIKE_CRACKS
    return (CHECKS_HIDDEN,) * late + (MAKEUP_HIDDEN,) * unlike


def wanted_gain_at_turns(log: GreyBoxLog, left: float = 1.0) -> float:
    """Return the gain that a hypothesis must reach: `REQUIRED_GAIN` at each turn of a slow log.

    The motor passes all turns alike, so straight lines err alike in all of them: a hypothesis that repairs that error
    gains at all turns at once. A real effect must be seen at each turn. The noise of a slow log is read from the log
    and includes some of the actuator's motion; if a hypothesis leaves less than this noise, its gain counts in
    proportion to what it leaves.

    Parameters
    ----------
    left : float
        Mean squared normalised residual under the hypothesis [dimensionless].

    Returns
    -------
    float
        Gain in log-likelihood [dimensionless].
    """
    return REQUIRED_GAIN * log.turn_count * (1.0 if log.course is None else min(left, 1.0))


def _possible_gains(promises: Sequence[PredictedGain], fit: GreyBoxFit) -> Sequence[PredictedGain]:
    """Return the predicted gains; none if a prediction exceeds all that the fit leaves.

    Slopes were then taken where an unfed chamber of the model is below vapour pressure, which no oil can be. The
    predicted shifts are just as wrong.
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
    """Return the starts of the search for hypotheses: only the fit, if it explains the log.

    If the log does not begin at rest (``in_motion``), that fit may be in a wrong minimum without make-up flow, so the
    other starts are tried too. They are also tried if make-up valves ended far too wide, where the model is too coarse
    to find its way back, and if the accumulator absorbed another effect.

    Parameters
    ----------
    fit : GreyBoxFit
        The fit of the plain form.
    starts : sequence of Mapping[str, float]
        Where its search began [SI].
    explains : callable
        ``explains(fit)``: whether a fit explains the log.
    in_motion : bool
        Whether the log begins under load, or while the motor turns.
    astray : bool, optional
        Whether the fit is in a wrong minimum although it explains the log, see `is_astray`.

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
    return [*map(_without_held_values, near), *usual]


def _without_held_values(values: Mapping[str, float]) -> dict[str, float]:
    """Return values without those that a search for unusual effects holds, see `HELD_PARAMETERS`."""
    return {name: value for name, value in values.items() if name not in HELD_PARAMETERS}
