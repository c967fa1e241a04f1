"""Measurement noise determined from the log itself, not taken as published (errata E11)."""

from collections.abc import Callable, Mapping, Sequence
from hashlib import sha1
from math import comb, exp, log

import numpy as np

from estimation.log_checks.channel_names import POSITION, PRESSURE, VELOCITY
from estimation.log_checks.order import median, stacked
from plant.arrays import Array
from plant.log.record import Record

SMALLEST_VARIANCE: Mapping[str, float] = {
    POSITION: 1e-12,
    VELOCITY: 1e-10,
    PRESSURE: 1e2,
}
"""Least variance that a filter is given [SI squared]: the paper's R for position (equation 7.7), and for the others
well below any bench sensor, so that a noiseless simulation stays solvable."""

NORMAL_MAD = 1.482602218505602
"""Standard deviation of a normal variable over its median absolute deviation."""

MOST_CACHED = 32
"""Variances that are cached, by content [count]."""

ROUNDING = 1e-12
"""Share of a channel's largest value up to which a step is due to floating-point rounding [fraction]."""


def measurement_variances(record: Record, channels: Sequence[str]) -> Mapping[str, float]:
    """Estimate each channel's measurement variance from its second differences.

    A second difference removes everything smooth and has six times the variance of white noise. Its median absolute
    deviation ignores the moments at which the piston really jumps. Where the mean square of small differences agrees
    with it, that is used instead, because it scatters less. Differences of rounded values are whole steps, and
    so would be their median; it is interpolated within its step. A channel that mostly repeats its last value counts as
    quantised: its variance is the mean square of its small differences, and at least one twelfth of the squared
    quantum.

    Returns
    -------
    Mapping[str, float]
        Variance [SI squared] by channel.

    Examples
    --------
    >>> import numpy as np
    >>> noise = np.random.default_rng(1).normal(0.0, 1e-3, 20_000)
    >>> log = Record(1e-3, {"velocity_m_s": 0.04 * np.sin(np.arange(20_000) * 1e-2) + noise})
    >>> round(measurement_variances(log, ["velocity_m_s"])["velocity_m_s"] * 1e6, 1)
    1.0
    """
    return {channel: _cached_variance(_variance, record[channel], channel) for channel in channels}


def _cached_variance(variance: Callable[..., float], values: Array, *more: str) -> float:
    """Return a variance of a channel, computed once for all checks and fits that need it."""
    content = np.ascontiguousarray(values, dtype=np.float64)
    key = (variance.__name__, sha1(content.data, usedforsecurity=False).digest(), len(content), *more)
    found = _cache.get(key)
    if found is None:
        if len(_cache) >= MOST_CACHED:
            _cache.clear()
        found = _cache[key] = variance(content, *more)
    return found


_cache: dict[tuple[object, ...], float] = {}


def _variance(values: Array, channel: str) -> float:
    values = values[np.isfinite(values)]  # a slow sensor never has three samples in a row
    bends = np.diff(values, n=2)
    rounded = rounded_variance(values)
    smallest = max(SMALLEST_VARIANCE.get(channel, 0.0), rounded)
    if not len(bends):
        return smallest
    return float(max(_variance_from_differences(bends - median(bends), _step(values), 6), smallest))


COARSE, NEAR = 1.5, 4.0
"""Step of a converter over the noise from which the noise depends on the signal's place between two steps, and
deviations within which the mean square of differences is used then [dimensionless]. At two deviations the median is 7 %
off, the mean square 2 %."""


SMALL, SMALL_SHARE = 3.0, 0.97334
"""Deviations up to which differences are small, and the mean square of normal differences up to there over their
variance [dimensionless]."""

AGREEMENT = 8.0
"""Logarithm of the ratio of two variances up to which they agree, times the root of the number of differences
[dimensionless]. For white noise, the variances by the median of second differences and by the mean square of the small
ones scatter by 2.9 and 2.1 over that root, and this logarithm by 1.9, of sixth differences by 2.2."""

REPEATS = 3
"""Times that the limit of small differences is set anew from their mean square [count]; it then moves by less than
0.1 %."""


