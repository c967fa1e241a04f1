"""The piezo-stack actuator's unknowns followed from sample to sample: an extended Kalman filter (decision 25).

Nineteen states and the logarithms or amounts that `UNKNOWNS` name, all carried from one sample to the next by the
plant's own steps of 2 us. Slopes are differences of runs side by side: a step's Jacobian in closed form, as the other
filters have it, would fill a kernel with some hundred thousand operations.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, fields
from types import MappingProxyType, SimpleNamespace

import numpy as np

from estimation.arrays import Array
from estimation.piezo_stack.runs import STACK_CHANNELS, StackRuns, prepared
from estimation.piezo_stack.unknowns import DEFAULT_UNKNOWNS, STARTS, UNKNOWNS, changed, told
from plant.errors import HydrostateError
from plant.log.record import Record
from plant.piezo_stack.model import STATES, at_bias
from plant.piezo_stack.parameters import PiezoStackParameters
from plant.piezo_stack.run import BENCH_SENSORS, StackSensors, stack_channels
from plant.piezo_stack.trajectory import NAME, run_rows, stack_row

STATE_SIZES = np.array(
    [1e-5, 0.02, 2e3, 1e-6, 1e-9, 1e-4, 0.1, 1e-4, 0.1, 1e-9, 1e-5, 1e-9, 1e-3, 0.1, 1e-9, 1e-5, 1e-9, 1e-5, 1e-9]
)
"""How much each state changes [SI]: the filter's units."""

STATE_NOISE, FIRST_STATE_NOISE = 1e-4, 0.1
"""What a sample adds to the states' standard deviations in the end and at the start [filter's units]: it stands for the
error of a straight line through bouncing reeds. Without the larger one some filters are lost (decision 25)."""

CALMING = 200.0
"""Samples in which the noise at the start falls to a third."""

FIRST_GUESS = 0.2
"""Standard deviation of each scaled unknown before the log [dimensionless]."""

DIFFERENCE = 1e-3
"""Change of a scaled state or unknown for a slope [dimensionless]."""


@dataclass(frozen=True, eq=False)
class StackTrack:
    """What a filter says of a log, sample by sample.

    Parameters
    ----------
    names : tuple of str
        The unknowns.
    values : ndarray, shape (n, unknowns)
        Scaled estimates, as in `UNKNOWNS` [dimensionless].
    deviations : ndarray, shape (n, unknowns)
        Their standard deviations [dimensionless].
    consistency : float
        Mean normalised innovation squared a channel; 1 for the right model [dimensionless].
    """

    names: tuple[str, ...]
    values: Array
    deviations: Array
    consistency: float

    def final(self, healthy: PiezoStackParameters) -> Mapping[str, tuple[float, float]]:
        """Return each unknown's last estimate and its standard deviation.

        Parameters
        ----------
        healthy : PiezoStackParameters
            The actuator that the unknowns change.

        Returns
        -------
        Mapping[str, tuple]
            Value and standard deviation by name [SI]; of what changes several parameters, as a factor.
        """
        p = changed(healthy, dict(zip(self.names, self.values[-1].tolist(), strict=True)))
        deviations = zip(self.names, self.deviations[-1].tolist(), strict=True)
        return MappingProxyType({name: told(p, healthy, name, deviation) for name, deviation in deviations})


