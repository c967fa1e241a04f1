"""Faults inside a piezo-stack actuator from a log of its bench: output error by least squares.

The drive is known, so the whole run is simulated and fitted to all channels at once, each weighted by its noise. The
run must begin at rest at the bias pressure.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass
from math import sqrt
from types import MappingProxyType, SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from estimation.arrays import Array
from estimation.finding import interval_95
from estimation.piezo_stack.channel_mistakes import channel_mistakes
from estimation.piezo_stack.runs import COARSE_SLOPE_STEP, COARSE_STEP, STACK_CHANNELS, StackRuns, prepared_runs
from estimation.piezo_stack.unknowns import DEFAULT_UNKNOWNS, STARTS, UNKNOWNS, reported_value
from plant.errors import LogError
from plant.log.record import Record
from plant.piezo_stack.parameters import LONGEST_STEP, PiezoStackParameters
from plant.piezo_stack.run import BENCH_SENSORS, checked_voltage


@dataclass(frozen=True)
class StackEstimate:
    """Estimate from a log of the piezo-stack actuator.

    Parameters
    ----------
    values : Mapping[str, float]
        Estimates by name [SI]; polarisation as a factor.
    deviations : Mapping[str, float]
        Standard deviations by name [SI], widened if the residuals are larger than the noise.
    correlations : ndarray, shape (unknowns, unknowns)
        Correlations of the scaled estimates.
    misfit : Mapping[str, float]
        Root mean square of each channel's residual over its noise; 1 for the right model [dimensionless].
    parameters : PiezoStackParameters or namespace
        The actuator with the estimates.
    samples : int
        Samples of each channel [count].
    delay : float
        Delay of all channels behind the drive that is left in the residuals, to first order [s].
    """

    values: Mapping[str, float]
    deviations: Mapping[str, float]
    correlations: Array
    misfit: Mapping[str, float]
    evaluations: int
    parameters: PiezoStackParameters | SimpleNamespace
    samples: int
    delay: float

    def interval(self, name: str) -> tuple[float, float]:
        """Return a quantity's 95 % interval.

        Returns
        -------
        tuple of float
            Lower and upper end [SI].
        """
        return interval_95(self.values[name], self.deviations[name])


def estimate_stack(
    record: Record,
    healthy: PiezoStackParameters,
    *,
    unknowns: Collection[str] = DEFAULT_UNKNOWNS,
    channels: Collection[str] = STACK_CHANNELS,
    starts: Sequence[Mapping[str, float]] = STARTS,
) -> StackEstimate:
    """Estimate the faults inside the actuator from a run that began at rest.

    Parameters
    ----------
    record : Record
        ``drive_voltage_v`` and one or more of `STACK_CHANNELS`.
    healthy : PiezoStackParameters
        The healthy actuator, at the run's bias pressure and load.
    unknowns : collection of str
        Quantities to estimate, from `UNKNOWNS`.
    channels : collection of str
        Channels to use, of those that are logged.
    starts : sequence of Mapping[str, float]
        First guesses, scaled as in `UNKNOWNS` [dimensionless].

    Raises
    ------
    LogError
        If the drive or every channel is missing, or samples are, or a channel has another sign, unit or name.
    HydrostateError
        If an unknown is not known, or no first guess is made of them.
    """
    runs = prepared_runs(record, healthy, tuple(unknowns), channels)
    part = runs.beginning(max(round(_COARSE_SECONDS / runs.sample_time), round(_COARSE_SHARE * len(runs.voltage))))
    first, *others = _first_guesses(part, starts)[:_MOST_GUESSES]
    theta, lowest = _optimum_in_coarse_runs(part, first)
    best = _optimum_in_exact_runs(runs, theta)
    for guess in others:
        if best.spread < _UNEXPLAINED:
            break
        theta, left = _optimum_in_coarse_runs(part, guess)
        if left < lowest:
            lowest, best = left, min(best, _optimum_in_exact_runs(runs, theta), key=_cost)
    if _UNEXPLAINED <= best.spread < _HOPELESS:  # slow effects show only in the whole log
        theta, _ = _optimum_in_coarse_runs(runs, best.theta)
        best = min(best, _optimum_in_exact_runs(runs, theta), key=_cost)
    return _concluded_estimate(runs, best, runs.count + part.count)


def _first_guesses(runs: StackRuns, starts: Sequence[Mapping[str, float]]) -> list[Array]:
    """Return the first guesses, best fit first; refuse channels whose sign, unit or name is wrong."""
    guesses, found = runs.first(starts)
    mistakes = channel_mistakes(runs.channels(runs.measured), [runs.channels(row) for row in found])
    if mistakes:
        raise LogError(f"{'; '.join(mistakes)}: say so in the rig file's [columns] or by --columns")
    misfits = np.sum((found - runs.measured) ** 2, axis=1)
    return [guesses[place] for place in np.argsort(misfits, kind="stable")]


def covariance(slopes: Array) -> Array:
    """Return the covariance of scaled estimates from the slopes of scaled channels: the Cramér-Rao bound.

    Parameters
    ----------
    slopes : ndarray, shape (n, unknowns)
        Slopes of the channels relative to their noise.

    Returns
    -------
    ndarray, shape (unknowns, unknowns)
        Covariance [dimensionless]; very large for directions that are not determined.
    """
    normal, sizes = _normalised(slopes)
    known, axes = np.linalg.eigh(normal)
    return (axes / np.maximum(known, _LEAST_KNOWN * known[-1])) @ axes.T / sizes


def _determined_covariance(slopes: Array) -> Array:
    """Return the covariance in directions that the channels determine, and zero in others: no step leads there."""
    normal, sizes = _normalised(slopes)
    return np.linalg.pinv(normal, rcond=_LEAST_KNOWN) / sizes


def _normalised(slopes: Array) -> tuple[Array, Array]:
    """Return the normal equations with each column of slopes scaled to one, and the scale factors."""
    size = np.maximum(np.linalg.norm(slopes, axis=0), 1e-12)
    return (slopes / size).T @ (slopes / size), np.outer(size, size)


def stack_bounds(
    parameters: PiezoStackParameters,
    voltage: Array,
    sample_time: float,
    *,
    unknowns: Collection[str] = DEFAULT_UNKNOWNS,
    channels: Collection[str] = STACK_CHANNELS,
) -> Mapping[str, float]:
    """Return the Cramér-Rao bounds of an experiment on each quantity, with all of them unknown together.

    Parameters
    ----------
    voltage : ndarray, shape (n,)
        Drive at the samples [V].
    sample_time : float
        Seconds between samples [s].
    unknowns : collection of str
        The unknown quantities, from `UNKNOWNS`.

    Returns
    -------
    Mapping[str, float]
        Standard deviation by name [SI]; relative for factors.
    """
    noise = {name: value for name, value in asdict(BENCH_SENSORS).items() if name in channels}
    runs = StackRuns(checked_voltage(voltage), sample_time, parameters, tuple(unknowns), noise, np.zeros(0))
    deviations = np.sqrt(np.diag(covariance(runs.linearised_at(np.zeros(len(runs.names)), LONGEST_STEP)[1])))
    return {
        name: (UNKNOWNS[name].scale or 1.0) * float(deviation)
        for name, deviation in zip(runs.names, deviations, strict=True)
    }


class _Optimum(NamedTuple):
    """End point of a descent: unknowns, residuals over noise, and their slopes."""

    theta: Array
    residuals: Array
    slopes: Array

    @property
    def cost(self) -> float:
        return float(self.residuals @ self.residuals)

    @property
    def spread(self) -> float:
        """Variance of the residuals over that of the noise [dimensionless]."""
        return self.cost / (len(self.residuals) - len(self.theta))


def _cost(one: _Optimum) -> float:
    return one.cost


def _optimum_in_exact_runs(runs: StackRuns, theta: Array) -> _Optimum:
    """Descend by the Gauss-Newton method in exact runs.

    It ends when a step is a tenth of the standard deviations, which makes no practical difference.
    """
    found, slopes = runs.linearised_at(theta, LONGEST_STEP)
    known, shown = covariance(slopes), _determined_covariance(slopes)
    residuals = found - runs.measured
    for _ in range(_MOST_EXACT):
        changes = np.outer(_SHORTENED, -shown @ (slopes.T @ residuals))
        change, tried = _best_change(runs, theta, changes, LONGEST_STEP)
        if float(tried @ tried) >= float(residuals @ residuals):
            break
        theta, residuals = theta + change, tried
        if _largest_relative_change(change, known) < _SETTLED_CHANGE:
            break
    return _Optimum(theta, residuals, slopes)


def _optimum_in_coarse_runs(runs: StackRuns, start: Array) -> tuple[Array, float]:
    """Descend by the Levenberg-Marquardt method in coarse runs, several dampings at a time; also return the misfit."""
    theta = start
    found, slopes = runs.linearised_at(theta, COARSE_STEP, COARSE_SLOPE_STEP)
    residuals = found - runs.measured
    left = float(residuals @ residuals)
    for _ in range(_MOST_STEPS):
        normal = slopes.T @ slopes
        own = np.diag(np.diag(normal) + 1e-12)
        changes = np.array([np.linalg.solve(normal + d * own, -slopes.T @ residuals) for d in _DAMPINGS])
        if _largest_relative_change(changes[0], covariance(slopes)) < _NEAR_DEVIATIONS:
            break
        change, tried = _best_change(runs, theta, np.asarray(changes, dtype=np.float64), COARSE_STEP)
        before, left = left, min(left, float(tried @ tried))
        if left >= before:
            break
        theta = theta + change
        if before - left < _LEAST_SHARE * before and left > _HOPELESS * len(tried):
            break
        found, slopes = runs.linearised_at(theta, COARSE_STEP, COARSE_SLOPE_STEP)
        residuals = found - runs.measured
    return theta, left


def _best_change(runs: StackRuns, theta: Array, changes: NDArray[Any], step: float) -> tuple[Array, Array]:
    """Return the change, of several run side by side, with the smallest misfit, and this misfit."""
    tried = runs.scaled([*(theta + changes)], step) - runs.measured
    best = int(np.argmin(np.sum(tried**2, axis=1)))
    return changes[best], tried[best]


def _largest_relative_change(change: NDArray[Any], known: Array) -> float:
    """Return the largest change relative to its standard deviation."""
    return float(np.max(np.abs(change) / np.sqrt(np.diag(known))))


_LEAST_KNOWN = 1e-14
"""Least information along a combination of unknowns, over the largest, that is more than rounding [dimensionless]."""

_COARSE_SECONDS, _COARSE_SHARE = 0.04, 0.25
"""Part of a log that coarse descents use: its beginning, eleven cycles of 275 Hz or more [s], and at least this
share."""

_MOST_STEPS = 30
_LEAST_SHARE, _HOPELESS = 0.01, 10.0
"""Least share of the misfit that a step must remove if the mean square exceeds the noise's by this factor: otherwise no
such actuator explains the log [dimensionless]."""

_NEAR_DEVIATIONS = 3.0
_SETTLED_CHANGE = 0.1
_SHORTENED = (1.0, 0.5, 0.2)
_MOST_EXACT = 6
_DAMPINGS = (1e-6, 1e-4, 1e-3, 1e-2, 0.1, 1.0, 1e2, 1e4)
_UNEXPLAINED = 1.1
_MOST_GUESSES = 4


def _concluded_estimate(runs: StackRuns, best: _Optimum, evaluations: int) -> StackEstimate:
    scaled = max(1.0, best.spread) * covariance(best.slopes)
    p = runs.actuator(best.theta)
    deviations = np.sqrt(np.diag(scaled))
    found = {
        name: reported_value(p, runs.healthy, name, float(one))
        for name, one in zip(runs.names, deviations, strict=True)
    }
    parts = np.split(best.residuals, len(runs.noise))
    return StackEstimate(
        MappingProxyType({name: value for name, (value, _) in found.items()}),
        MappingProxyType({name: deviation for name, (_, deviation) in found.items()}),
        scaled / np.outer(deviations, deviations),
        {name: sqrt(float(np.mean(part**2))) for name, part in zip(runs.noise, parts, strict=True)},
        evaluations,
        p,
        len(parts[0]),
        _delay_left(runs, best),
    )


def _delay_left(runs: StackRuns, best: _Optimum) -> float:
    """Return the delay that the residuals show, with all unknowns free [s]."""
    parts = np.split(best.residuals + runs.measured, len(runs.noise))
    rates = np.concatenate([np.gradient(part, runs.sample_time) for part in parts])
    # scaled to the size of the unknowns' slopes, a milliradian of the drive
    slopes = np.column_stack([best.slopes, 1e-6 * rates])
    shown = -_determined_covariance(slopes) @ (slopes.T @ best.residuals)
    return -1e-6 * float(shown[-1])
