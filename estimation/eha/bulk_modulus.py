"""`estimate_bulk_modulus(record, parameters)`: a number, an interval, a verdict; or a note instead of a number."""

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from estimation.eha.another_rig import rejected_if_another_rig, slips_or_rig_contradiction
from estimation.eha.another_rod import vague_area_notes
from estimation.eha.foreign_oil import no_motion_notes, rejected_if_foreign_oil
from estimation.eha.named_methods import NAMED
from estimation.eha.result import LARGEST_BOUND, BulkModulusEstimate, is_vague, wide_bound_note, without_number
from estimation.eha.rig_share import fitted_responses, scaled_responses, with_wear
from estimation.eha.smoothed_pressure import told_if_smoothed
from estimation.filters.run import available_channels
from estimation.finding import Gate, Outcome
from estimation.fits.flow.fit import REPORTED, fit_flow
from estimation.fits.flow.log import FLOW_CHANNELS, require_flow_channels
from estimation.fits.flow.log_traits import LogTraits
from estimation.fits.flow.swapped_sides import SidesCode
from estimation.fits.hypothesis_search.form_fit import FormFit
from estimation.fits.hypothesis_search.pump_delivery import delivery_share
from estimation.fits.motion.fit import MOTION_CHANNELS, fit_motion
from estimation.log_checks.channel_names import POSITION, PRESSURE, PRESSURES, SPEED
from estimation.log_checks.clean import CleanLog, clean_log
from estimation.log_checks.first_belief import START_STD, begins_in_motion, first_belief, first_load
from estimation.log_checks.unit_slips import FARTHEST, RPM, TURNS, unit_note
from estimation.models.eha_forms import FORMS
from estimation.notes import ChannelCode, EstimateCode
from estimation.trust.bounds import bulk_modulus_bound
from estimation.trust.consistency import MISMATCH_NIS
from plant.eha.doubts import Spread
from plant.eha.model import EhaParameters
from plant.errors import HydrostateError, LogWarning, require_known
from plant.log.record import Record
from plant.notes import Note

LEAST_SQUARES = "least-squares"
"""The method of the forms that are fitted."""

FITTED: Mapping[str, tuple[Callable[..., FormFit], tuple[str, ...]]] = {
    "flow": (fit_flow, FLOW_CHANNELS),
    "motion": (fit_motion, MOTION_CHANNELS),
}
"""The forms that can be fitted, with the channels that they use beside motor speed."""


@dataclass(frozen=True)
class EstimateOptions:
    """Options of an estimate of bulk modulus.

    Parameters
    ----------
    form : str
        ``"flow"``, ``"motion"``, ``"pressure"``, ``"acceleration"`` (the published one, valid between reversals only,
        errata E9), or ``"auto"``: flow or motion if their channels are logged, otherwise pressure.
    method : str
        ``"least-squares"`` for the forms that can be fitted, flow and motion; a filter of
        `estimation.filters.methods.METHODS`; a method of `estimation.eha.named_methods.NAMED`, with a form of its own;
        or ``"auto"``: least squares if the form allows it, the log begins at rest, and no option needs a filter,
        otherwise that of `estimation.eha.by_filter.chosen_method`.
    start : float, optional
        First guess [Pa]; the actuator's own if not given.
    start_std : float
        Its standard deviation, for the forms that are filtered [Pa].
    states : tuple of str
        States that a filter estimates beside bulk modulus: ``leakage``, ``friction``, ``air``, or a parameter's name.
    tuned : bool
        Whether the filter's noise levels are tuned to the log by likelihood.
    robust : str
        How gross outliers count in the filter: ``"none"``, ``"huber"`` or ``"student-t"``.
    """

    form: str = "auto"
    method: str = "auto"
    start: float | None = None
    start_std: float = START_STD
    states: tuple[str, ...] = ()
    tuned: bool = False
    robust: str = "none"

    @property
    def filtering(self) -> bool:
        """Whether an option is set that only a filter has."""
        return self.method not in ("auto", LEAST_SQUARES) or bool(self.states) or self.tuned or self.robust != "none"


