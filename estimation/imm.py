"""The interacting multiple model filter: several beliefs about how the plant behaves, mixed at every sample.

Source: Blom and Bar-Shalom (1988); Bar-Shalom, Li and Kirubarajan (2001), section 11.6.6, steps 1 to 5. A mode is any
`Rule` on any model with any parameters, as long as the states are the same ones. Probabilities are logarithms from end
to end and are summed by their largest: nothing underflows, and nothing is floored. A mode that stops being finite has
no probability, and starts again from the others at the next sample.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import log

import numpy as np
from numpy.typing import NDArray

from estimation.algebra import EKF, Rule
from estimation.compiled import constant_row
from estimation.filter import FilterProblem, empty_trace
from estimation.gaussian import Gaussian
from estimation.imm_kernel import compile_imm
from estimation.model import ProcessModel
from estimation.run import Estimate, filter_problem, in_si
from plant.eha import EhaParameters
from plant.errors import HydrostateError
from plant.record import Record

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Mode:
    """One way that the plant may behave.

    Parameters
    ----------
    name : str
        Its name.
    model : ProcessModel
        How the state moves in it.
    parameters : EhaParameters
        The actuator in it.
    rule : Rule
        The filter that runs it.
    settings : Mapping[str, float]
        The rule's settings with their values, in the rule's order [each in its own unit].
    noise : Mapping[str, float] or None
        Process-noise densities that replace the model's [SI squared a second], by state name.
    """

    name: str
    model: ProcessModel
    parameters: EhaParameters
    rule: Rule = EKF
    settings: Mapping[str, float] = field(default_factory=dict[str, float])
    noise: Mapping[str, float] | None = None


@dataclass(frozen=True, eq=False)
class MultipleModelEstimate:
    """A log filtered by several models.

    Parameters
    ----------
    names : tuple of str
        Of the modes.
    estimate : Estimate
        The mixture: its mean and variance along the track, its innovations and likelihood.
    log_probability : ndarray, shape (rows, modes)
        Natural logarithm of each mode's probability along the track [dimensionless].
    """

    names: tuple[str, ...]
    estimate: Estimate
    log_probability: Array

    @property
    def probability(self) -> Array:
        """Probability of each mode along the track, shape (rows, modes) [probability]."""
        return np.exp(self.log_probability)


def log_transitions(dwell_times: Sequence[float], sample_time: float) -> Array:
    """Return the log of a transition matrix in which each mode lasts some time on average and leads to all others.

    A mode's stay is geometric: it ends at a sample with probability ``sample_time / dwell_time``.

    Parameters
    ----------
    dwell_times : sequence of float
        Mean time that each mode lasts [s]; infinite for one that never ends.
    sample_time : float
        Time between samples [s].

    Returns
    -------
    ndarray, shape (modes, modes)
        From row to column [dimensionless].

    Raises
    ------
    HydrostateError
        If a mode lasts no longer than a sample.

    Examples
    --------
    >>> np.exp(log_transitions([1.0, 0.5], 0.1)).round(3).tolist()
    [[0.9, 0.1], [0.2, 0.8]]
    """
    count = len(dwell_times)
    result = np.empty((count, count))
    for i, dwell_time in enumerate(dwell_times):
        if not dwell_time > sample_time:
            raise HydrostateError(f"a mode must last longer than a sample ({sample_time} s), got {dwell_time} s")
        leaving = sample_time / dwell_time if count > 1 else 0.0
        result[i] = log(leaving / (count - 1)) if leaving > 0.0 else -np.inf
        result[i, i] = np.log1p(-leaving)
    return result


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
    """Filter a record by several models that take turns.

    Parameters
    ----------
    modes : sequence of Mode
        The ways that the plant may behave.
    prior : Gaussian
        Belief before the first sample, in SI, the same in every mode.
    record : Record
        The log.
    dwell_time : float or sequence of float
        Mean time that a mode lasts, one for all or one each [s].
    probabilities : sequence of float, optional
        Of the modes before the first sample [probability]; equal by default.
    channels : tuple of str, optional
        Channels to use, as in `estimation.run.run_filter`.
    variances : Mapping[str, float], optional
        Measurement variances [SI squared]; by default read off the log.
    keep_innovations : bool
        Whether every innovation of the mixture is kept.

    Returns
    -------
    MultipleModelEstimate
        The mixture, and how probable each mode was.

    Raises
    ------
    HydrostateError
        If there is no mode, the modes differ in their states or in the step that they need, or a dwell time or a
        probability is none.
    """
    _require_alike(modes)
    first = filter_problem(
        modes[0].model, prior, record, modes[0].parameters, channels=channels, variances=variances, noise=modes[0].noise
    )
    spread = dict(zip(first.channels, first.variances.tolist(), strict=True))
    problems = [
        filter_problem(
            mode.model, prior, record, mode.parameters, channels=channels, variances=spread, noise=mode.noise
        )
        for mode in modes
    ]
    if len({(problem.channels, problem.substeps) for problem in problems}) > 1:
        raise HydrostateError("modes of one bank must predict the same channels and need the same count of sub-steps")
    first = replace(first, keep_innovations=keep_innovations)
    dwell_times = [dwell_time] * len(modes) if isinstance(dwell_time, (int, float)) else list(dwell_time)
    start = _log_start(probabilities, len(modes))
    if len(dwell_times) != len(modes):
        raise HydrostateError(f"{len(modes)} modes need as many dwell times, got {len(dwell_times)}")
    return _run(modes, first, problems, log_transitions(dwell_times, record.sample_time), start, record.start_time)


def _run(
    modes: Sequence[Mode],
    first: FilterProblem,
    problems: Sequence[FilterProblem],
    transitions: Array,
    log_probability: Array,
    start_time: float,
) -> MultipleModelEstimate:
    each = [(mode.rule, problem.model) for mode, problem in zip(modes, problems, strict=True)]
    kinds = tuple(dict.fromkeys(each))
    kernel = compile_imm(kinds, first.channels)
    rows = [constant_row(problem, dict(mode.settings)) for mode, problem in zip(modes, problems, strict=True)]
    packed = np.concatenate([first.mean, first.covariance[np.triu_indices(first.model.width)]])
    states = np.zeros((len(modes), kernel.carried))
    states[:, : len(packed)] = packed
    trace, history = empty_trace(first), np.empty((len(empty_trace(first).track), len(modes)))
    log_likelihood = kernel.run(
        states,
        _padded(rows),
        np.array([kinds.index(kind) for kind in each]),
        transitions,
        log_probability,
        first.drives,
        first.measured,
        first.substeps,
        first.every,
        trace.track,
        trace.track_variance,
        history,
        trace.mean,
        trace.covariance,
        trace.nis,
        trace.count,
        trace.residuals,
        trace.residual_variances,
    )
    estimate = in_si(first, replace(trace, log_likelihood=log_likelihood), start_time)
    return MultipleModelEstimate(tuple(mode.name for mode in modes), estimate, history)


def _padded(rows: Sequence[Array]) -> Array:
    result = np.zeros((len(rows), max(len(row) for row in rows)))
    for i, row in enumerate(rows):
        result[i, : len(row)] = row
    return result


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
    with np.errstate(divide="ignore"):  # an impossible mode has the logarithm of nothing
        return np.log(values)