def _variance_from_differences(bends: Array, step: float, gain: int) -> float:
    """Return the variance of white noise from that of its differences, which is ``gain`` times as large."""
    sizes = np.abs(bends)
    deviation = NORMAL_MAD * _grouped_median(sizes, step)
    if step * gain**0.5 > COARSE * deviation > 0.0:
        near = bends[sizes <= NEAR * deviation]
        return float(np.mean(near * near)) / gain
    squares, variance = bends * bends, deviation**2
    for _ in range(REPEATS if variance > 0.0 else 0):
        small = squares[squares <= SMALL**2 * variance]
        variance = float(np.mean(small)) / SMALL_SHARE
    # sudden changes and fast motion leave differences that are not normal, and only the median withstands them
    agrees = variance > 0.0 and abs(log(variance / deviation**2)) * len(bends) ** 0.5 < AGREEMENT
    return (variance if agrees else deviation**2) / gain


def _grouped_median(sizes: Array, step: float) -> float:
    """Return the median of sizes that were rounded to steps, each uniform within half a step of its value.

    If more than half are zero, the median is zero: the differences are smaller than a step shows.
    """
    middle = median(sizes)
    same = np.count_nonzero(np.abs(sizes - middle) < 0.25 * step)
    if same == 0 or middle < 0.25 * step:
        return middle
    low = max(middle - 0.5 * step, 0.0)
    below = np.count_nonzero(sizes <= middle - 0.25 * step)
    return low + (middle + 0.5 * step - low) * (0.5 * len(sizes) - below) / same


def _step(values: Array) -> float:
    """Return the smallest step of a channel above floating-point rounding."""
    steps = np.abs(np.diff(values))
    return float(np.min(steps[steps > ROUNDING * np.max(np.abs(values), initial=0.0)], initial=np.inf))


def is_coarse(values: Array, variance: float) -> bool:
    """Return whether a channel's quantisation is too coarse for its noise to average out.

    The reading of a constant signal between two steps is then wrong by the same share of a step in each sample.

    Parameters
    ----------
    values : ndarray, shape (n,)
        The channel, in any unit; NaN where missing.
    variance : float
        Variance of its noise, rounding included [unit of the channel squared].

    Returns
    -------
    bool
        Whether it is; see `COARSE`.

    Examples
    --------
    >>> noise = np.random.default_rng(1).normal(0.3, 0.3, 20_000)
    >>> is_coarse(np.round(noise), 0.3**2 + 1.0 / 12.0), is_coarse(np.round(3.0 * noise), 0.9**2 + 1.0 / 12.0)
    (True, False)
    """
    return _step(values[np.isfinite(values)]) > COARSE * variance**0.5


def _quantum(values: Array) -> float:
    """Return the smallest step of a channel that is mostly constant; 0 for any other."""
    steps = np.abs(np.diff(values))
    moved = steps[steps > 0.0]
    held = np.count_nonzero(steps == 0.0)
    return float(np.min(moved)) if held > len(moved) > 0 else 0.0


FLICKER = 2.5
"""Second differences up to which a quantised channel is at rest, over its quantum [dimensionless]: one that flickers
between two levels has differences of one and of two."""


def rounded_variance(values: Array) -> float:
    """Return the variance of a mostly constant channel, from its flicker between levels; 0 for others.

    Noise of a third of a quantum rarely changes the reading, so the median of its differences is zero, while the noise
    of the reading is a fifth larger than rounding alone.

    Parameters
    ----------
    values : ndarray, shape (n,)
        The channel, in any unit; NaN where missing.

    Returns
    -------
    float
        Variance [unit of the channel squared].

    Examples
    --------
    >>> noise = np.random.default_rng(1).normal(0.3, 0.3, 20_000)
    >>> bool(0.35 < rounded_variance(np.round(noise)) ** 0.5 < 0.50), rounded_variance(noise)
    (True, 0.0)
    """
    values = values[np.isfinite(values)]
    quantum = _quantum(values)
    bends = np.abs(np.diff(values, n=2)) if quantum > 0.0 else np.zeros(0)
    flickers = bends[bends <= FLICKER * quantum]
    return max(quantum**2 / 12.0, float(np.mean(flickers**2)) / 6.0 if len(flickers) else 0.0)


DIFFERENCE_ORDER = 6
"""Order of the differences that remove a motion: at 1 kHz a ringing of 50 Hz is reduced to 0.1 %, while a second
difference keeps 10 % of it and takes that for noise."""

WINDOW = 200
"""Samples over which noise is averaged; the median of such windows is used, so that those with an impact on the piston
do not count."""


