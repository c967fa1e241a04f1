"""`estimate_bulk_modulus(record, parameters)`: a number, an interval, a verdict; or a sentence instead of a number."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import TypeVar

import numpy as np

from estimation.bounds import at_bulk_modulus, bulk_modulus_bound
from estimation.consistency import MISMATCH_NIS, Gate, consistency_gate, describes
from estimation.eha import BULK_MODULUS, FORMS
from estimation.filter import Method
from estimation.flow_fit import FLOW_CHANNELS, REPORTED, FlowFit, fit_flow
from estimation.gaussian import Gaussian
from estimation.measurement_noise import measurement_variances
from estimation.model import ProcessModel
from estimation.run import METHODS, Estimate, available_channels, run_filter
from plant.eha import EhaParameters
from plant.errors import HydrostateError
from plant.record import Record

T = TypeVar("T")

LARGEST_BOUND = 0.03
"""Relative Cramér-Rao bound above which bulk modulus is called not observable (errata E13) [fraction]."""

PRESSURE_NOISE_LOGGED = 3e8
"""Process-noise density of differential pressure where it is logged [Pa^2/s]. It stands for the flows that a lumped
model leaves out (make-up, changing volumes); without the sensor the model's own, small one holds the pressure."""

START_STD = 3e8
"""Standard deviation of the first guess [Pa]: convergence is driven by it (errata E10)."""

NORMAL_95 = 1.959963984540054
"""Half-width of a 95 % normal interval, in standard deviations."""


class Outcome(StrEnum):
    """How a log fared; the words that JSON prints."""

    OK = "ok"
    NOT_OBSERVABLE = "not_observable"
    MISMATCH = "mismatch"
    DIVERGED = "diverged"
    FAILED = "failed"


OUTCOMES: Mapping[Outcome, str] = {
    Outcome.OK: "The result stands, with the interval and the gate's verdict beside it.",
    Outcome.NOT_OBSERVABLE: (
        "This drive and these sensors hold too little about bulk modulus: the Cramér-Rao bound is over 3 %. "
        "Log differential pressure, or drive with larger, slower steps."
    ),
    Outcome.MISMATCH: (
        "The log is nothing like what the model does, so no number is given: the residuals are ten times larger than "
        "expected or more, or the estimate ran into its physical bound. Check units, rig and condition; log pressure."
    ),
    Outcome.DIVERGED: "The estimate stopped being finite; check units, rig parameters and the form.",
    Outcome.FAILED: "The log could not be read or used; the message says why.",
}
"""What each outcome means, as a sentence for a reader."""


@dataclass(frozen=True, eq=False)
class BulkModulusEstimate:
    """Effective bulk modulus of a log.

    Parameters
    ----------
    outcome : Outcome
        How it went.
    value : float or None
        Effective bulk modulus, convention of equation 5.8 (errata E2) [Pa]; None unless the outcome is ok.
    std : float or None
        Its standard deviation [Pa].
    bound : float
        Relative Cramér-Rao bound [fraction].
    gate : Gate
        Whether value and interval can be believed.
    form : str
        What was believed of the actuator: ``flow``, ``pressure`` or ``acceleration``.
    channels : tuple of str
        Channels that were used beside motor speed.
    nis : Mapping[str, float]
        Mean squared normalised residual of each predicted channel; 1 where the model explains the log [dimensionless].
    others : Mapping[str, tuple of float]
        What was estimated along with it: value and standard deviation in SI, by parameter name.
    estimate : Estimate or None
        The filtered log, where a filter was used.
    first_pass : Estimate or None
        The pass that began at the first guess; the same one unless a second, begun where it ended, was likelier.
    """

    outcome: Outcome
    value: float | None
    std: float | None
    bound: float
    gate: Gate
    form: str
    channels: tuple[str, ...]
    nis: Mapping[str, float]
    others: Mapping[str, tuple[float, float]]
    estimate: Estimate | None
    first_pass: Estimate | None

    @property
    def interval(self) -> tuple[float, float] | None:
        """The 95 % interval [Pa], or None where there is no value."""
        if self.value is None or self.std is None:
            return None
        return self.value - NORMAL_95 * self.std, self.value + NORMAL_95 * self.std


def first_belief(model: ProcessModel, record: Record, start: float, start_std: float) -> Gaussian:
    """Return the belief before the first sample: at the first position, at rest, at the guessed bulk modulus.

    Parameters
    ----------
    model : ProcessModel
        The process model.
    record : Record
        The log.
    start : float
        First guess of effective bulk modulus [Pa].
    start_std : float
        Its standard deviation [Pa].

    Returns
    -------
    Gaussian
        The prior.
    """
    firsts = {"position_m": _first(record, "position_m"), BULK_MODULUS: start}
    firsts["differential_pressure_pa"] = _first(record, "differential_pressure_pa")
    spreads = {
        "position_m": 1e-5,
        "velocity_m_s": 1e-3,
        "acceleration_m_s2": 10.0,
        "differential_pressure_pa": 1e5,
        BULK_MODULUS: start_std,
    }
    mean = np.array([firsts.get(state.name, 0.0) for state in model.states])
    return Gaussian(mean, np.diag([spreads[state.name] ** 2 for state in model.states]))


def _first(record: Record, channel: str) -> float:
    if channel not in record:
        return 0.0
    present = record[channel][np.isfinite(record[channel])]
    return float(present[0]) if len(present) else 0.0


