"""Filters a record by several models that take turns, to test the bank with modes of any kind."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from estimation.arrays import Array
from estimation.engine.rule import Rule
from estimation.filters.ekf import EKF
from estimation.filters.imm import interacting, log_transitions
from estimation.filters.run import Estimate, available_channels, filter_problem, in_si
from estimation.log_checks.measurement_noise import measurement_variances
from estimation.models.gaussian import Gaussian
from estimation.models.model import ProcessModel
from plant.errors import HydrostateError
from plant.log.record import Record
from plant.solvers.steps import Parameters


@dataclass(frozen=True, eq=False)
class Mode:
    """One possible behaviour of the plant."""

    name: str
    model: ProcessModel
    parameters: Parameters
    rule: Rule = EKF
    settings: Mapping[str, float] = field(default_factory=dict[str, float])
    noise: Mapping[str, float] | None = None


@dataclass(frozen=True, eq=False)
class MultipleModelEstimate:
    """A log filtered by several models."""

    names: tuple[str, ...]
    estimate: Estimate
    log_probability: Array

    @property
    def probability(self) -> Array:
        """Probability of each mode along the track, shape (rows, modes) [probability]."""
        return np.exp(self.log_probability)


def run_imm(
    modes: Sequence[Mode],
    prior: Gaussian,
    record: Record,
    *,
    dwell_time: float | Sequence[float],
    probabilities: Sequence[float] | None = None,
    channels: tuple[str, ...] | None = None,
    variances: Mapping[str, float] | None = None,
    keep_innovations: bool = False,
) -> MultipleModelEstimate:
    """Filter a record by several models that take turns."""
    _require_alike(modes)
    used = available_channels(modes[0].model, record) if channels is None else channels
    spread = measurement_variances(record, used) if variances is None else variances
    problems = [
        filter_problem(
            mode.model, prior, record, mode.parameters, channels=channels, variances=spread, noise=mode.noise
        )
        for mode in modes
    ]
    if len({(problem.channels, problem.substeps) for problem in problems}) > 1:
        raise HydrostateError("modes of one bank must predict the same channels and need the same count of sub-steps")
    dwell_times = [dwell_time] * len(modes) if isinstance(dwell_time, (int, float)) else list(dwell_time)
    start = _log_start(probabilities, len(modes))
    if len(dwell_times) != len(modes):
        raise HydrostateError(f"{len(modes)} modes need as many dwell times, got {len(dwell_times)}")
    first = replace(problems[0], keep_innovations=keep_innovations)
    bank = [
        (mode.rule, replace(problem, settings=mode.settings))
        for mode, problem in zip(modes, (first, *problems[1:]), strict=True)
    ]
    trace, history = interacting(bank, log_transitions(dwell_times, record.sample_time), start)
    return MultipleModelEstimate(tuple(mode.name for mode in modes), in_si(first, trace, record.start_time), history)


def _require_alike(modes: Sequence[Mode]) -> None:
    if not modes:
        raise HydrostateError("a bank needs at least one mode, got none")
    first = modes[0].model
    for mode in modes:
        for a, b in zip(first.states, mode.model.states, strict=False):
            if (a.name, a.scale, a.logarithmic) != (b.name, b.scale, b.logarithmic):
                raise HydrostateError(f"modes must have the same states, got {a.name} and {b.name} in {mode.name}")
        if (mode.model.width, mode.model.drives) != (first.width, first.drives):
            raise HydrostateError(f"modes must have the same states and drives, {mode.name} differs")


def _log_start(probabilities: Sequence[float] | None, count: int) -> Array:
    values = np.full(count, 1.0 / count) if probabilities is None else np.array(probabilities, dtype=np.float64)
    if len(values) != count or np.any(values < 0.0) or not abs(float(np.sum(values)) - 1.0) < 1e-9:
        raise HydrostateError(f"{count} modes need as many probabilities that sum to 1, got {values.tolist()}")
    with np.errstate(divide="ignore"):  # the log probability of an impossible mode is -inf
        return np.log(values)
