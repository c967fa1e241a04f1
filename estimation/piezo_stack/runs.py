"""The log of a piezo-stack actuator, and the runs that are compared with it: both scaled by the sensors' noise."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass
from types import SimpleNamespace

import numpy as np

from estimation.arrays import Array
from estimation.piezo_stack.unknowns import UNKNOWNS, changed
from plant.errors import HydrostateError, LogError, require_known
from plant.log.record import Record
from plant.piezo_stack.parameters import LONGEST_STEP, PiezoStackParameters
from plant.piezo_stack.run import BENCH_SENSORS, StackSensors, checked_voltage, stack_channels
from plant.piezo_stack.trajectory import run_stacks

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

_HOPELESS = 1e6


@dataclass
class StackRuns:
    """The log that runs are compared with, and how many there were.

    Parameters
    ----------
    voltage : ndarray, shape (n,)
        Drive at the samples [V].
    sample_time : float
        Seconds between samples [s].
    noise : Mapping[str, float]
        Standard deviation of each channel's noise [SI].
    """

    voltage: Array
    sample_time: float
    healthy: PiezoStackParameters
    names: tuple[str, ...]
    noise: Mapping[str, float]
    count: int = 0

    def actuator(self, theta: Array) -> SimpleNamespace:
        """Return the actuator of a guess.

        Parameters
        ----------
        theta : ndarray, shape (unknowns,)
            Scaled as in `UNKNOWNS` [dimensionless].
        """
        return changed(self.healthy, dict(zip(self.names, theta.tolist(), strict=True)))

    def scaled(self, thetas: Sequence[Array], longest_step: float = LONGEST_STEP) -> Array:
        """Return every channel over its noise, one after the other; the guesses run side by side.

        Parameters
        ----------
        thetas : sequence of ndarray, shape (unknowns,)
            The guesses, scaled [dimensionless].
        longest_step : float
            Longest step of the runs [s].

        Returns
        -------
        ndarray, shape (guesses, channels * n)
            Very large where a guess strays to where no actuator is.
        """
        self.count += len(thetas)
        actuators = [self.actuator(theta) for theta in thetas]
        runs = run_stacks(actuators, self.voltage, self.sample_time, longest_step=longest_step)
        found = np.empty((len(actuators), len(self.noise) * len(self.voltage)))
        for row, p, states in zip(found, actuators, runs, strict=True):
            channels = stack_channels(states, p)
            row[:] = np.concatenate([channels[name] / deviation for name, deviation in self.noise.items()])
        return np.where(np.isfinite(found).all(axis=1, keepdims=True), found, _HOPELESS)

    def around(
        self, theta: Array, longest_step: float = LONGEST_STEP, slope_step: float = SLOPE_STEP
    ) -> tuple[Array, Array]:
        """Return the channels at a guess, and their slopes there.

        Parameters
        ----------
        theta : ndarray, shape (unknowns,)
            The guess, scaled [dimensionless].
        longest_step : float
            Longest step of the runs [s].
        slope_step : float
            Change of an unknown for a slope [dimensionless].

        Returns
        -------
        tuple of ndarray, shape (channels * n,) and (channels * n, unknowns)
            Channels over their noise, and slopes.
        """
        base, *moved = self.scaled([theta, *(theta + slope_step * np.eye(len(theta)))], longest_step)
        return base, np.column_stack([row - base for row in moved]) / slope_step

    def ordered(self, measured: Array, starts: Sequence[Mapping[str, float]]) -> list[Array]:
        """Return the first guesses that are made of the unknowns, the one that fits best first.

        Parameters
        ----------
        measured : ndarray, shape (channels * n,)
            The log's channels over their noise.
        starts : sequence of Mapping[str, float]
            First guesses, scaled [dimensionless].

        Returns
        -------
        list of ndarray, shape (unknowns,)
            The guesses.

        Raises
        ------
        HydrostateError
            If no first guess is made of the unknowns.
        """
        guesses = [
            np.array([start.get(name, 0.0) for name in self.names]) for start in starts if set(start) <= set(self.names)
        ]
        if not guesses:
            raise HydrostateError("no first guess is made of the unknowns alone")
        misfits = np.sum((self.scaled(guesses, COARSE_STEP) - measured) ** 2, axis=1)
        return [guesses[place] for place in np.argsort(misfits, kind="stable")]


def prepared(
    record: Record,
    healthy: PiezoStackParameters,
    names: tuple[str, ...],
    channels: Collection[str],
    sensors: StackSensors,
) -> tuple[StackRuns, Array]:
    """Check a log and return what its runs are compared with.

    Parameters
    ----------
    record : Record
        ``drive_voltage_v`` and one or more of `STACK_CHANNELS`.
    names : tuple of str
        What is estimated, of `UNKNOWNS`.
    channels : collection of str
        What is used of what is logged.

    Returns
    -------
    tuple of StackRuns and ndarray, shape (channels * n,)
        The runs, and the log's channels over their noise, one after the other.

    Raises
    ------
    LogError
        If the drive or every channel is missing, or samples are.
    HydrostateError
        If an unknown is not known.
    """
    for name in names:
        require_known("an unknown", name, UNKNOWNS)
    if DRIVE not in record:
        raise LogError(f"{DRIVE} is needed; the log has {', '.join(record)}")
    used = [name for name in STACK_CHANNELS if name in channels and name in record]
    if not used:
        raise LogError(f"one of {', '.join(STACK_CHANNELS)} is needed beside {DRIVE}, the log has {', '.join(record)}")
    for name in (DRIVE, *used):
        if not np.all(np.isfinite(record[name])):
            raise LogError(f"{name} must be whole, got {int(np.sum(~np.isfinite(record[name])))} missing samples")
    noise = {name: value for name, value in asdict(sensors).items() if name in used}
    runs = StackRuns(checked_voltage(record[DRIVE]), record.sample_time, healthy, names, noise)
    return runs, np.concatenate([record[name] / deviation for name, deviation in noise.items()])
