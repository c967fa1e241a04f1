"""Drive signals: motor speed over time, within the limits of speed and stroke.

Every signal is a pure function of its description and, if it is random, of a generator. Amplitudes are motor speeds
[rad/s]; the paper's 4 V are ``parameters.rated_speed``.
"""

from collections.abc import Callable, Mapping
from math import ceil
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from plant.eha.drive_limits import LIMIT_SLACK, check_drive
from plant.eha.model import EhaParameters
from plant.errors import DriveError, require_known
from plant.runs import require_frequency, require_positive, sample_count

Drive: TypeAlias = Callable[[float, float, EhaParameters, np.random.Generator], NDArray[np.float64]]
"""A drive by name: duration [s], sample time [s], actuator and generator in, motor speed [rad/s] out."""

STEPS = 9
"""Number of steps in the validation signal of section 6."""

HOLD_TIME = 0.05
"""Hold time of the drive "prbs" [s], the slow end of the range for identifying a 25 Hz bandwidth."""


def sine(duration: float, sample_time: float, amplitude: float, frequency: float = 10.0) -> NDArray[np.float64]:
    """Return a sine; with 10 Hz and 4 V it is the paper's signal for bulk modulus, section 7.

    Parameters
    ----------
    duration, sample_time : float
        Length of the signal and time between samples [s].
    amplitude : float
        Peak motor speed [rad/s].
    frequency : float
        Frequency [Hz], below half the sampling frequency.

    Returns
    -------
    ndarray, shape (n,)
        Motor speed [rad/s] at ``k * sample_time``.

    Raises
    ------
    DriveError
        If an argument is not positive and finite, or the frequency is not below the Nyquist frequency.

    Examples
    --------
    >>> sine(0.1, 0.025, 125.66).round(2).tolist()
    [0.0, 125.66, 0.0, -125.66]
    """
    time = sample_time * np.arange(sample_count(duration, sample_time))
    require_positive("amplitude", amplitude, "rad/s")
    require_frequency("frequency", frequency, sample_time)
    return amplitude * np.sin(2.0 * np.pi * frequency * time)


def chirp(
    duration: float, sample_time: float, amplitude: float, lowest: float = 0.5, highest: float = 30.0
) -> NDArray[np.float64]:
    """Return a sine whose frequency sweeps linearly from `lowest` to `highest`.

    The defaults span the 25 Hz bandwidth that section 7 gives.

    Parameters
    ----------
    duration, sample_time : float
        Length of the signal and time between samples [s].
    amplitude : float
        Peak motor speed [rad/s].
    lowest, highest : float
        Frequency at the start and at the end [Hz], below half the sampling frequency.

    Returns
    -------
    ndarray, shape (n,)
        Motor speed [rad/s] at ``k * sample_time``.

    Raises
    ------
    DriveError
        If an argument is not positive and finite, or a frequency is not below the Nyquist frequency.
    """
    time = sample_time * np.arange(sample_count(duration, sample_time))
    require_positive("amplitude", amplitude, "rad/s")
    require_frequency("lowest", lowest, sample_time)
    require_frequency("highest", highest, sample_time)
    rate = (highest - lowest) / duration
    return amplitude * np.sin(2.0 * np.pi * (lowest + 0.5 * rate * time) * time)


