"""`estimate_bulk_modulus(record, parameters)`: a number, an interval, a verdict; or a sentence instead of a number."""

import warnings
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TypeVar

import numpy as np

from estimation.bounds import bulk_modulus_bound
from estimation.bulk_modulus_estimate import LARGEST_BOUND, BulkModulusEstimate, Outcome, too_wide
from estimation.bulk_modulus_estimate import NORMAL_95 as NORMAL_95
from estimation.bulk_modulus_estimate import OUTCOMES as OUTCOMES
from estimation.consistency import MISMATCH_NIS, Gate
from estimation.eha import FORMS
from estimation.filter_estimate import FilterOptions, estimate_by_filter, estimate_by_flow_filter
from estimation.first_belief import START_STD, first_belief, first_load
from estimation.flow_fit import FLOW_CHANNELS, REPORTED, fit_flow
from estimation.form_fit import FormFit
from estimation.measurement_noise import measurement_variances
from estimation.motion_fit import MOTION_CHANNELS, fit_motion
from estimation.outliers import without_gross_outliers
from estimation.run import available_channels, predicted_channels
from estimation.sensor_check import PRESSURE, sensor_objections, without_saturated
from plant.eha import EhaParameters
from plant.errors import HydrostateError, LogWarning
from plant.record import Record

T = TypeVar("T")


def estimate_bulk_modulus(
    record: Record,
    parameters: EhaParameters,
    *,
    form: str = "auto",
    method: str = "auto",
    start: float | None = None,
    start_std: float = START_STD,
    uncertainties: Mapping[str, float] | None = None,
    states: tuple[str, ...] = (),
    tuned: bool = False,
    robust: str = "none",
) -> BulkModulusEstimate:
    """Estimate effective bulk modulus from a log.

    With position and ``differential_pressure_pa`` logged, the flow form fits it with leakage and flow bias, and
    friction plays no part (`estimation.flow`). Without pressure, the motion form fits leakage and friction along with
    it (`estimation.motion`), and the estimate rests on how the piston starts, stops and rings; where it sticks there is
    nothing to rest on, and the outcome says so instead of printing a number (errata E13). A filter takes leakage and
    friction as known.

    Bulk modulus enters as ``chamber_volume / bulk_modulus`` alone, so what is not known of the volume, and of the pump
    and the piston, is not known of bulk modulus either; `uncertainties` carry it into the interval.

    Parameters
    ----------
    record : Record
        The log.
    parameters : EhaParameters
        The actuator; its bulk modulus is where the bound is taken, and the default first guess.
    form : str
        ``"flow"``, ``"motion"``, ``"pressure"``, ``"acceleration"`` (the published one, valid between reversals only,
        errata E9), or ``"auto"``: flow or motion where their channels are logged, else pressure.
    method : str
        ``"least-squares"`` for the forms that can be fitted, flow and motion; a filter of `estimation.run.METHODS`; or
        ``"auto"``: least squares where the form allows, the log begins at rest, and nothing is asked for that only a
        filter does, else what `estimation.filter_estimate.chosen_method` says.
    start : float, optional
        First guess [Pa].
    start_std : float
        Its standard deviation, for the forms that are filtered [Pa].
    uncertainties : Mapping[str, float], optional
        Relative standard deviation of the actuator's parameters, as a rig file has them [fraction]; none by default.
    states : tuple of str
        What a filter estimates beside bulk modulus: ``leakage``, ``friction``, ``air``, or a parameter's name.
    tuned : bool
        Whether the filter's noise levels are tuned to the log by likelihood.
    robust : str
        How gross outliers count in the filter: ``"none"``, ``"huber"`` or ``"student-t"``.

    Returns
    -------
    BulkModulusEstimate
        Value, interval, bound and verdict; a filter's value is its mean over the last 20 % of the log.

    Raises
    ------
    HydrostateError
        If the form or method is unknown, or the first guess is not usable.
    LogError
        If the log lacks what the form needs.
    """
    guess = parameters.bulk_modulus if start is None else start
    if not (np.isfinite(guess) and guess >= 0.0 and np.isfinite(start_std) and start_std > 0.0):
        raise HydrostateError(f"the first guess must be 0 Pa or more, its deviation positive, got {guess}, {start_std}")
    known = uncertainties or {}
    options = FilterOptions("auto" if method in ("auto", LEAST_SQUARES) else method, states, tuned, robust)
    filtering = method not in ("auto", LEAST_SQUARES) or options != FilterOptions()
    automatic = form == "auto"
    if automatic:
        form = "pressure" if filtering else _automatic(record)
    record = _believable(record, parameters, form)
    if automatic and form == "motion" and (bound := rigid_bound(record, parameters)) > LARGEST_BOUND:
        return _doubting_sensors(_unseen(bound), record, parameters)
    filtering |= form == "flow" and method == "auto" and first_load(record) != 0.0  # a fit begins at rest
    if form in FITTED and not filtering:
        fit, channels = FITTED[form]
        found = _fitted(fit(record, parameters, guess, known), form, channels)
    elif form == "flow":
        found = _with_rig(estimate_by_flow_filter(record, parameters, options), known)
    elif method == LEAST_SQUARES or form == "motion":
        raise HydrostateError(
            f"the {form} form is {'filtered' if form in FORMS else 'fitted by least squares'}, got method {method!r}"
        )
    else:
        model = _chosen(FORMS, form, "form")
        found = _with_rig(estimate_by_filter(record, parameters, model, guess, start_std, options), known)
    return _doubting_sensors(found, record, parameters)