DEFAULT_OPTIONS = EstimateOptions()
"""Everything automatic."""


def estimate_bulk_modulus(
    record: Record,
    parameters: EhaParameters,
    *,
    uncertainties: Mapping[str, float | Spread] | None = None,
    **options: Any,
) -> BulkModulusEstimate:
    """Estimate effective bulk modulus from a log.

    With position and ``differential_pressure_pa``, the flow form fits it with leakage and flow bias, without friction
    (`estimation.models.flow`). Without pressure, the motion form fits leakage and friction along with it
    (`estimation.models.motion`). The estimate then depends on how the piston starts, stops and rings; if it sticks, the
    outcome says so in place of a number (errata E13). A filter takes leakage and friction as known.

    Bulk modulus appears only as ``chamber_volume / bulk_modulus``. So the uncertainty of the volume, and of pump and
    piston, is part of that of bulk modulus; `uncertainties` carry it into the total interval.

    Parameters
    ----------
    parameters : EhaParameters
        The actuator; its bulk modulus is the default first guess, and the value at which the bound is computed.
    uncertainties : Mapping[str, float or Spread], optional
        Relative standard deviation of the actuator's parameters, as a rig file has them [fraction], or that of their
        logarithms down and up; none by default.
    **options
        The fields of `EstimateOptions`.

    Returns
    -------
    BulkModulusEstimate
        Value, interval, bound and verdict. A filter's value is its mean over the last 20 % of the log, or that after
        the last sample if its noise levels are tuned.

    Raises
    ------
    HydrostateError
        If the form or method is unknown, or the first guess is not usable.
    LogError
        If the log lacks what the form needs.

    Warns
    -----
    LogWarning
        If samples of a channel that is used were left out.
    """
    log = clean_log(record, parameters)
    found = estimate_clean(log, parameters, EstimateOptions(**options), uncertainties)
    for note in left_out_notes(log, found):
        warnings.warn(LogWarning(note), stacklevel=2)
    return found


def left_out_notes(log: CleanLog, found: BulkModulusEstimate) -> tuple[Note, ...]:
    """Return the notes on data left out of the channels that an estimate used.

    Returns
    -------
    tuple of Note
        At most one per channel.
    """
    used = {*found.channels, SPEED, *(PRESSURES if PRESSURE in found.channels else ())}
    return tuple(note for note in log.left_out if note.data["channel"] in used)


def estimate_clean(
    log: CleanLog,
    parameters: EhaParameters,
    options: EstimateOptions = DEFAULT_OPTIONS,
    uncertainties: Mapping[str, float | Spread] | None = None,
) -> BulkModulusEstimate:
    """Estimate effective bulk modulus from a log whose sensors have been checked; see `estimate_bulk_modulus`.

    Parameters
    ----------
    options : EstimateOptions
        Options of the estimate.
    uncertainties : Mapping[str, float or Spread], optional
        Uncertainty of the actuator's parameters [fraction]; it changes neither outcome nor gate.

    Raises
    ------
    HydrostateError
        If the form or method is unknown, or the first guess is not usable.
    LogError
        If the log lacks what the form needs.
    """
    spreads = {name: Spread.of(one) for name, one in (uncertainties or {}).items()}
    guess = parameters.bulk_modulus if options.start is None else options.start
    if not (np.isfinite(guess) and guess >= 0.0 and np.isfinite(options.start_std) and options.start_std > 0.0):
        raise HydrostateError(
            f"the first guess must be 0 Pa or more, its deviation positive, got {guess}, {options.start_std}"
        )
    automatic, filtering = options.form == "auto", options.filtering
    form = _form_to_fit(options, log.record)
    if log.mistakes:
        return _mistaken_channels_estimate(log, form)
    if automatic and not filtering and (wrong := _sensor_objections(log, form)):
        return without_number(Outcome.MISMATCH, wrong, form, FITTED[form][1])
    if automatic and form == "motion" and (bound := rigid_bound(log, parameters)) > LARGEST_BOUND:
        return without_number(Outcome.NOT_OBSERVABLE, (wide_bound_note(bound),), form, MOTION_CHANNELS, bound)
    if automatic and form == "flow" and not filtering and (still := no_motion_notes(log.record, parameters)):
        return without_number(Outcome.NOT_OBSERVABLE, still, form, FLOW_CHANNELS)
    fit = None if filtering else _fit(log, parameters, form, guess, spreads, chosen=options.method == LEAST_SQUARES)
    if fit is not None and (slips := _channel_slips(fit, parameters)):
        slips = slips_or_rig_contradiction(slips, log.record, parameters)
        return without_number(Outcome.MISMATCH, slips, form, FITTED[form][1])
    if fit is None:
        found = _filtered_estimate(log, parameters, form, guess, options)
    else:
        found = _fitted_estimate(fit, form, FITTED[form][1])
        found = replace(found, responses=fitted_responses(fit)) if form == "flow" else found
    found = rejected_if_another_rig(_with_rig_uncertainty(found, parameters, spreads), log, parameters)
    if form == "flow":
        found = told_if_smoothed(rejected_if_foreign_oil(found, log.record, parameters), log.record)
    return _gated_by_sensors(found, log)


