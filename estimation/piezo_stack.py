"""What is wrong inside a piezo-stack actuator, from what its bench logs: output error by least squares.

The drive is known, so the whole run is simulated and fitted to every channel at once, each weighed by its noise. The
run must begin at rest at the bias pressure.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass
from math import sqrt
from types import MappingProxyType, SimpleNamespace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from estimation.piezo_stack_unknowns import DEFAULT_UNKNOWNS, STARTS, UNKNOWNS, changed
from plant.errors import HydrostateError, LogError
from plant.piezo_stack_parameters import LONGEST_STEP, PiezoStackParameters
from plant.piezo_stack_run import BENCH_SENSORS, StackSensors, checked_voltage, run_stacks, stack_channels
from plant.record import Record

Array: TypeAlias = NDArray[np.float64]

NORMAL_95 = 1.959963984540054
"""Half width of a 95 % interval over the standard deviation [dimensionless]."""

DRIVE = "drive_voltage_v"
"""The channel of the drive."""

STACK_CHANNELS = tuple(asdict(BENCH_SENSORS))
"""Channels that a bench may log beside the drive."""

COARSE_STEP = 5e-6
"""Longest step of the runs that slopes and starts are taken from [s]."""

SLOPE_STEP = 1e-3
"""Change of a scaled parameter for a slope [dimensionless]."""

COARSE_SLOPE_STEP = 2e-2
"""The same far from the answer, where bouncing reeds roughen the misfit [dimensionless]."""


@dataclass(frozen=True)
class StackEstimate:
    """What a log says of the actuator.

    Parameters
    ----------
    values : Mapping[str, float]
        Estimates by name [SI]; polarisation as a factor.
    deviations : Mapping[str, float]
        Standard deviations by name [SI], wider where the residuals are larger than the noise.
    correlations : ndarray, shape (unknowns, unknowns)
        Between the scaled estimates.
    misfit : Mapping[str, float]
        Root mean square of each channel's residual over its noise; 1 for the right model [dimensionless].
    evaluations : int
        Runs that it took.
    parameters : PiezoStackParameters or namespace
        The actuator with the estimates in it.
    """

    values: Mapping[str, float]
    deviations: Mapping[str, float]
    correlations: Array
    misfit: Mapping[str, float]
    evaluations: int
    parameters: PiezoStackParameters | SimpleNamespace

    def interval(self, name: str) -> tuple[float, float]:
        """Return a quantity's 95 % interval.

        Parameters
        ----------
        name : str
            The quantity.

        Returns
        -------
        tuple of float
            Lower and upper end [SI].
        """
        half = NORMAL_95 * self.deviations[name]
        return self.values[name] - half, self.values[name] + half


@dataclass
class _Runs:
    """The log that runs are compared with, and how many there were."""

    voltage: Array
    sample_time: float
    healthy: PiezoStackParameters
    names: tuple[str, ...]
    noise: Mapping[str, float]
    count: int = 0

    def actuator(self, theta: Array) -> SimpleNamespace:
        return changed(self.healthy, dict(zip(self.names, theta.tolist(), strict=True)))

    def scaled(self, thetas: Sequence[Array], longest_step: float = LONGEST_STEP) -> Array:
        """Return every channel over its noise, one after the other, a row for each guess; guesses run side by side."""
        self.count += len(thetas)
        actuators = [self.actuator(theta) for theta in thetas]
        rows = [
            np.concatenate([channels[name] / deviation for name, deviation in self.noise.items()])
            for p, states in zip(
                actuators, run_stacks(actuators, self.voltage, self.sample_time, longest_step=longest_step), strict=True
            )
            for channels in [stack_channels(states, p)]
        ]
        found = np.array(rows)  # an estimate on its way may stray where no actuator is
        return np.where(np.isfinite(found).all(axis=1, keepdims=True), found, _HOPELESS)

    def around(
        self, theta: Array, longest_step: float = LONGEST_STEP, slope_step: float = SLOPE_STEP
    ) -> tuple[Array, Array]:
        """Return the channels at a guess, and their slopes there."""
        base, *moved = self.scaled([theta, *(theta + slope_step * np.eye(len(theta)))], longest_step)
        return base, np.column_stack([row - base for row in moved]) / slope_step


def estimate_stack(
    record: Record,
    healthy: PiezoStackParameters,
    *,
    unknowns: Collection[str] = DEFAULT_UNKNOWNS,
    channels: Collection[str] = STACK_CHANNELS,
    sensors: StackSensors = BENCH_SENSORS,
    starts: Sequence[Mapping[str, float]] = STARTS,
) -> StackEstimate:
    """Estimate what is wrong inside the actuator from a run that began at rest.

    Parameters
    ----------
    record : Record
        ``drive_voltage_v`` and one or more of `STACK_CHANNELS`.
    healthy : PiezoStackParameters
        The actuator as it should be, at the run's bias pressure and load.
    unknowns : collection of str
        What is estimated, of `UNKNOWNS`.
    channels : collection of str
        What is used of what is logged.
    sensors : StackSensors
        Noise of the channels.
    starts : sequence of Mapping[str, float]
        First guesses, scaled as in `UNKNOWNS` [dimensionless].

    Returns
    -------
    StackEstimate
        Estimates with intervals.

    Raises
    ------
    LogError
        If the drive or every channel is missing, or samples are.
    HydrostateError
        If an unknown is not known, or no first guess is made of them.
    """
    runs, measured = _prepared(record, healthy, tuple(unknowns), channels, sensors)
    guesses = _ordered_starts(runs, measured, starts)

    theta, residuals, slopes = _descended(runs, measured, guesses[0])
    for guess in guesses[1:_MOST_GUESSES]:
        if _spread(residuals, theta) < _UNEXPLAINED:
            break
        other = _descended(runs, measured, guess)
        if float(other[1] @ other[1]) < float(residuals @ residuals):
            theta, residuals, slopes = other
    spread = max(1.0, _spread(residuals, theta))
    return _concluded(runs, theta, residuals, spread * covariance(slopes))


def covariance(slopes: Array) -> Array:
    """Return the covariance of scaled estimates from the slopes of scaled channels: the Cramér-Rao bound.

    Parameters
    ----------
    slopes : ndarray, shape (n, unknowns)
        Slopes of channels over noise.

    Returns
    -------
    ndarray, shape (unknowns, unknowns)
        Covariance [dimensionless]; very large where nothing is known.
    """
    size = np.maximum(np.linalg.norm(slopes, axis=0), 1e-12)
    return np.linalg.pinv((slopes / size).T @ (slopes / size), rcond=1e-14) / np.outer(size, size)


def stack_bounds(
    parameters: PiezoStackParameters,
    voltage: Array,
    sample_time: float,
    *,
    unknowns: Collection[str] = DEFAULT_UNKNOWNS,
    channels: Collection[str] = STACK_CHANNELS,
    sensors: StackSensors = BENCH_SENSORS,
) -> Mapping[str, float]:
    """Return how well an experiment could know each quantity: Cramér-Rao bounds, all unknown together.

    Parameters
    ----------
    parameters : PiezoStackParameters
        The actuator.
    voltage : ndarray, shape (n,)
        Drive at the samples [V].
    sample_time : float
        Seconds between samples [s].
    unknowns : collection of str
        What is unknown, of `UNKNOWNS`.
    channels : collection of str
        What is logged.
    sensors : StackSensors
        Noise of the channels.

    Returns
    -------
    Mapping[str, float]
        Standard deviation by name [SI]; of factors, relative.
    """
    noise = {name: value for name, value in asdict(sensors).items() if name in channels}
    runs = _Runs(checked_voltage(voltage), sample_time, parameters, tuple(unknowns), noise)
    deviations = np.sqrt(np.diag(covariance(runs.around(np.zeros(len(runs.names)), LONGEST_STEP)[1])))
    return {
        name: (UNKNOWNS[name].scale or 1.0) * float(deviation)
        for name, deviation in zip(runs.names, deviations, strict=True)
    }


def _descended(runs: _Runs, measured: Array, start: Array) -> tuple[Array, Array, Array]:
    """Descend by Levenberg and Marquardt in coarse runs, then by Gauss and Newton in exact ones.

    It ends where a step is a tenth of the standard deviations, which no reader could tell from none.
    """
    theta = _coarsely_descended(runs, measured, start)
    found, slopes = runs.around(theta, LONGEST_STEP)
    known = covariance(slopes)
    residuals = found - measured
    for _ in range(_MOST_EXACT):
        changes = np.outer(_SHORTENED, -known @ (slopes.T @ residuals))
        tried = runs.scaled([*(theta + changes)]) - measured
        best = int(np.argmin(np.sum(tried**2, axis=1)))
        if float(tried[best] @ tried[best]) >= float(residuals @ residuals):
            break
        theta, residuals = theta + changes[best], tried[best]
        if _share(changes[best], known) < _DONE:
            break
    return theta, residuals, slopes


def _coarsely_descended(runs: _Runs, measured: Array, start: Array) -> Array:
    """Descend by Levenberg and Marquardt, several dampings tried side by side."""
    theta = start
    found, slopes = runs.around(theta, COARSE_STEP, COARSE_SLOPE_STEP)
    residuals = found - measured
    for _ in range(_MOST_STEPS):
        normal = slopes.T @ slopes
        own = np.diag(np.diag(normal) + 1e-12)
        changes = [np.linalg.solve(normal + damping * own, -slopes.T @ residuals) for damping in _DAMPINGS]
        if _share(changes[0], covariance(slopes)) < _NEAR:
            break
        tried = runs.scaled([theta + change for change in changes], COARSE_STEP) - measured
        best = int(np.argmin(np.sum(tried**2, axis=1)))
        if float(tried[best] @ tried[best]) >= float(residuals @ residuals):
            break
        theta = theta + changes[best]
        found, slopes = runs.around(theta, COARSE_STEP, COARSE_SLOPE_STEP)
        residuals = found - measured
    return theta


def _share(change: NDArray[Any], known: Array) -> float:
    """Return the largest change over its standard deviation."""
    return float(np.max(np.abs(change) / np.sqrt(np.diag(known))))


_HOPELESS = 1e6
_MOST_STEPS = 30
_NEAR = 3.0
_DONE = 0.1
_SHORTENED = (1.0, 0.5, 0.2)
_MOST_EXACT = 6
_DAMPINGS = (1e-6, 1e-4, 1e-3, 1e-2, 0.1, 1.0, 1e2, 1e4)
_UNEXPLAINED = 1.1
_MOST_GUESSES = 4


def _prepared(
    record: Record,
    healthy: PiezoStackParameters,
    names: tuple[str, ...],
    channels: Collection[str],
    sensors: StackSensors,
) -> tuple[_Runs, Array]:
    for name in names:
        if name not in UNKNOWNS:
            raise HydrostateError(f"an unknown must be one of {', '.join(UNKNOWNS)}, got {name!r}")
    if DRIVE not in record:
        raise LogError(f"{DRIVE} is wanted, the log has {', '.join(record)}")
    used = [name for name in STACK_CHANNELS if name in channels and name in record]
    if not used:
        raise LogError(f"one of {', '.join(STACK_CHANNELS)} is wanted beside {DRIVE}, the log has {', '.join(record)}")
    for name in (DRIVE, *used):
        if not np.all(np.isfinite(record[name])):
            raise LogError(f"{name} must be whole, got {int(np.sum(~np.isfinite(record[name])))} missing samples")
    noise = {name: value for name, value in asdict(sensors).items() if name in used}
    runs = _Runs(checked_voltage(record[DRIVE]), record.sample_time, healthy, names, noise)
    return runs, np.concatenate([record[name] / deviation for name, deviation in noise.items()])


def _spread(residuals: Array, theta: Array) -> float:
    return float(residuals @ residuals) / (len(residuals) - len(theta))


def _ordered_starts(runs: _Runs, measured: Array, starts: Sequence[Mapping[str, float]]) -> list[Array]:
    """Return the first guesses that are made of the unknowns, the one that fits best first."""
    guesses = [
        np.array([start.get(name, 0.0) for name in runs.names]) for start in starts if set(start) <= set(runs.names)
    ]
    if not guesses:
        raise HydrostateError("no first guess is made of the unknowns alone")
    misfits = np.sum((runs.scaled(guesses, COARSE_STEP) - measured) ** 2, axis=1)
    return [guesses[place] for place in np.argsort(misfits, kind="stable")]


def _concluded(runs: _Runs, theta: Array, residuals: Array, scaled: Array) -> StackEstimate:
    p = runs.actuator(theta)
    deviations = np.sqrt(np.diag(scaled))
    values: dict[str, float] = {}
    spread: dict[str, float] = {}
    for i, name in enumerate(runs.names):
        unknown = UNKNOWNS[name]
        found = getattr(p, unknown.names[0])
        values[name] = found / getattr(runs.healthy, unknown.names[0]) if len(unknown.names) > 1 else found
        spread[name] = float(deviations[i]) * (unknown.scale or values[name])
    parts = np.split(residuals, len(runs.noise))
    return StackEstimate(
        MappingProxyType(values),
        MappingProxyType(spread),
        scaled / np.outer(deviations, deviations),
        {name: sqrt(float(np.mean(part**2))) for name, part in zip(runs.noise, parts, strict=True)},
        runs.count,
        p,
    )
