"""Best linear approximation from a periodic multisine, with levels of noise and nonlinear distortion beside it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from estimation.arrays import Array, BoolArray, IntArray
from estimation.identification.signals.local_polynomial import FrequencyResponse
from plant.errors import HydrostateError

REPEATS = 1e-4
"""Power of an input's change over a period, over its own, up to which it repeats itself [fraction]."""

EXCITED = 1e-3
"""Amplitude of a line over the largest, from which it is driven [fraction]."""

NEIGHBOURS = 15
"""Detection lines whose mean power tells the distortion of an excited line."""


@dataclass(frozen=True, eq=False)
class Distortion:
    """What a periodic multisine tells of a plant.

    Parameters
    ----------
    response : FrequencyResponse
        Best linear approximation at the excited lines; its variance holds noise and stochastic distortion.
    period : int
        Samples after which the input repeats itself.
    periods : int
        Whole periods that were used.
    frequency : ndarray, shape (k,)
        Lines between zero and half the sample rate [Hz].
    excited, odd : ndarray of bool, shape (k,)
        Lines that are driven; odd multiples of the lowest frequency.
    noise, power : ndarray, shape (k,)
        Variance of the noise in the mean over periods, and power of that mean [output unit squared].
    """

    response: FrequencyResponse
    period: int
    periods: int
    frequency: Array
    excited: BoolArray
    odd: BoolArray
    noise: Array
    power: Array

    def level(self, *, odd: bool) -> float:
        """Return the mean power of distortion a line, by what stands on lines that are not driven, noise taken off.

        Parameters
        ----------
        odd : bool
            Of odd distortion; of even otherwise.

        Returns
        -------
        float
            Below the highest excited line [output unit squared]; NaN where all such lines are driven.
        """
        silent = _silent(self.excited, self.odd == odd)
        return float(np.mean(self.power[silent] - self.noise[silent])) if silent.any() else float("nan")


def find_period(u: ArrayLike) -> int | None:
    """Return after how many samples an input repeats itself; None where it does not within half of the log.

    Parameters
    ----------
    u : array_like, shape (n,)
        Input [any unit].

    Returns
    -------
    int or None
        The period [samples].

    Examples
    --------
    >>> find_period(np.tile([0.0, 1.0, 3.0, 2.0], 5)), find_period(np.arange(20.0))
    (4, None)
    """
    values = np.asarray(u, dtype=np.float64)
    values = values - values.mean()
    n = len(values)
    total = float(values @ values)
    if not total > 0.0 or not np.isfinite(total):
        return None
    spectrum = np.fft.rfft(values, 2 * n)
    likeness = np.fft.irfft(np.abs(spectrum) ** 2)[:n]
    squares = np.concatenate([[0.0], np.cumsum(values**2)])
    lags = np.arange(1, n // 2 + 1)
    # the power of u[k + lag] - u[k] over the samples that both have
    change = (squares[n] - squares[lags]) + squares[n - lags] - 2.0 * likeness[lags]
    same = lags[change <= 2.0 * REPEATS * (squares[n] - squares[lags])]
    return int(same[0]) if len(same) else None


def _silent(excited: BoolArray, kind: BoolArray) -> BoolArray:
    highest = int(np.flatnonzero(excited)[-1])
    return kind & ~excited & (np.arange(len(excited)) < highest)


def best_linear_approximation(
    u: ArrayLike, y: ArrayLike, sample_time: float, *, period: int | None = None, settling: int = 1
) -> Distortion:
    """Tell a plant's linear behaviour, its noise and its distortion apart from some periods of one multisine.

    Noise is what changes from period to period. Distortion of odd and even degree stands on odd and even lines that the
    input leaves out (Pintelon and Schoukens 2012, System Identification, section 4.3.1). A multisine of odd lines of
    which one in four is left out at random tells both; of one that drives every line, neither is told.

    Parameters
    ----------
    u, y : array_like, shape (n,)
        Input and output, no gaps [any unit].
    sample_time : float
        Seconds between samples [s].
    period : int, optional
        Samples after which the input repeats itself; found unless told.
    settling : int
        Periods at the beginning that are left out.

    Returns
    -------
    Distortion
        Response, levels by line.

    Raises
    ------
    HydrostateError
        If the input is not periodic, or fewer than two periods are left.
    """
    inputs, outputs = (np.asarray(one, dtype=np.float64) for one in (u, y))
    if inputs.ndim != 1 or inputs.shape != outputs.shape or not (np.isfinite(inputs) & np.isfinite(outputs)).all():
        raise HydrostateError(
            f"input and output of one length without gaps are needed, got shapes {inputs.shape} and {outputs.shape}"
        )
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
    excited = np.abs(inside) > EXCITED * np.abs(inside).max()
    number: IntArray = np.arange(1, len(mean) + 1)
    odd, frequency, power = number % 2 == 1, number / (length * sample_time), np.abs(mean) ** 2
    at = np.flatnonzero(excited)
    stray = _stray(excited, odd, power, at)
    # the distortion holds the noise of the lines on which it is seen
    variance = np.where(np.isnan(stray), noise[at], np.maximum(stray, noise[at])) / np.abs(inside[at]) ** 2
    freedom = periods - 1 if np.isnan(stray).all() else NEIGHBOURS
    response = FrequencyResponse(frequency[at], mean[at] / inside[at], variance, freedom)
    return Distortion(response, length, periods, frequency, excited, odd, noise, power)


def _stray(excited: BoolArray, odd: BoolArray, power: Array, at: IntArray) -> Array:
    """Return the mean power on the nearest lines that are not driven and of the same kind; NaN where there are none."""
    found = np.full(len(at), np.nan)
    for kind in (True, False):
        silent = np.flatnonzero(_silent(excited, odd == kind))
        mine = np.flatnonzero(odd[at] == kind)
        if len(silent) < NEIGHBOURS:
            continue
        sums = np.concatenate([[0.0], np.cumsum(power[silent])])
        begin = np.clip(np.searchsorted(silent, at[mine]) - NEIGHBOURS // 2, 0, len(silent) - NEIGHBOURS)
        found[mine] = (sums[begin + NEIGHBOURS] - sums[begin]) / NEIGHBOURS
    return found