def position_variance(position: Array) -> float:
    """Return a position sensor's own variance, without the floor for filters.

    Slow motion does not count; the least value is one twelfth of an encoder's squared quantum.

    Parameters
    ----------
    position : ndarray, shape (n,)
        Position [m]; NaN where missing.

    Returns
    -------
    float
        Variance [m^2].

    Examples
    --------
    >>> import numpy as np
    >>> time = 1e-3 * np.arange(20_000)
    >>> ringing = 1e-3 * np.sin(2.0 * np.pi * 50.0 * time)
    >>> noise = np.random.default_rng(1).normal(0.0, 1e-5, 20_000)
    >>> round(position_variance(ringing + noise) * 1e10, 1)
    1.0
    >>> walked = np.round(np.linspace(0.0, 1e-3, 5000) / 1e-6) * 1e-6
    >>> round(position_variance(walked) * 12e12, 3)
    1.0
    """
    return _cached_variance(_position_variance, position)


def excited_noise_variance(values: Array) -> float:
    """Return the variance of a channel's noise if a drive excites it every few samples.

    The ringing of stiff oil is so fast that second differences contain as much of it as of the noise; the median of
    sixth differences contains a tenth of that or less.

    Parameters
    ----------
    values : ndarray, shape (n,)
        The channel, in any unit; NaN where missing.

    Returns
    -------
    float
        Variance [unit of the channel squared]; infinite if more than half of the differences are zero.

    Examples
    --------
    >>> time = 1e-3 * np.arange(20_000)
    >>> ringing = np.sin(2.0 * np.pi * 60.0 * time)
    >>> noise = np.random.default_rng(1).normal(0.0, 0.01, 20_000)
    >>> round(excited_noise_variance(ringing + noise) * 1e4, 1)
    1.0
    """
    return _cached_variance(_excited_noise_variance, values)


LOWER_BY_CHANCE = 5.0
"""Logarithm of the ratio of the variances by second and by sixth differences up to which they differ by chance, times
the root of the number of samples [dimensionless]. For white noise it scatters by 1.3, seldom by up to 8."""


def noise_behind_motion(values: Array, variance: float) -> float:
    """Return the variance of a channel's noise, without fast motion if second differences contain it.

    The lower of two variances would be too low by chance in a short log.

    Parameters
    ----------
    values : ndarray, shape (n,)
        The channel, in any unit; NaN where missing.
    variance : float
        The variance by second differences, see `measurement_variances` [unit of the channel squared].

    Returns
    -------
    float
        The variance by sixth differences if it is lower by more than chance, else ``variance`` [unit of the channel
        squared].

    Examples
    --------
    >>> noise = np.random.default_rng(1).normal(0.0, 1.0, 20_000)
    >>> noise_behind_motion(noise, 1.03), round(noise_behind_motion(noise, 1.5), 1)
    (1.03, 1.0)
    """
    excited, samples = excited_noise_variance(values), int(np.count_nonzero(np.isfinite(values)))
    return excited if excited < variance * exp(-LOWER_BY_CHANCE / max(samples, 1) ** 0.5) else variance


def _excited_noise_variance(values: Array) -> float:
    bends = np.diff(values, n=DIFFERENCE_ORDER)
    bends = bends[np.isfinite(bends)]  # differences across missing samples would include the ringing
    found = (
        _variance_from_differences(
            bends, _step(values[np.isfinite(values)]), comb(2 * DIFFERENCE_ORDER, DIFFERENCE_ORDER)
        )
        if len(bends)
        else 0.0
    )
    return max(found if found > 0.0 else np.inf, rounded_variance(values))


def _position_variance(position: Array) -> float:
    position = position[np.isfinite(position)]  # a slow sensor never has seven samples in a row
    bends, steps = np.diff(position, n=DIFFERENCE_ORDER), np.abs(np.diff(position))
    moved = steps[steps > 0.0]
    if not (len(bends) and len(moved)):
        return SMALLEST_VARIANCE[POSITION]
    powers = [np.mean(part**2, axis=1) for part in stacked(bends, max(1, len(bends) // WINDOW))]
    variance = median(np.concatenate(powers)) / comb(2 * DIFFERENCE_ORDER, DIFFERENCE_ORDER)
    return float(max(variance, np.min(moved) ** 2 / 12.0))
