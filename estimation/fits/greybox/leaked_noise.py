"""`encoder_noise(position, ...) -> LeakedNoise`: an encoder's noise in means of an output that follows and loses it."""

import math
from dataclasses import dataclass

import numpy as np

from estimation.arrays import Array
from estimation.fits.convolution import smooth_length
from estimation.log_checks.bridging import bridged

MOST_LOST = 500.0
"""Losses beyond which nothing is left from one sample to the next, lest exponentials overflow [dimensionless]."""

LEAST_LOST = 1e-6
"""Losses below which all is kept [dimensionless]."""

HARMONICS = 6
"""Harmonics of an encoder's steps whose errors may repeat; those above count as white, a tenth of the variance."""

LAGS = 8
"""Blocks over which errors of an encoder are looked at for a likeness [count]; what is alike beyond does not change
within a block, and is lost."""

UNEVEN = 0.02
"""Mean distance of readings from multiples of a step from which they are none [steps]; a continuous one's is 0.25."""

READ = 3
"""Blocks over which an encoder's reading is averaged to tell where it is within a step [count]; judged. Over one, what
a steady piston reads differs by half a step from mean to mean; over more, it may turn round meanwhile."""

FREQUENCIES = 256
"""Frequencies at which their spectrum is taken [count]."""


@dataclass(frozen=True, eq=False)
class LeakedNoise:
    """What losses leave of a driving channel's noise in means of an output that follows its changes at once.

    The output loses ``1 - a`` of itself from sample to sample; between samples the drive is on a straight line. With
    white noise, means of ``n`` samples have ``2 (1 - a^n) / (1 - a^2) / n`` times the variance that they have without
    losses. Errors of a quantised position are not white: at a steady speed each may be like the one before.

    Parameters
    ----------
    cosines : ndarray, shape (frequencies,)
        Of the frequencies times the sample time [dimensionless].
    powers : ndarray, shape (frequencies,)
        What the noise puts into means at each, for an output that forgets all from sample to sample, over the variance
        of means of white noise [dimensionless].
    """

    cosines: Array
    powers: Array

    def kept(self, lost: float) -> tuple[float, float]:
        """Return what losses leave of the noise.

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
    """Return what losses leave of white noise in means.

    Parameters
    ----------
    samples : int
        Samples a mean [count].
    every : int
        One in how many of these the output has [count]. Losses even out less of the noise of few.

    Returns
    -------
    LeakedNoise
        Of a channel whose errors do not repeat.

    Examples
    --------
    >>> [round(number, 3) for number in white_noise(10).kept(0.1)]
    [0.795, -0.21]
    >>> round(white_noise(10, every=5).kept(0.1)[0], 3)
    0.959
    """
    return _leaked(np.ones(1), samples, every)


def encoder_noise(
    position: Array, pumped: Array, variance: float, averaged: int, samples: int, every: int = 1
) -> LeakedNoise:
    """Return what losses leave of an encoder's noise in means.

    At a position that noise before the encoder blurs by ``s``, the ``k``-th harmonic of the error of a step ``q`` has a
    variance of ``q^2 / (2 (pi k)^2)``, of which ``exp(-(2 pi k s / q)^2)`` goes with the position (Widrow and Kollar
    2008, Quantization Noise, chapter 4) and the rest is white. Where the piston is comes from the log itself: what is
    quick is as the pump moves it, the rest as it is read.

    Parameters
    ----------
    position : ndarray, shape (n,)
        As the encoder reads it; NaN is missing [m].
    pumped : ndarray, shape (n,)
        As the pump would move the piston [m].
    variance : float
        Of its noise [m^2].
    averaged : int
        Samples that were averaged to one of the driving channel [count].
    samples : int
        Of these, a mean of the output [count].
    every : int
        One in how many of these the output has, see `white_noise` [count].

    Returns
    -------
    LeakedNoise
        As the log's own motion makes it.
    """
    step, block = _step(position), averaged * samples
    if not step or len(position) <= 2 * READ * block:
        return white_noise(samples, every)
    of_steps = min(step**2 / (12.0 * variance), 1.0)  # of the variance
    blurred = (1.0 / of_steps - 1.0) / 12.0
    course = _course(bridged(position), pumped, READ * block) / step
    lags = min(LAGS * block, len(course) // 2)
    alike = np.zeros(lags)
    for k in range(1, HARMONICS + 1):
        share = float(np.exp(-((2.0 * np.pi * k) ** 2) * blurred)) / (2.0 * (np.pi * k) ** 2)
        if share > 1e-3:
            alike += 12.0 * of_steps * share * _likeness(np.exp(2j * np.pi * k * course), lags)
    alike = (alike - alike[-1]) * (1.0 - np.arange(lags) / lags)
    alike[0] = 1.0
    within = np.convolve(np.ones(averaged), np.ones(averaged)) / averaged  # means of samples
    both = np.convolve(np.concatenate([alike[:0:-1], alike]), within)
    return _leaked(both[len(both) // 2 :: averaged], samples, every)


def _step(position: Array) -> float:
    """Return the step of an encoder; 0 where its readings are no multiples of one."""
    moved = np.abs(np.diff(position))
    moved = moved[moved > 0.0]
    if not len(moved):
        return 0.0
    step = float(np.min(moved))
    multiples = moved / step
    return step if np.mean(np.abs(multiples - np.round(multiples))) < UNEVEN else 0.0


def _course(position: Array, pumped: Array, over: int) -> Array:
    """Return where a piston is, by the pump and running means of what else moves it over an odd number of samples."""
    over += 1 - over % 2
    beside = position - pumped
    sums = np.cumsum(np.concatenate([[0.0], beside - beside[0]]))
    return pumped[over // 2 : len(pumped) - over // 2] + (sums[over:] - sums[:-over]) / over


def _likeness(turned: Array, lags: int) -> Array:
    """Return the real autocorrelation of a course of unit vectors [dimensionless]."""
    count = len(turned)
    length = smooth_length(count + lags, (2, 3, 5))
    spectrum = np.fft.fft(turned, length)
    return np.fft.ifft(spectrum.real**2 + spectrum.imag**2).real[:lags] / (count - np.arange(lags))


def _leaked(alike: Array, samples: int, every: int) -> LeakedNoise:
    """Return what losses leave of noise whose autocorrelation is given from lag zero on."""
    count = max(1, round(samples / every))
    frequency = np.pi * (np.arange(FREQUENCIES) + 0.5) / FREQUENCIES
    spectrum = alike[0] + 2.0 * np.cos(np.outer(frequency, np.arange(1, len(alike)))) @ alike[1:]
    passed = 4.0 * np.sin(0.5 * count * every * frequency) ** 2 / (count * FREQUENCIES)
    passed *= (np.sin(0.5 * frequency) / np.sin(0.5 * every * frequency)) ** 2
    return LeakedNoise(np.cos(frequency), np.maximum(spectrum, 0.0) * passed)