def filter_stack(
    record: Record,
    healthy: PiezoStackParameters,
    *,
    unknowns: Collection[str] = DEFAULT_UNKNOWNS,
    channels: Collection[str] = STACK_CHANNELS,
    sensors: StackSensors = BENCH_SENSORS,
    starts: Sequence[Mapping[str, float]] = STARTS,
) -> StackTrack:
    """Follow what is wrong inside the actuator through a run that began at rest, by an extended Kalman filter.

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
        First guesses, scaled as in `UNKNOWNS` [dimensionless]; the filter begins at the one that fits the log best.

    Returns
    -------
    StackTrack
        Estimates with standard deviations, sample by sample.

    Raises
    ------
    LogError
        If the drive or every channel is missing, or samples are.
    HydrostateError
        If an unknown is not known, or the estimate stops being finite.
    """
    runs, measured = prepared(record, healthy, tuple(unknowns), channels, sensors)
    y = measured.reshape(len(runs.noise), -1).T
    rows = _Rows(healthy, runs.names)
    width = len(STATES)
    theta = runs.ordered(measured, starts)[0]
    z, spread = _first_belief(rows, theta, float(runs.voltage[0]))
    values, deviations = np.empty((2, len(y), len(theta)))
    nis = 0.0
    for k, seen in enumerate(y):
        if k:
            moved, expected, by_state, by_channel = _linearised(rows, z, runs, k)
            known = spread.copy()
            extra = FIRST_STATE_NOISE * np.exp(-k / CALMING)
            known[range(width), range(width)] += STATE_NOISE**2 + extra**2
            shared = known @ by_channel.T
            variance = by_channel @ shared + np.eye(len(seen))
            gain = np.linalg.solve(variance, (by_state @ shared).T).T
            innovation = seen - expected
            z = moved + gain @ innovation
            spread = by_state @ known @ by_state.T - gain @ variance @ gain.T
            spread = 0.5 * (spread + spread.T)
            nis += float(innovation @ np.linalg.solve(variance, innovation)) / len(seen)
        values[k], deviations[k] = z[width:], np.sqrt(np.maximum(np.diag(spread)[width:], 0.0))
    if not np.all(np.isfinite(values[-1])):
        raise HydrostateError(f"the filter of the {NAME} plant stopped being finite: begin it nearer, or fit the run")
    return StackTrack(runs.names, values, deviations, nis / max(1, len(y) - 1))


class _Rows:
    """Parameter rows of an actuator with scaled unknowns, quickly."""

    def __init__(self, healthy: PiezoStackParameters, names: tuple[str, ...]) -> None:
        self.order = [field.name for field in fields(PiezoStackParameters)]
        self.healthy = stack_row(healthy)
        self.places = [[self.order.index(one) for one in UNKNOWNS[name].names] for name in names]
        self.scales = [UNKNOWNS[name].scale for name in names]

    def at(self, thetas: Array) -> Array:
        """Return a row for each guess, shape (guesses, parameters)."""
        rows = np.tile(self.healthy, (len(thetas), 1))
        for theta, places, scale in zip(thetas.T, self.places, self.scales, strict=True):
            for place in places:
                rows[:, place] = rows[:, place] + scale * theta if scale else rows[:, place] * np.exp(theta)
        return rows

    def named(self, rows: Array) -> SimpleNamespace:
        return SimpleNamespace(**dict(zip(self.order, rows.T, strict=True)))


def _first_belief(rows: _Rows, theta: Array, voltage: float) -> tuple[Array, Array]:
    """Return the state at bias with the unknowns, and the spread of both: oil at rest depends on the air in it."""

    def resting(guess: Array) -> Array:
        p = rows.named(rows.at(guess[None]))
        p = SimpleNamespace(**{name: float(value[0]) for name, value in vars(p).items()})
        return np.concatenate([at_bias(p, voltage) / STATE_SIZES, guess])

    z = resting(theta)
    slopes = np.column_stack([(resting(theta + DIFFERENCE * unit) - z) / DIFFERENCE for unit in np.eye(len(theta))])
    return z, FIRST_GUESS**2 * slopes @ slopes.T


def _linearised(rows: _Rows, z: Array, runs: StackRuns, k: int) -> tuple[Array, Array, Array, Array]:
    """Return the mean at sample k from that of the sample before, the channels there, and the slopes of both."""
    points = z + DIFFERENCE * np.vstack([np.zeros(len(z)), np.eye(len(z))])
    width = len(STATES)
    parameters = rows.at(points[:, width:])
    drives = np.tile(runs.voltage[k - 1 : k + 1, None], len(points))
    states = run_rows(parameters, (points[:, :width] * STATE_SIZES).T, drives, runs.sample_time)[-1].T
    seen = stack_channels(states, rows.named(parameters))
    outputs = np.column_stack([seen[name] / deviation for name, deviation in runs.noise.items()])
    moved = np.hstack([states / STATE_SIZES, points[:, width:]])
    slopes = [(ends[1:] - ends[0]).T / DIFFERENCE for ends in (moved, outputs)]
    return moved[0], outputs[0], slopes[0], slopes[1]
