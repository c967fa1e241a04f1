"""What a drive signal must respect: sampling, the motor's speed, the piston's stroke."""

from math import isfinite

import numpy as np
from numpy.typing import NDArray

from plant.eha import EhaParameters
from plant.errors import DriveError

MOST_SAMPLES = 100_000_000
"""Longest signal that is made, in samples; a longer one is taken for a mistake in a unit."""

LIMIT_SLACK = 1e-9
"""Fraction by which a limit may be passed, for rounding."""


def sample_count(duration: float, sample_time: float) -> int:
    """Return how many samples a signal has: one every `sample_time` from zero, the end excluded.

    Parameters
    ----------
    duration : float
        Length of the signal [s].
    sample_time : float
        Time between samples [s].

    Returns
    -------
    int
        The rounded quotient, at least 2.

    Raises
    ------
    DriveError
        If either is not positive and finite, or the signal would be shorter than two samples or absurdly
        long.

    Examples
    --------
    >>> sample_count(10.0, 1e-4)
    100000
    """
    require_positive("duration", duration, "s")
    require_positive("sample_time", sample_time, "s")
    count = duration / sample_time
    if not 1.5 < count <= MOST_SAMPLES:
        raise DriveError(
            f"a signal must have 2 to {MOST_SAMPLES} samples, got {count:.6g} "
            f"(duration {duration:g} s, sample_time {sample_time:g} s)"
        )
    return round(count)


def check_drive(speed: NDArray[np.float64], sample_time: float, parameters: EhaParameters) -> None:
    """Refuse a drive that the motor or the stroke does not allow.

    The stroke needed is the range of the ideal displacement, ``pump_displacement / piston_area`` times the
    integral of speed; losses only shorten it.

    Parameters
    ----------
    speed : ndarray, shape (n,)
        Motor speed [rad/s].
    sample_time : float
        Time between samples [s].
    parameters : EhaParameters
        The actuator, for its limits.

    Raises
    ------
    DriveError
        If the speed is not a finite one-dimensional array, or exceeds the motor's limit or the stroke.

    Examples
    --------
    >>> check_drive(np.full(100_000, 125.66), 1e-4, EhaParameters())
    Traceback (most recent call last):
        ...
    plant.errors.DriveError: the drive needs 0.4605 m of stroke, the actuator has 0.25 m
    """
    require_positive("sample_time", sample_time, "s")
    if speed.ndim != 1 or len(speed) == 0:
        raise DriveError(f"motor speed must be a one-dimensional array of samples, got shape {speed.shape}")
    finite = np.isfinite(speed)
    if not finite.all():
        where = int(np.argmin(finite))
        raise DriveError(f"motor speed must be finite, got {speed[where]} at sample {where}")
    fastest, limit = float(np.max(np.abs(speed))), parameters.motor_speed_limit
    if fastest > limit * (1.0 + LIMIT_SLACK):
        raise DriveError(f"motor speed must stay within {limit:g} rad/s, got {fastest:.4g} rad/s")
    swept = parameters.pump_displacement / parameters.piston_area * sample_time
    position = np.concatenate(([0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1])))) * swept
    needed = float(np.ptp(position))
    if needed > parameters.stroke * (1.0 + LIMIT_SLACK):
        raise DriveError(f"the drive needs {needed:.4g} m of stroke, the actuator has {parameters.stroke:g} m")


def require_positive(name: str, value: float, unit: str) -> None:
    """Refuse a number that is not positive and finite.

    Parameters
    ----------
    name : str
        What it is called in the message.
    value : float
        The number [in the unit given].
    unit : str
        Its unit, for the message.

    Raises
    ------
    DriveError
        If it is not positive and finite.
    """
    if not (isfinite(value) and value > 0.0):
        raise DriveError(f"{name} must be positive and finite, got {value!r} {unit}")


def require_frequency(name: str, value: float, sample_time: float) -> None:
    """Refuse a frequency that samples cannot carry.

    Parameters
    ----------
    name : str
        What it is called in the message.
    value : float
        Frequency [Hz].
    sample_time : float
        Time between samples [s].

    Raises
    ------
    DriveError
        If it is not positive, or not below half the sampling frequency.
    """
    require_positive(name, value, "Hz")
    if value >= 0.5 / sample_time:
        raise DriveError(f"{name} must be below half the sampling frequency {0.5 / sample_time:g} Hz, got {value:g} Hz")
