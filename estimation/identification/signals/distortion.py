"""Best linear approximation from a periodic multisine, with levels of noise and nonlinear distortion beside it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import stdtrit

from estimation.arrays import Array, BoolArray, IntArray
from estimation.identification.signals.local_polynomial import ComplexArray, FrequencyResponse, without_gaps
from estimation.identification.signals.period import find_period
from plant.errors import HydrostateError

EXCITED_AMPLITUDE = 1e-3
"""Amplitude of a line over the largest, above which it is excited [fraction]."""

NEIGHBOURS = 15
"""Detection lines whose mean power is used for the distortion of an excited line."""

PARTS = 8
"""Parts of half a period, whose powers of distortion show how much a level varies from one multisine to another. High
powers of a signal have heavy tails: with few long parts the means are closer to normal."""

NEIGHBOURS_A_SIDE, POLYNOMIAL_DEGREE = 4, 2
"""Excited lines on either side over which the response is a polynomial, and its degree."""

LARGEST_EXCITED_RATIO = 2.0
"""Distortion on excited lines over that on silent ones, above which the response is not such a polynomial
[fraction]."""

LEVEL_ACCURACY = 1.0
"""Required accuracy of a level relative to its mean over multisines [dB]."""


@dataclass(frozen=True, eq=False)
class Distortion:
    """Response, noise and nonlinear distortion of a plant under a periodic multisine.

    Parameters
    ----------
    response : FrequencyResponse
        Best linear approximation at the excited lines; its variance holds noise and stochastic distortion.
    period : int
        Period of the input in samples.
    periods : int
        Whole periods that were used.
    frequency : ndarray, shape (k,)
        Lines between zero and half the sample rate [Hz].
    excited, odd : ndarray of bool, shape (k,)
        Lines that are excited; odd multiples of the lowest frequency.
    noise, power : ndarray, shape (k,)
        Variance of the noise in the mean over periods, and power of that mean [output unit squared].
    stray : ndarray of complex, shape (k,)
        Output on silent lines, and the residual of a smooth response on excited ones [output unit].
    """

    response: FrequencyResponse
    period: int
    periods: int
    frequency: Array
    excited: BoolArray
    odd: BoolArray
    noise: Array
    power: Array
    stray: ComplexArray

    def level(self, *, odd: bool) -> float:
        """Return the mean power of distortion per line, from the lines that are not excited, less noise.

        Parameters
        ----------
        odd : bool
            Of odd distortion; of even otherwise.

        Returns
        -------
        float
            Below the highest excited line [output unit squared]; NaN if all such lines are excited.
        """
        silent = _silent_lines(self.excited, self.odd == odd)
        return float(np.mean(self.power[silent] - self.noise[silent])) if silent.any() else float("nan")

    def level_interval(self, *, odd: bool, probability: float = 0.95) -> tuple[float, float]:
        """Return an interval for the mean of a level over multisines of the same lines with other phases.

        A period is a short part of a random signal: high powers of it vary from multisine to multisine by more than
        independent lines would. The variation is determined from the distortion's power in parts of the period.

        Parameters
        ----------
        odd : bool
            Of odd distortion; of even otherwise.
        probability : float
            Probability that it contains the mean [probability].

        Returns
        -------
        tuple of float
            Limits [output unit squared]; NaN if they cannot be determined.
        """
        level, reach = self.level(odd=odd), self._reach(odd, probability)
        if not np.isfinite(reach):
            return float("nan"), float("nan")
        if not level > 0.0:
            return 0.0, max(level + reach, 0.0)
        with np.errstate(over="ignore"):
            factor = float(np.exp(reach / level))
        return level / factor, level * factor

    def period_wanted(self, *, odd: bool) -> int | None:
        """Return the period for which 95 % of multisines have a level within `LEVEL_ACCURACY`; None if unknown.

        Parameters
        ----------
        odd : bool
            Of odd distortion; of even otherwise.

        Returns
        -------
        int or None
            Samples, at the same sample time and band.
        """
        level, reach = self.level(odd=odd), self._reach(odd, 0.95)
        if not (level > 0.0 and np.isfinite(reach)):
            return None
        return int(np.ceil(self.period * (10.0 / np.log(10.0) * reach / level / LEVEL_ACCURACY) ** 2))

    def _reach(self, odd: bool, probability: float) -> float:
        return float(stdtrit(PARTS - 1, 0.5 + 0.5 * probability)) * self._spread(odd)

    def _spread(self, odd: bool) -> float:
        """Return the standard deviation of a level from multisine to multisine; NaN if unknown."""
        kind = self.odd == odd
        silent = _silent_lines(self.excited, kind)
        if not self.power[silent].sum() > 0.0 or self.period // 2 < 8 * PARTS:
            return float("nan")
        driven, lines = self.excited & kind, silent.copy()
        power, count = self.power[silent], int(silent.sum())
        if driven.any():
            # if even lines were driven, the other kind of distortion would appear on excited lines too
            own = float(np.mean(np.abs(self.stray[driven]) ** 2))
            if not own <= LARGEST_EXCITED_RATIO * float(power.mean()) or (self.excited & ~kind).any():
                return float("nan")
            lines |= driven
        spectrum = np.zeros(self.period // 2 + 1, dtype=np.complex128)
        spectrum[1 + np.flatnonzero(lines)] = self.stray[lines]
        # odd lines change sign after half a period, even ones repeat themselves: the first half suffices
        signal = np.fft.irfft(spectrum, self.period)[: self.period // 2]
        parts = np.array([float(np.mean(one**2)) for one in np.array_split(signal, PARTS)])
        share = float(np.var(parts, ddof=1)) / PARTS / float(parts.mean()) ** 2
        # lines of one multisine are complex normal: the standard deviation of a power equals its mean
        lost = float(np.sum(power**2)) / 2.0 / float(power.sum()) ** 2 * (1.0 - count / int(lines.sum()))
        return float(power.mean()) * float(np.sqrt(share + lost))


def _silent_lines(excited: BoolArray, kind: BoolArray) -> BoolArray:
    highest = int(np.flatnonzero(excited)[-1])
    return kind & ~excited & (np.arange(len(excited)) < highest)


def best_linear_approximation(
    u: ArrayLike, y: ArrayLike, sample_time: float, *, period: int | None = None, settling: int = 1
) -> Distortion:
    """Separate a plant's linear behaviour, its noise and its distortion, from some periods of one multisine.

    Noise is what changes from period to period. Distortion of odd and even degree appears on odd and even lines that
    the input leaves out (Pintelon and Schoukens 2012, System Identification, section 4.3.1). A multisine of odd lines
    of which one in four is left out at random shows both; one that excites every line shows neither.

    Parameters
    ----------
    u, y : array_like, shape (n,)
        Input and output, no gaps [any unit].
    sample_time : float
        Seconds between samples [s].
    period : int, optional
        Period of the input in samples; found by default.
    settling : int
        Periods at the beginning that are left out.

    Returns
    -------
    Distortion
        Response, and levels by line.

    Raises
    ------
    HydrostateError
        If the input is not periodic, or fewer than two periods are left.
    """
    inputs, outputs = without_gaps(u, y)
    length = find_period(inputs) if period is None else period
    if length is None:
        raise HydrostateError(
            "the input does not repeat itself within half of the log: drive with a periodic multisine"
        )
    periods = len(inputs) // length - settling
    if length < 8 or periods < 2:
        raise HydrostateError(
            f"two periods of 8 samples or more are needed after {settling}, got {periods} of {length}"
        )
    first = len(inputs) - periods * length
    lines = slice(1, (length + 1) // 2)
    inside = np.fft.rfft(inputs[first:].reshape(periods, length), axis=1)[:, lines].mean(axis=0) / length
    every = np.fft.rfft(outputs[first:].reshape(periods, length), axis=1)[:, lines] / length
    mean = every.mean(axis=0)
    noise = np.sum(np.abs(every - mean) ** 2, axis=0) / (periods * (periods - 1))
    excited = np.abs(inside) > EXCITED_AMPLITUDE * np.abs(inside).max()
    number: IntArray = np.arange(1, len(mean) + 1)
    odd, frequency, power = number % 2 == 1, number / (length * sample_time), np.abs(mean) ** 2
    at = np.flatnonzero(excited)
    stray = _silent_power(excited, odd, power, at)
    # the distortion includes the noise of the lines on which it is measured
    variance = np.where(np.isnan(stray), noise[at], np.maximum(stray, noise[at])) / np.abs(inside[at]) ** 2
    freedom = periods - 1 if np.isnan(stray).all() else NEIGHBOURS
    response = FrequencyResponse(frequency[at], mean[at] / inside[at], variance, freedom)
    left = mean.copy()
    left[at] = _polynomial_residual(mean[at], inside[at])
    return Distortion(response, length, periods, frequency, excited, odd, noise, power, left)


def _silent_power(excited: BoolArray, odd: BoolArray, power: Array, at: IntArray) -> Array:
    """Return the mean power on the nearest silent lines of the same kind; NaN if there are none."""
    found = np.full(len(at), np.nan)
    for kind in (True, False):
        silent = np.flatnonzero(_silent_lines(excited, odd == kind))
        mine = np.flatnonzero(odd[at] == kind)
        if len(silent) < NEIGHBOURS:
            continue
        sums = np.concatenate([[0.0], np.cumsum(power[silent])])
        begin = np.clip(np.searchsorted(silent, at[mine]) - NEIGHBOURS // 2, 0, len(silent) - NEIGHBOURS)
        found[mine] = (sums[begin + NEIGHBOURS] - sums[begin]) / NEIGHBOURS
    return found


def _polynomial_residual(output: ComplexArray, inside: ComplexArray) -> ComplexArray:
    """Return the residual of a polynomial over neighbouring excited lines; NaN if there are too few."""
    n, span = len(output), 2 * NEIGHBOURS_A_SIDE + 1
    if n < span:
        return np.full(n, np.nan, dtype=np.complex128)
    begin = np.clip(np.arange(n) - NEIGHBOURS_A_SIDE, 0, n - span)
    places = begin[:, None] + np.arange(span)
    distance = (places - np.arange(n)[:, None]) / NEIGHBOURS_A_SIDE
    columns = distance[:, :, None] ** np.arange(POLYNOMIAL_DEGREE + 1) * inside[places][:, :, None]
    basis = np.linalg.qr(columns)[0]
    target = output[places][:, :, None]
    left = (target - basis @ (basis.conj().transpose(0, 2, 1) @ target))[:, :, 0]
    own = np.arange(n) - begin
    leverage = np.sum(np.abs(basis[np.arange(n), own]) ** 2, axis=1)
    return left[np.arange(n), own] / np.sqrt(1.0 - leverage)