def estimate_bulk_modulus(
    record: Record,
    parameters: EhaParameters,
    *,
    form: str = "auto",
    method: str = "ekf",
    start: float | None = None,
    start_std: float = START_STD,
) -> BulkModulusEstimate:
    """Estimate effective bulk modulus from a log.

    With position and ``differential_pressure_pa`` logged, the flow form fits it with leakage and flow bias, and
    friction plays no part (`estimation.flow`). Without, a filter takes leakage and friction as known and the estimate
    rests on how the piston starts, stops and rings; where it sticks there is nothing to rest on, and the outcome says
    so instead of printing a number (errata E13).

    Parameters
    ----------
    record : Record
        The log.
    parameters : EhaParameters
        The actuator; its bulk modulus is where the bound is taken, and the default first guess.
    form : str
        ``"flow"``, ``"pressure"``, ``"acceleration"`` (the published one, valid between reversals only, errata E9), or
        ``"auto"``: flow where its channels are logged, else pressure.
    method : str
        A filter of `estimation.run.METHODS`, for the forms that are filtered.
    start : float, optional
        First guess [Pa].
    start_std : float
        Its standard deviation, for the forms that are filtered [Pa].

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
    if form == "flow" or (form == "auto" and all(channel in record for channel in FLOW_CHANNELS)):
        return _flow_estimate(fit_flow(record, parameters, guess))
    model = _chosen(FORMS, "pressure" if form == "auto" else form, "form")
    return _filter_estimate(record, parameters, model, _chosen(METHODS, method, "method"), guess, start_std)


def _flow_estimate(fit: FlowFit) -> BulkModulusEstimate:
    value, std = fit.parameters["bulk_modulus"]
    gate = Gate(not fit.reasons, fit.reasons)
    outcome = Outcome.OK
    if fit.bound > LARGEST_BOUND:
        outcome, gate = Outcome.NOT_OBSERVABLE, Gate(False, (_too_wide(fit.bound),))
    elif fit.chi_square >= MISMATCH_NIS:
        outcome = Outcome.MISMATCH
    known = outcome is Outcome.OK
    return BulkModulusEstimate(
        outcome=outcome,
        value=value if known else None,
        std=std if known else None,
        bound=fit.bound,
        gate=gate,
        form="flow",
        channels=FLOW_CHANNELS,
        nis={"differential_pressure_pa": fit.chi_square},
        others={name: found for name, found in fit.parameters.items() if known and name in REPORTED},
        estimate=None,
        first_pass=None,
    )


def _too_wide(bound: float) -> str:
    return f"the Cramér-Rao bound is {100.0 * min(bound, 9.99):.0f} % of the value, over 3 %: not observable"


def _filter_estimate(
    record: Record, parameters: EhaParameters, model: ProcessModel, method: Method, guess: float, start_std: float
) -> BulkModulusEstimate:
    channels = available_channels(model, record)
    variances = measurement_variances(record, channels)
    noise = {"differential_pressure_pa": PRESSURE_NOISE_LOGGED} if "differential_pressure_pa" in channels else {}

    def filtered(first_guess: float) -> Estimate:
        prior = first_belief(model, record, first_guess, start_std)
        return run_filter(method, model, prior, record, parameters, channels=channels, variances=variances, noise=noise)

    def bound_at(bulk_modulus: float) -> float:
        prior = first_belief(model, record, bulk_modulus, start_std)
        actuator = at_bulk_modulus(parameters, bulk_modulus)
        std = bulk_modulus_bound(model, prior, record, actuator, channels=channels, variances=variances, noise=noise)
        return std / bulk_modulus

    estimate, first = _settled(filtered, guess)
    value, std = estimate.settled(BULK_MODULUS)
    nominal = parameters.bulk_modulus
    finite = bool(np.isfinite(value) and np.isfinite(std))
    bound = max(bound_at(nominal), bound_at(max(value, 1e-3 * nominal))) if finite else float("inf")
    outcome, gate = _verdict(estimate, finite, bound)
    known = outcome is Outcome.OK
    return BulkModulusEstimate(
        outcome=outcome,
        value=value if known else None,
        std=std if known else None,
        bound=bound,
        gate=gate,
        form=model.name,
        channels=channels,
        nis=estimate.nis,
        others={},
        estimate=estimate,
        first_pass=first,
    )


def _verdict(estimate: Estimate, finite: bool, bound: float) -> tuple[Outcome, Gate]:
    if not finite:
        return Outcome.DIVERGED, Gate(False, (OUTCOMES[Outcome.DIVERGED],))
    if bound > LARGEST_BOUND:
        return Outcome.NOT_OBSERVABLE, Gate(False, (_too_wide(bound),))
    gate = consistency_gate(estimate, BULK_MODULUS)
    return (Outcome.OK if describes(estimate, BULK_MODULUS) else Outcome.MISMATCH), gate


def _settled(filtered: Callable[[float], Estimate], guess: float) -> tuple[Estimate, Estimate]:
    """Filter from the first guess; where it was far too low or the gate objects, again from where that ended.

    A first guess far below the truth predicts no motion at all, and the filter may then spend its prior on the wrong
    side, unnoticed by the gate. The second pass begins near the answer with the same wide prior; the likelier is
    returned, and with it the first pass.
    """
    first = filtered(guess)
    value, _ = first.settled(BULK_MODULUS)
    near = guess >= 0.5 * value and consistency_gate(first, BULK_MODULUS).passed
    if near or not np.isfinite(value):
        return first, first
    second = filtered(max(value, 0.0))
    return (second if second.log_likelihood > first.log_likelihood else first), first


def _chosen(registry: Mapping[str, T], name: str, what: str) -> T:
    if name not in registry:
        raise HydrostateError(f"{what} must be one of {', '.join(registry)}, got {name!r}")
    return registry[name]