def _believable(record: Record, parameters: EhaParameters, form: str) -> Record:
    """Return the log without gross outliers and clipped pressures of what a form uses; warn of what was left out."""
    used = FITTED[form][1] if form in FITTED else predicted_channels(_chosen(FORMS, form, "form"))
    record, outliers = without_gross_outliers(record, ("motor_speed_rad_s", *used))
    record, clipped = without_saturated(record, parameters) if PRESSURE in used else (record, ())
    for sentence in (*outliers, *clipped):
        warnings.warn(sentence, LogWarning, stacklevel=3)
    return record


def _doubting_sensors(found: BulkModulusEstimate, record: Record, parameters: EhaParameters) -> BulkModulusEstimate:
    """Return the estimate with the gate shut where a sensor that was used has stopped telling the truth."""
    used = record.replace(**{name: None for name in record if name not in (*found.channels, "motor_speed_rad_s")})
    said = sensor_objections(used, parameters)
    if not said:
        return found
    return replace(found, gate=replace(found.gate, passed=False, reasons=(*said, *found.gate.reasons)))


LEAST_SQUARES = "least-squares"
"""The method of the forms that are fitted."""

FITTED: Mapping[str, tuple[Callable[..., FormFit], tuple[str, ...]]] = {
    "flow": (fit_flow, FLOW_CHANNELS),
    "motion": (fit_motion, MOTION_CHANNELS),
}
"""The forms that can be fitted, with the channels that they use beside motor speed."""


def _automatic(record: Record) -> str:
    if all(channel in record for channel in FLOW_CHANNELS):
        return "flow"
    return "motion" if all(channel in record for channel in MOTION_CHANNELS) else "pressure"


def rigid_bound(record: Record, parameters: EhaParameters) -> float:
    """Return the bound of the pressure form, which knows leakage and friction: no form that must find them does better.

    It takes one pass over the log, and tells a piston that sticks throughout before a fit is tried (errata E13).

    Parameters
    ----------
    record : Record
        The log; its drive and sensors count, not what they show.
    parameters : EhaParameters
        The actuator.

    Returns
    -------
    float
        Relative Cramér-Rao bound of bulk modulus [fraction].
    """
    model = FORMS["pressure"]
    channels = available_channels(model, record)
    prior = first_belief(model, record, parameters.bulk_modulus, START_STD)
    variances = measurement_variances(record, channels)
    std = bulk_modulus_bound(model, prior, record, parameters, channels=channels, variances=variances)
    return std / parameters.bulk_modulus


def _unseen(bound: float) -> BulkModulusEstimate:
    return BulkModulusEstimate(
        outcome=Outcome.NOT_OBSERVABLE,
        value=None,
        std=None,
        bound=bound,
        gate=Gate(False, (too_wide(bound),)),
        form="motion",
        channels=MOTION_CHANNELS,
        nis={},
        others={},
        estimate=None,
        first_pass=None,
    )


def _with_rig(found: BulkModulusEstimate, uncertainties: Mapping[str, float]) -> BulkModulusEstimate:
    """Return a filter's estimate with the chamber volume's uncertainty in its deviation (equation 5.8)."""
    if found.value is None or found.std is None:
        return found
    rig_std = found.value * uncertainties.get("chamber_volume", 0.0)
    return replace(found, std=float(np.hypot(found.std, rig_std)), rig_std=rig_std)


def _fitted(fit: FormFit, form: str, channels: tuple[str, ...]) -> BulkModulusEstimate:
    value, std = fit.parameters["bulk_modulus"]
    rig_std = fit.rig_std["bulk_modulus"]
    gate = Gate(not fit.reasons, fit.reasons)
    outcome = Outcome.OK
    if fit.chi_square >= MISMATCH_NIS:
        outcome = Outcome.MISMATCH
    elif fit.bound > LARGEST_BOUND:
        outcome, gate = Outcome.NOT_OBSERVABLE, Gate(False, (too_wide(fit.bound), *fit.reasons))
    known = outcome is Outcome.OK
    return BulkModulusEstimate(
        outcome=outcome,
        value=value if known else None,
        std=float(np.hypot(std, rig_std)) if known else None,
        bound=fit.bound,
        gate=gate,
        form=form,
        channels=channels,
        nis={channels[-1]: fit.chi_square},
        others={name: found for name, found in fit.parameters.items() if known and name in REPORTED},
        estimate=None,
        first_pass=None,
        rig_std=rig_std if known else 0.0,
    )


def _chosen(registry: Mapping[str, T], name: str, what: str) -> T:
    if name not in registry:
        raise HydrostateError(f"{what} must be one of {', '.join(registry)}, got {name!r}")
    return registry[name]
