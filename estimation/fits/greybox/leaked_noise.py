"""`encoder_noise(position, ...) -> LeakedNoise`: encoder noise in means of an output that follows it and leaks."""

import math
from dataclasses import dataclass

import numpy as np

from estimation.arrays import Array
from estimation.fits.convolution import smooth_length
from estimation.log_checks.bridging import bridged

MOST_LOST = 500.0
"""Loss above which nothing remains from one sample to the next, so that exponentials do not overflow
[dimensionless]."""

LEAST_LOST = 1e-6
"""Loss below which everything remains [dimensionless]."""

HARMONICS = 6
"""Harmonics of an encoder's steps whose errors may repeat; higher ones, a tenth of the variance, count as white."""

LAGS = 8
"""Blocks over which the autocorrelation of encoder errors is computed [count]. A longer correlation is constant within
a block, and leaks off."""

MOST_UNEVEN = 0.02
"""Mean distance of readings from multiples of a step above which the encoder has no steps [steps]; that of a continuous
one is 0.25."""

BLOCKS_PER_READING = 3
"""Blocks over which an encoder's reading is averaged to find its place within a step [count]; judged. Over one, the
mean of a steady piston changes by half a step from block to block; over more, the piston may reverse in between."""

FREQUENCIES = 256
"""Frequencies of their spectrum [count]."""


@dataclass(frozen=True, eq=False)
class LeakedNoise:
    """Encoder noise that remains in means of a leaking output which follows its changes at once.

    The output loses ``1 - a`` of itself from sample to sample; between samples the drive is a straight line. With white
    noise, means of ``n`` samples have ``2 (1 - a^n) / (1 - a^2) / n`` times the variance that they have without losses.
    Errors of a quantised position are not white: at a steady speed each may be like the one before.

    Parameters
    ----------
    cosines : ndarray, shape (frequencies,)
        Cosines of the frequencies times the sample time [dimensionless].
    powers : ndarray, shape (frequencies,)
        Noise power in means at each frequency, for an output that forgets everything from sample to sample, over the
        variance of means of white noise [dimensionless].
    """

    cosines: Array
    powers: Array

    def remaining_noise(self, lost: float) -> tuple[float, float]:
        """Return the noise that remains after losses.

        Parameters
        ----------
        lost : float
            Sample time over the time constant of the loss [dimensionless].

        Returns
        -------
        tuple of float
            Standard deviation of means over that of white noise without losses, and the derivative of its logarithm by
            that of ``lost`` [dimensionless].
        """
        lost = max(lost, LEAST_LOST)
        kept = math.exp(-min(lost, MOST_LOST))
        gain = -math.expm1(-min(lost, MOST_LOST)) / lost
        beside = 1.0 - 2.0 * kept * self.cosines + kept**2
        passed = self.powers / beside
        variance = float(np.sum(passed))
        bent = float(np.sum(passed * (kept - self.cosines) / beside)) * kept / variance
        return gain * variance**0.5, kept / gain - 1.0 + lost * bent


def white_noise(samples: int, every: int = 1) -> LeakedNoise:
    """Return white noise that remains in means after losses.

    Parameters
    ----------
    samples : int
        Samples per mean [count].
    every : int
        The output has one of so many samples [count]. Losses even out less of the noise if there are few.

    Returns
    -------
    LeakedNoise
        For a channel whose errors do not repeat.

    Examples
    --------
    >>> [round(number, 3) for number in white_noise(10).remaining_noise(0.1)]
    [0.795, -0.21]
    >>> round(white_noise(10, every=5).remaining_noise(0.1)[0], 3)
    0.959
    """
    return _noise_after_losses(np.ones(1), samples, every)