def _fit(
    log: CleanLog, parameters: EhaParameters, form: str, guess: float, spreads: Mapping[str, Spread], *, chosen: bool
) -> FormFit | None:
    """Return the fit of a form; None if it has none, or if the log begins under a load that the form does not explain.

    If the user chose least squares, it is used whatever the log begins with.
    """
    if form != "flow":
        return FITTED[form][0](log.record, parameters, guess, {}, log.variances) if form in FITTED else None
    require_flow_channels(log.record)
    doubted, record = {name: max(one) for name, one in spreads.items()}, log.record
    loaded = not chosen and first_load(record, log.variances) != 0.0
    traits = LogTraits(loaded, begins_in_motion(record), log.filtered, log.speed_held, log.averaged)
    fit = fit_flow(record, parameters, guess, doubted, log.variances, traits)
    ended = any(note.code in (EstimateCode.SEARCH_ENDED, SidesCode.SIDES_SWAPPED) for note in fit.reasons)
    plain = not fit.reasons  # explained down to the noise: a load that leaks off at once leaves no trace
    # None leaves the log to a filter, which need not begin at rest
    return None if loaded and fit.explanation is None and not (ended or plain) else fit


def _filtered_estimate(
    log: CleanLog, parameters: EhaParameters, form: str, guess: float, options: EstimateOptions
) -> BulkModulusEstimate:
    """Return the estimate of a filter; imported only here, so that a fitted log does not load it."""
    from estimation.eha.by_filter import FilterOptions, estimate_by_filter, estimate_by_flow_filter

    method = "auto" if options.method == LEAST_SQUARES else options.method
    chosen = FilterOptions(method, options.states, options.tuned, options.robust)
    if form == "flow":
        return estimate_by_flow_filter(log, parameters, chosen, guess)
    if options.method == LEAST_SQUARES or form == "motion":
        how = "filtered" if form in FORMS else "fitted by least squares"
        raise HydrostateError(f"the {form} form is {how}, got method {options.method!r}")
    require_known("form", form, FORMS)
    return estimate_by_filter(log, parameters, FORMS[form], guess, options.start_std, chosen)


def _sensor_objections(log: CleanLog, form: str) -> tuple[Note, ...]:
    """Return the objections to the sensors that a fit would use: it would explain their errors by false faults."""
    return log.objections_to((*FITTED[form][1], SPEED)) if form in FITTED else ()


def _gated_by_sensors(found: BulkModulusEstimate, log: CleanLog) -> BulkModulusEstimate:
    """Return the estimate with the gate shut if a sensor that was used has failed."""
    said = log.objections_to((*found.channels, SPEED))
    if not said:
        return found
    return replace(found, gate=replace(found.gate, passed=False, reasons=(*said, *found.gate.reasons)))


