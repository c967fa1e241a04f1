"""Bulk modulus by a filter; leakage and friction are given, or estimated with it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from estimation.eha.by_flow_filter import filter_flow
from estimation.eha.named_methods import NAMED, NamedMethod
from estimation.eha.result import LARGEST_BOUND, BulkModulusEstimate, wide_bound_note
from estimation.filters.iterated_smoother import LONGEST
from estimation.filters.methods import METHODS
from estimation.filters.run import Estimate, available_channels, run_filter
from estimation.finding import Gate, Outcome
from estimation.log_checks.channel_names import POSITION, PRESSURE
from estimation.log_checks.clean import CleanLog
from estimation.log_checks.first_belief import PRESSURE_NOISE_LOGGED, first_belief
from estimation.log_checks.told_once import with_repeats_used_once
from estimation.models.augment import AUGMENTABLE, augmented, augmented_prior
from estimation.models.eha_forms import BULK_MODULUS
from estimation.models.model import ProcessModel
from estimation.notes import EstimateCode
from estimation.trust.bounds import at_bulk_modulus, bulk_modulus_bound
from estimation.trust.consistency import consistency_gate, describes_log
from estimation.tuning.tuning import Tuning, tune
from plant.eha.model import EhaParameters
from plant.errors import HydrostateError, require_known
from plant.log.record import Record

GROUPS: Mapping[str, tuple[str, ...]] = {
    "leakage": ("leakage_coefficient", "flow_bias"),
    "friction": ("friction_quadratic", "friction_linear", "friction_coulomb"),
    "air": ("air_fraction",),
}
"""Short names for groups of states."""

WALK = 0.05
"""Random walk of a further state, so that it can follow a change: of its logarithm, per second [1/s^(1/2)]."""


STEPS_A_SAMPLE = 8
"""Least model steps per sample if noise levels are tuned: the interval is then so narrow that errors of the steps
matter. On our lumped plant at 5 kHz four steps per sample had an error of 0.0007 %, eight 0.0002 %."""

SHORTEST_STEP = 2.5e-5
"""Step that is not shortened further for it, that of the lumped plant [s]: at 10 kHz one step of 0.1 ms per sample had
an error of 0.01 %, two 0.003 %, four less than 0.0005 %."""


@dataclass(frozen=True)
class FilterOptions:
    """Options of a filter.

    Parameters
    ----------
    method : str
        A filter of `estimation.filters.methods.METHODS`, a method of `estimation.eha.named_methods.NAMED`, or
        ``"auto"``: see `chosen_method`.
    states : tuple of str
        States estimated beside bulk modulus: of `AUGMENTABLE`, or of `GROUPS`.
    tuned : bool
        Whether the noise levels are tuned to the log by likelihood.
    robust : str
        How gross outliers count, see `estimation.filters.run.ROBUST`.
    """

    method: str = "auto"
    states: tuple[str, ...] = ()
    tuned: bool = False
    robust: str = "none"

    @property
    def names(self) -> tuple[str, ...]:
        """The further states, with groups spelt out."""
        for name in self.states:
            require_known("a further state", name, (*GROUPS, *AUGMENTABLE))
        return tuple(dict.fromkeys(one for name in self.states for one in GROUPS.get(name, (name,))))


def estimate_by_filter(
    log: CleanLog,
    parameters: EhaParameters,
    model: ProcessModel,
    guess: float,
    start_std: float,
    options: FilterOptions,
) -> BulkModulusEstimate:
    """Estimate bulk modulus, and further states if wanted, with one filter on one process model.

    Parameters
    ----------
    parameters : EhaParameters
        The actuator, with first guesses of the estimated parameters.
    guess, start_std : float
        First guess of bulk modulus and its standard deviation [Pa].
    options : FilterOptions
        Options of the filter.

    Returns
    -------
    BulkModulusEstimate
        Value, interval, bound and verdict. The value is the mean over the last 20 % of the log, or, if noise levels are
        tuned, that after the last sample.

    Raises
    ------
    HydrostateError
        If a name in the options is unknown.
    """
    require_known("method", options.method, ["auto", *METHODS, *NAMED])
    record = log.record
    if options.tuned:  # the noise levels used without tuning are large enough for an encoder at rest
        record = with_repeats_used_once(record)
        longest = max(record.sample_time / STEPS_A_SAMPLE, SHORTEST_STEP)
        model = replace(model, longest_step=min(model.longest_step, longest))
    named = NAMED.get(options.method, NamedMethod(model.name, options.method))
    method = named.method if named.method != "auto" else chosen_method(record, model, options.tuned)
    names = options.names
    wide = augmented(model, names, dict.fromkeys(names, WALK**2))
    channels = available_channels(model, record)
    known: dict[str, Any] = {
        "channels": channels,
        "variances": {**log.variances, **named.variances},
        "noise": {**({PRESSURE: PRESSURE_NOISE_LOGGED} if PRESSURE in channels else {}), **named.noise},
    }
    found: Tuning | None = None
    if options.tuned:
        prior = first_belief(model, record, guess, start_std)
        found = tune(log.record, model, prior, parameters, **known, received=record)
        known |= {"variances": found.tuned.variances, "noise": found.tuned.noise}
        guess = float(found.prior.mean[model.index(BULK_MODULUS)])

    def filtered(first_guess: float) -> Estimate:
        prior = augmented_prior(wide, first_belief(model, record, first_guess, start_std), parameters)
        robust = options.robust
        return run_filter(
            METHODS[method], wide, prior, record, parameters, **known, robust=robust, keep_innovations=True
        )

    def bound_at(bulk_modulus: float) -> float:
        prior = first_belief(model, record, bulk_modulus, start_std)
        return (
            bulk_modulus_bound(model, prior, record, at_bulk_modulus(parameters, bulk_modulus), **known) / bulk_modulus
        )

    estimate, first = _settled_run(filtered, guess)
    value, _ = estimate.settled(BULK_MODULUS)
    nominal = parameters.bulk_modulus
    bound = max(bound_at(nominal), bound_at(max(value, 1e-3 * nominal))) if np.isfinite(value) else float("inf")
    # a tuned interval is as narrow as the belief after the last sample; the mean over the end scatters by 4 % more
    share = 0.5 / len(estimate.mean) if options.tuned else 0.2
    concluded = conclude(estimate, log.record, bound, model.name, names, fraction=share)
    return replace(concluded, first_pass=first, tuning=found, method=options.method if named.noise else method)


def chosen_method(record: Record, model: ProcessModel, tuned: bool) -> str:
    """Return the filter that suits a log best.

    Parameters
    ----------
    tuned : bool
        Whether its noise levels are tuned to the log.

    Returns
    -------
    str
        ``iterated-smoother`` if pressure is a state that is not logged: a filter may then diverge unnoticed while the
        piston sticks. It presumes the right noise levels, so ``ekf`` if they are not tuned, and for logs too long to be
        held in memory.
    """
    unseen = PRESSURE in [state.name for state in model.states] and PRESSURE not in record
    return "iterated-smoother" if tuned and unseen and len(record) <= LONGEST else "ekf"


def estimate_by_flow_filter(
    log: CleanLog, parameters: EhaParameters, options: FilterOptions, guess: float | None = None
) -> BulkModulusEstimate:
    """Estimate bulk modulus, leakage and flow bias with a bank of modelled-chamber filters.

    Parameters
    ----------
    log : CleanLog
        The log, with position and differential pressure.
    parameters : EhaParameters
        Geometry and pump, and the size of the first guesses.
    options : FilterOptions
        The method must be ``chamber-ekf``, ``ekf`` or ``auto``; there are no other options.
    guess : float, optional
        First guess of bulk modulus [Pa]; the actuator's if not given.

    Raises
    ------
    HydrostateError
        If something else is chosen.
    """
    asked = {
        "tuning": options.tuned,
        f"robust {options.robust}": options.robust != "none",
        f"method {options.method}": options.method not in ("auto", "ekf", "chamber-ekf"),
        f"states {', '.join(options.states)}": any(name != "leakage" for name in options.states),
    }
    if unfit := [name for name, here in asked.items() if here]:
        raise HydrostateError(
            "the flow form is filtered by a bank of ekf, which finds leakage along with bulk modulus; it takes no "
            f"other method or state, no tuning and no robust update, got {'; '.join(unfit)}"
        )
    estimate, again = filter_flow(log.record, parameters, variances=log.variances, guess=guess)
    last = 0.5 / len(estimate.mean)
    value, std = estimate.settled(BULK_MODULUS, last)
    bound = std / value if np.isfinite(value) and value > 0.0 else float("inf")
    names = ("leakage_coefficient", "flow_bias")
    found = conclude(estimate, log.record, bound, "flow", names, fraction=last, judged=again)
    return replace(found, method="chamber-ekf")


def conclude(
    estimate: Estimate,
    record: Record,
    bound: float,
    form: str,
    names: tuple[str, ...],
    fraction: float = 0.2,
    judged: Estimate | None = None,
) -> BulkModulusEstimate:
    """Judge a filtered log and return the result.

    Parameters
    ----------
    bound : float
        Relative Cramér-Rao bound of bulk modulus [fraction].
    form : str
        The process model.
    names : tuple of str
        Further states that are reported.
    fraction : float
        Share of the log, at its end, over which values are averaged [fraction].
    judged : Estimate, optional
        The reading of the log that must pass the gate; the same if not given.
    """
    value, std = estimate.settled(BULK_MODULUS, fraction)
    finite = bool(np.isfinite(value) and np.isfinite(std))
    outcome, gate = _verdict(estimate if judged is None else judged, record, finite, bound)
    known = outcome is Outcome.OK
    return BulkModulusEstimate(
        outcome=outcome,
        value=value if known else None,
        std=gate.inflation * std if known else None,
        bound=bound,
        gate=gate,
        form=form,
        channels=estimate.channels if form != "flow" else (POSITION, *estimate.channels),
        nis=estimate.nis,
        others={name: estimate.settled(name, fraction) for name in names if known},
        estimate=estimate,
        first_pass=estimate,
    )


def _verdict(estimate: Estimate, record: Record, finite: bool, bound: float) -> tuple[Outcome, Gate]:
    if not finite:
        return Outcome.DIVERGED, Gate(False, (EstimateCode.DIVERGED.note(),))
    if bound > LARGEST_BOUND:
        return Outcome.NOT_OBSERVABLE, Gate(False, (wide_bound_note(bound),))
    gate = consistency_gate(estimate, BULK_MODULUS, record if len(estimate.residuals) else None)
    return (Outcome.OK if describes_log(estimate, BULK_MODULUS) else Outcome.MISMATCH), gate


def _settled_run(filtered: Callable[[float], Estimate], guess: float) -> tuple[Estimate, Estimate]:
    """Filter from the first guess; if that was far too low or the gate objects, again from where the filter ended.

    A first guess far below the truth predicts no motion at all, and the filter may then use up its prior on the wrong
    side, unnoticed by the gate. The second pass begins near the answer with the same wide prior. The likelier pass is
    returned with the first one.
    """
    first = filtered(guess)
    value, _ = first.settled(BULK_MODULUS)
    near = guess >= 0.5 * value and consistency_gate(first, BULK_MODULUS).passed
    if near or not np.isfinite(value):
        return first, first
    second = filtered(max(value, 0.0))
    return (second if second.log_likelihood > first.log_likelihood else first), first