def encoder_noise(
    position: Array, pumped: Array, variance: float, averaged: int, samples: int, every: int = 1
) -> LeakedNoise:
    """Return encoder noise that remains in means after losses.

    Noise ``s`` before the encoder blurs its steps ``q``. The ``k``-th harmonic of the quantisation error has a variance
    of ``q^2 / (2 (pi k)^2)``, of which ``exp(-(2 pi k s / q)^2)`` depends on position and the rest is white (Widrow and
    Kollar 2008, Quantization Noise, chapter 4). The position is found from the log itself: fast motion from the pump,
    slow motion from the readings.

    Parameters
    ----------
    position : ndarray, shape (n,)
        As the encoder reads it; NaN is missing [m].
    pumped : ndarray, shape (n,)
        Piston position according to the pump [m].
    variance : float
        Variance of its noise [m^2].
    averaged : int
        Samples averaged into one of the driving channel [count].
    samples : int
        Of these, samples per mean of the output [count].
    every : int
        The output has one of so many, see `white_noise` [count].

    Returns
    -------
    LeakedNoise
        For the motion in this log.
    """
    step, block = _step(position), averaged * samples
    if not step or len(position) <= 2 * BLOCKS_PER_READING * block:
        return white_noise(samples, every)
    of_steps = min(step**2 / (12.0 * variance), 1.0)  # share of rounding in the variance
    blurred = (1.0 / of_steps - 1.0) / 12.0
    course = _piston_position(bridged(position), pumped, BLOCKS_PER_READING * block) / step
    lags = min(LAGS * block, len(course) // 2)
    alike = np.zeros(lags)
    for k in range(1, HARMONICS + 1):
        share = float(np.exp(-((2.0 * np.pi * k) ** 2) * blurred)) / (2.0 * (np.pi * k) ** 2)
        if share > 1e-3:
            alike += 12.0 * of_steps * share * _autocorrelation(np.exp(2j * np.pi * k * course), lags)
    alike = (alike - alike[-1]) * (1.0 - np.arange(lags) / lags)
    alike[0] = 1.0
    # triangular weights of the autocorrelation for means of samples
    within = np.convolve(np.ones(averaged), np.ones(averaged)) / averaged
    both = np.convolve(np.concatenate([alike[:0:-1], alike]), within)
    return _noise_after_losses(both[len(both) // 2 :: averaged], samples, every)


def _step(position: Array) -> float:
    """Return the step of an encoder; 0 if its readings are not multiples of one."""
    moved = np.abs(np.diff(position))
    moved = moved[moved > 0.0]
    if not len(moved):
        return 0.0
    step = float(np.min(moved))
    multiples = moved / step
    return step if np.mean(np.abs(multiples - np.round(multiples))) < MOST_UNEVEN else 0.0


def _piston_position(position: Array, pumped: Array, over: int) -> Array:
    """Return the piston's position: motion by the pump, plus a running mean of the rest over an odd count."""
    over += 1 - over % 2
    beside = position - pumped
    sums = np.cumsum(np.concatenate([[0.0], beside - beside[0]]))
    return pumped[over // 2 : len(pumped) - over // 2] + (sums[over:] - sums[:-over]) / over


def _autocorrelation(turned: Array, lags: int) -> Array:
    """Return the real part of the autocorrelation of a series of unit vectors [dimensionless]."""
    count = len(turned)
    length = smooth_length(count + lags, (2, 3, 5))
    spectrum = np.fft.fft(turned, length)
    return np.fft.ifft(spectrum.real**2 + spectrum.imag**2).real[:lags] / (count - np.arange(lags))


def _noise_after_losses(alike: Array, samples: int, every: int) -> LeakedNoise:
    """Return noise that remains after losses, given its autocorrelation from lag zero on."""
    count = max(1, round(samples / every))
    frequency = np.pi * (np.arange(FREQUENCIES) + 0.5) / FREQUENCIES
    spectrum = alike[0] + 2.0 * np.cos(np.outer(frequency, np.arange(1, len(alike)))) @ alike[1:]
    passed = 4.0 * np.sin(0.5 * count * every * frequency) ** 2 / (count * FREQUENCIES)
    passed *= (np.sin(0.5 * frequency) / np.sin(0.5 * every * frequency)) ** 2
    return LeakedNoise(np.cos(frequency), np.maximum(spectrum, 0.0) * passed)
