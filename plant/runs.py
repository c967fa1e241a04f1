"""Common parts of all simulated runs: sampling, the check of a drive and of the states, white noise."""

from collections.abc import Mapping
from math import ceil, isfinite

import numpy as np

from plant.arrays import Array
from plant.errors import DriveError, HydrostateError

MOST_SAMPLES = 100_000_000
"""Longest signal that is generated, in samples; a longer one is regarded as an error in a unit."""


def sample_count(duration: float, sample_time: float) -> int:
    """Return the number of samples of a signal: one every `sample_time` from zero, without the end.

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


def steps_a_sample(sample_time: float, longest_step: float) -> int:
    """Return the number of steps per sample.

    Parameters
    ----------
    sample_time : float
        Seconds between samples [s].
    longest_step : float
        Longest step [s].

    Returns
    -------
    int
        At least 1.

    Examples
    --------
    >>> steps_a_sample(1e-3, 1e-4), steps_a_sample(1e-5, 1e-4)
    (10, 1)
    """
    return max(1, ceil(sample_time / longest_step - 1e-9))


def require_positive(name: str, value: float, unit: str) -> None:
    """Refuse a number that is not positive and finite.

    Parameters
    ----------
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
    """Refuse a frequency that cannot be sampled.

    Parameters
    ----------
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


def require_drivable(frequency: float, highest: float) -> None:
    """Refuse a frequency outside the drive's range.

    Parameters
    ----------
    frequency : float
        Frequency [Hz].
    highest : float
        The drive's highest frequency [Hz].

    Raises
    ------
    DriveError
        If it is not above 0, or exceeds the highest.
    """
    if not isfinite(frequency) or not 0.0 < frequency <= highest:
        raise DriveError(f"frequency must be above 0 and at most {highest:g} Hz, got {frequency:g} Hz")


def checked_series(drive: Array) -> Array:
    """Return a drive as a series of numbers.

    Parameters
    ----------
    drive : ndarray, shape (n,)
        Drive at the samples [its own unit].

    Returns
    -------
    ndarray, shape (n,)
        The same, contiguous.

    Raises
    ------
    DriveError
        If it is not a series of at least two samples, or not finite.
    """
    series = np.ascontiguousarray(drive, dtype=np.float64)
    if series.ndim != 1 or len(series) < 2:
        raise DriveError(f"a drive must be a series of at least 2 samples, got shape {series.shape}")
    if not np.all(np.isfinite(series)):
        where = int(np.argmin(np.isfinite(series)))
        raise DriveError(f"a drive must be finite, got {series[where]} at sample {where}")
    return series


def require_finite(states: Array, sample_time: float, plant: str) -> None:
    """Refuse a run with states that are not finite.

    Parameters
    ----------
    states : ndarray, shape (n, states)
        States at the samples [SI].
    sample_time : float
        Seconds between samples [s].
    plant : str
        Name of the plant, for the message.

    Raises
    ------
    HydrostateError
        If a state is not finite; the message gives the time.
    """
    finite = np.isfinite(states).all(axis=1)
    if not finite.all():
        when = sample_time * int(np.argmin(finite))
        raise HydrostateError(f"the {plant} plant stopped being finite at {when:.4f} s: check its parameters")


def with_noise(
    truth: Mapping[str, Array], deviations: Mapping[str, float], rng: np.random.Generator | None, *, keep_truth: bool
) -> dict[str, Array]:
    """Return the sensors' log with white noise; each channel has its own random stream.

    Parameters
    ----------
    truth : Mapping[str, ndarray, shape (n,)]
        The true channels [SI].
    deviations : Mapping[str, float]
        Standard deviation of each noisy channel [its unit].
    rng : numpy.random.Generator or None
        Parent of the streams; needed unless all deviations are zero.
    keep_truth : bool
        Whether the log also holds the noiseless channels as ``true_...``.

    Returns
    -------
    dict[str, ndarray]
        The channels.

    Raises
    ------
    HydrostateError
        If noise is wanted without a generator.
    """
    channels = dict(truth)
    if any(deviations.values()):
        if rng is None:
            raise HydrostateError("a simulation needs rng for sensors with noise, got None")
        for (name, deviation), source in zip(deviations.items(), rng.spawn(len(deviations)), strict=True):
            channels[name] = truth[name] + deviation * source.standard_normal(len(truth[name]))
    return channels | ({f"true_{name}": values for name, values in truth.items()} if keep_truth else {})
