"""The log of a piezo-stack actuator, and the runs that are compared with it: both scaled by the sensors' noise."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from math import sqrt
from types import SimpleNamespace

import numpy as np

from estimation.arrays import Array
from estimation.log_checks.longest_hold import require_live
from estimation.log_checks.measurement_noise import excited_noise_variance
from estimation.piezo_stack.unknowns import UNKNOWNS, changed_actuator
from plant.errors import HydrostateError, LogError, require_known
from plant.log.record import Record
from plant.piezo_stack.parameters import LONGEST_STEP, PiezoStackParameters
from plant.piezo_stack.run import BENCH_SENSORS, HIGHEST_VOLTAGE, checked_voltage, stack_channels
from plant.piezo_stack.trajectory import run_stacks

DRIVE = "drive_voltage_v"
"""The channel of the drive."""

STACK_CHANNELS = tuple(asdict(BENCH_SENSORS))
"""Channels that a bench may log besides the drive."""

ANY_ZERO = ("stack_displacement_m", "stack_force_n", "position_m")
"""Channels that are compared about their means, since each bench sets their zeros as it likes. Pressure is not among
them, since air and reeds depend on its absolute value."""

OVERSHOOT = 0.02
"""Limit by which a measured drive may exceed the stack's range, for its noise and zero offset [fraction of the rated
voltage] (judged)."""

COARSE_STEP = 5e-6
"""Longest step of the runs from which slopes and starts are taken [s]."""

SLOPE_STEP = 1e-3
"""Change of a scaled parameter in a difference quotient [dimensionless]."""

COARSE_SLOPE_STEP = 2e-2
"""The same far from the solution, where bouncing reeds roughen the misfit [dimensionless]."""

_HOPELESS = 1e6


@dataclass
class StackRuns:
    """The log that runs are compared with, and the number of runs made.

    Parameters
    ----------
    voltage : ndarray, shape (n,)
        Drive at the samples [V].
    sample_time : float
        Seconds between samples [s].
    noise : Mapping[str, float]
        Standard deviation of each channel's noise [SI].
    measured : ndarray, shape (channels * n,)
        The log's channels over their noise, one after the other; empty if a run is only planned.
    """

    voltage: Array
    sample_time: float
    healthy: PiezoStackParameters
    names: tuple[str, ...]
    noise: Mapping[str, float]
    measured: Array
    count: int = 0

    def beginning(self, samples: int) -> "StackRuns":
        """Return the same for the first samples of the log.

        Parameters
        ----------
        samples : int
            Number of samples [count].
        """
        channels = {name: values[:samples] for name, values in self.channels(self.measured).items()}
        return replace(self, voltage=self.voltage[:samples], measured=over_noise(channels, self.noise), count=0)

    def actuator(self, theta: Array) -> SimpleNamespace:
        """Return the actuator of a guess.

        Parameters
        ----------
        theta : ndarray, shape (unknowns,)
            The guess, scaled as in `UNKNOWNS` [dimensionless].
        """
        return changed_actuator(self.healthy, dict(zip(self.names, theta.tolist(), strict=True)))

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
            Very large if a guess is not a possible actuator.
        """
        self.count += len(thetas)
        actuators = [self.actuator(theta) for theta in thetas]
        runs = run_stacks(actuators, self.voltage, self.sample_time, longest_step=longest_step)
        found = np.empty((len(actuators), len(self.noise) * len(self.voltage)))
        with np.errstate(over="ignore", invalid="ignore"):  # a run that grows beyond bounds is hopeless
            for row, p, states in zip(found, actuators, runs, strict=True):
                row[:] = over_noise(stack_channels(states, p), self.noise)
        return np.where(np.isfinite(found).all(axis=1, keepdims=True), found, _HOPELESS)

    def linearised_at(
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
            Change of an unknown in a difference quotient [dimensionless].

        Returns
        -------
        tuple of ndarray, shape (channels * n,) and (channels * n, unknowns)
            Channels over their noise, and slopes.
        """
        base, *moved = self.scaled([theta, *(theta + slope_step * np.eye(len(theta)))], longest_step)
        return base, np.column_stack([row - base for row in moved]) / slope_step

    def first(self, starts: Sequence[Mapping[str, float]]) -> tuple[list[Array], Array]:
        """Return the first guesses that concern only the unknowns, and their channels.

        Parameters
        ----------
        starts : sequence of Mapping[str, float]
            First guesses, scaled [dimensionless].

        Returns
        -------
        tuple of list of ndarray, shape (unknowns,), and ndarray, shape (guesses, channels * n)
            The guesses, and channels over their noise.

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
        return guesses, self.scaled(guesses, COARSE_STEP)

    def channels(self, scaled: Array) -> Mapping[str, Array]:
        """Return channels by name from scaled ones.

        Parameters
        ----------
        scaled : ndarray, shape (channels * n,)
            Channels over their noise.

        Returns
        -------
        Mapping[str, ndarray of shape (n,)]
            The channels [SI]; those of `ANY_ZERO` are about their means.
        """
        parts = np.split(scaled, len(self.noise))
        return {name: deviation * part for (name, deviation), part in zip(self.noise.items(), parts, strict=True)}


def over_noise(channels: Mapping[str, Array], noise: Mapping[str, float]) -> Array:
    """Return channels over their noise, one after the other; those of `ANY_ZERO` about their means.

    Parameters
    ----------
    channels : Mapping[str, ndarray of shape (n,)]
        The channels [SI].
    noise : Mapping[str, float]
        Standard deviation of the noise of the channels to return [SI].

    Returns
    -------
    ndarray, shape (channels * n,)
        Deviations [dimensionless].
    """
    parts = ((channels[name], deviation, name in ANY_ZERO) for name, deviation in noise.items())
    return np.concatenate([(one - one.mean() if free else one) / deviation for one, deviation, free in parts])


def prepared_runs(
    record: Record, healthy: PiezoStackParameters, names: tuple[str, ...], channels: Collection[str]
) -> StackRuns:
    """Check a log and return the data with which its runs are compared.

    The noise of each channel is estimated from the log by sixth differences. At 275 Hz and 20 kHz, with the noise of
    the paper's sensors, the pump's motion contributes less than a fifth to them.

    Parameters
    ----------
    record : Record
        ``drive_voltage_v`` and one or more of `STACK_CHANNELS`.
    names : tuple of str
        Quantities to estimate, from `UNKNOWNS`.
    channels : collection of str
        Channels to use, of those that are logged.

    Raises
    ------
    LogError
        If the drive or every channel is missing, or samples are, or a channel holds one value for long.
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
    voltage = checked_voltage(record[DRIVE], overshoot=OVERSHOOT * HIGHEST_VOLTAGE)
    require_live(record, used)
    noise = {name: sqrt(excited_noise_variance(record[name])) for name in used}
    return StackRuns(
        voltage, record.sample_time, healthy, names, noise, over_noise({name: record[name] for name in noise}, noise)
    )