def _form_to_fit(options: EstimateOptions, record: Record) -> str:
    """Return the form to fit: that of a named method, the chosen one, or the one that the log allows."""
    if options.method in NAMED:
        own = NAMED[options.method].form
        if options.form not in ("auto", own):
            raise HydrostateError(f"{options.method} believes the {own} form, got form {options.form!r}")
        return own
    if options.form != "auto":
        return options.form
    return "pressure" if options.filtering else _automatic_form(record)


def _automatic_form(record: Record) -> str:
    if all(channel in record for channel in FLOW_CHANNELS):
        return "flow"
    return "motion" if all(channel in record for channel in MOTION_CHANNELS) else "pressure"


def rigid_bound(log: CleanLog, parameters: EhaParameters) -> float:
    """Return the bound of the pressure form, which knows leakage and friction: forms that must find them do no better.

    It takes one pass over the log, and detects a piston that sticks throughout before a fit is tried (errata E13).

    Parameters
    ----------
    log : CleanLog
        The log; only its drive and noise levels are used.

    Returns
    -------
    float
        Relative Cramér-Rao bound of bulk modulus [fraction].
    """
    model = FORMS["pressure"]
    channels = available_channels(model, log.record)
    prior = first_belief(model, log.record, parameters.bulk_modulus, START_STD)
    variances = {channel: log.variances[channel] for channel in channels}
    std = bulk_modulus_bound(model, prior, log.record, parameters, channels=channels, variances=variances)
    return std / parameters.bulk_modulus


def _channel_slips(fit: FormFit, parameters: EhaParameters) -> tuple[Note, ...]:
    """Return the wrong signs and units that a fit names; no pump delivers several times its displacement."""
    share = None if fit.explanation is None else delivery_share(fit.explanation, parameters)
    if share is None or share <= FARTHEST:
        return tuple(note for note in fit.reasons if isinstance(note.code, ChannelCode))
    return (unit_note(SPEED, POSITION, 1.0 / share, TURNS[RPM]),)


def _mistaken_channels_estimate(log: CleanLog, form: str) -> BulkModulusEstimate:
    """Return an outcome without a number, since the log's channels are not what their names say."""
    used = tuple(name for name in FLOW_CHANNELS if name in log.record)
    return without_number(Outcome.MISMATCH, log.mistakes, form, used)


def _with_rig_uncertainty(
    found: BulkModulusEstimate, parameters: EhaParameters, spreads: Mapping[str, Spread]
) -> BulkModulusEstimate:
    """Return an estimate with the rig's uncertainty, by the laws of dimension if the fit has no responses."""
    found = replace(found, spreads=with_wear(spreads, found.remarks))
    if found.value is None or found.responses:
        return found
    values = {name: value for name, (value, _) in found.others.items()}
    return replace(found, responses=scaled_responses(parameters, values, pressure=PRESSURE in found.channels))


def _fitted_estimate(fit: FormFit, form: str, channels: tuple[str, ...]) -> BulkModulusEstimate:
    value, std = fit.parameters["bulk_modulus"]
    reasons = (*fit.reasons, *vague_area_notes(fit.explanation))
    gate, outcome = Gate(not reasons, reasons), Outcome.OK if fit.chi_square < MISMATCH_NIS else Outcome.MISMATCH
    known_to = max(fit.bound, std / value if is_vague(value, std) else 0.0)
    if outcome is Outcome.OK and known_to > LARGEST_BOUND:
        outcome, gate = Outcome.NOT_OBSERVABLE, Gate(False, (wide_bound_note(known_to), *reasons))
    known = outcome is Outcome.OK
    return BulkModulusEstimate(
        outcome=outcome,
        value=value if known else None,
        std=std if known else None,
        bound=fit.bound,
        gate=gate,
        form=form,
        channels=channels,
        nis={channels[-1]: fit.chi_square},
        others={name: found for name, found in fit.parameters.items() if known and name in REPORTED},
        explanation=fit.explanation,
        remarks=fit.remarks,
        turning=fit.turning,
        mean_late=fit.mean_late,
        correlation=fit.correlation,
    )