def prbs(
    duration: float,
    sample_time: float,
    amplitude: float,
    hold_time: float,
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """Return a random binary signal with zero mean, the identification signal of section 4.

    The paper says "5 Hz" without further explanation: clocked at 5 Hz it holds 200 ms, at a fundamental of 5 Hz 100 ms.
    Identifying a 25 Hz bandwidth needs a hold of 10 to 50 ms; a 200 ms hold leaves the response at 25 Hz several times
    less certain. Half of the holds are positive, in random order, so that the mean is zero and the piston returns (to
    within one hold, if their number is odd or the last is cut short).

    Parameters
    ----------
    duration, sample_time : float
        Length of the signal and time between samples [s].
    amplitude : float
        Magnitude of the motor speed, held with either sign [rad/s].
    hold_time : float
        Time between chances to switch [s], rounded to whole samples.
    rng : numpy.random.Generator
        Source of the order.

    Returns
    -------
    ndarray, shape (n,)
        Motor speed [rad/s] at ``k * sample_time``.

    Raises
    ------
    DriveError
        If an argument is not positive and finite, or the hold is shorter than a sample.
    """
    count = sample_count(duration, sample_time)
    require_positive("amplitude", amplitude, "rad/s")
    require_positive("hold_time", hold_time, "s")
    if hold_time < sample_time * (1.0 - LIMIT_SLACK):
        raise DriveError(f"hold_time must be at least the sample time {sample_time:g} s, got {hold_time:g} s")
    samples_held = round(min(hold_time / sample_time, count))
    holds = ceil(count / samples_held)
    first = amplitude * float(rng.choice((-1.0, 1.0)))
    held = rng.permutation(np.where(np.arange(holds) % 2 == 0, first, -first))
    return np.repeat(held, samples_held)[:count]


def nine_steps(
    duration: float,
    sample_time: float,
    parameters: EhaParameters,
    rng: np.random.Generator,
    lowest_volts: float = 2.5,
    highest_volts: float = 4.0,
) -> NDArray[np.float64]:
    """Return nine steps of random magnitude and alternating direction, the validation signal of section 6.

    The first is positive; the paper switches direction after each step because the stroke is limited.

    Parameters
    ----------
    duration, sample_time : float
        Length of the signal and time between samples [s].
    parameters : EhaParameters
        The actuator, for its motor speed per volt.
    rng : numpy.random.Generator
        Source of the magnitudes.
    lowest_volts, highest_volts : float
        Bounds of the uniform magnitude [V].

    Returns
    -------
    ndarray, shape (n,)
        Motor speed [rad/s] at ``k * sample_time``.

    Raises
    ------
    DriveError
        If an argument is not positive and finite, the bounds are reversed, or there are fewer samples than
        steps.
    """
    count = sample_count(duration, sample_time)
    require_positive("lowest_volts", lowest_volts, "V")
    require_positive("highest_volts", highest_volts, "V")
    if lowest_volts > highest_volts:
        raise DriveError(f"lowest_volts must not exceed highest_volts {highest_volts:g} V, got {lowest_volts:g} V")
    if count < STEPS:
        raise DriveError(f"nine steps need at least {STEPS} samples, got {count}")
    volts = rng.uniform(lowest_volts, highest_volts, STEPS)
    directions = np.where(np.arange(STEPS) % 2 == 0, 1.0, -1.0)
    which = np.arange(count) * STEPS // count
    return (parameters.motor_speed_per_volt * volts * directions)[which]


def multisine(
    duration: float,
    sample_time: float,
    amplitude: float,
    rng: np.random.Generator,
    lowest: float = 0.5,
    highest: float = 30.0,
    period: float = 2.0,
) -> NDArray[np.float64]:
    """Return a periodic sum of equal sines at every multiple of ``1 / period`` in a band.

    Schroeder's phases (IEEE Transactions on Information Theory 16, 1970, page 85) keep the peak low for the power, so
    that the drive stays out of the dead zone; the generator picks the point of the period at which the signal starts.

    Parameters
    ----------
    duration, sample_time : float
        Length of the signal and time between samples [s].
    amplitude : float
        Peak motor speed [rad/s].
    rng : numpy.random.Generator
        Source of the starting point.
    lowest, highest : float
        Band [Hz], below half the sampling frequency.
    period : float
        Period [s]; a whole number of periods in the duration avoids leakage in a Fourier transform.

    Returns
    -------
    ndarray, shape (n,)
        Motor speed [rad/s] at ``k * sample_time``.

    Raises
    ------
    DriveError
        If an argument is not positive and finite, a frequency is not below the Nyquist frequency, or no
        multiple of ``1 / period`` lies in the band.
    """
    count = sample_count(duration, sample_time)
    require_positive("amplitude", amplitude, "rad/s")
    require_positive("period", period, "s")
    require_frequency("lowest", lowest, sample_time)
    require_frequency("highest", highest, sample_time)
    first, last = ceil(lowest * period * (1.0 - LIMIT_SLACK)), int(highest * period * (1.0 + LIMIT_SLACK))
    if first > last:
        raise DriveError(
            f"the band must hold a multiple of 1/period {1.0 / period:g} Hz, got {lowest:g} to {highest:g} Hz"
        )
    lines = np.arange(first, last + 1)
    order = np.arange(len(lines))
    phases = -np.pi * order * (order + 1) / len(lines)
    angle = 2.0 * np.pi * (sample_time * np.arange(count) / period + rng.uniform())
    total = np.zeros(count)
    for line, phase in zip(lines, phases, strict=True):
        total += np.cos(line * angle + phase)
    return amplitude * total / np.max(np.abs(total))


DRIVES: Mapping[str, Drive] = {
    "sine": lambda duration, sample_time, p, _: sine(duration, sample_time, p.rated_speed),
    "prbs": lambda duration, sample_time, p, rng: prbs(duration, sample_time, p.rated_speed, HOLD_TIME, rng),
    "steps": nine_steps,
    "chirp": lambda duration, sample_time, p, _: chirp(duration, sample_time, p.rated_speed),
    "multisine": lambda duration, sample_time, p, rng: multisine(duration, sample_time, p.rated_speed, rng),
}
"""The drives by name, at the paper's 4 V."""


def make_drive(
    name: str, duration: float, sample_time: float, parameters: EhaParameters, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Return a named drive at the paper's 4 V, checked against the actuator's limits.

    Parameters
    ----------
    name : str
        One of `DRIVES`.
    duration, sample_time : float
        Length of the signal and time between samples [s].
    parameters : EhaParameters
        The actuator.
    rng : numpy.random.Generator
        Source of the drive's randomness.

    Returns
    -------
    ndarray, shape (n,)
        Motor speed [rad/s] at ``k * sample_time``.

    Raises
    ------
    DriveError
        If the name is unknown, the times are unusable, or the actuator's speed or stroke would be exceeded.

    Examples
    --------
    >>> speed = make_drive("sine", 1.0, 1e-3, EhaParameters(), np.random.default_rng(0))
    >>> len(speed), round(float(speed.max()), 2)
    (1000, 125.66)
    """
    require_known("drive", name, DRIVES, DriveError)
    speed = DRIVES[name](duration, sample_time, parameters, rng)
    check_drive(speed, sample_time, parameters)
    return speed
