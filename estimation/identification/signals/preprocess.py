"""Preprocessing of input and output before a fit: removing means, zero-phase filtering, resampling."""

import warnings
from math import ceil

import numpy as np
from numpy.typing import ArrayLike

from estimation.arrays import Array
from estimation.fits.convolution import smooth_length
from estimation.identification.notes import IdentificationCode
from estimation.log_checks.bridging import bridged
from plant.errors import HydrostateError, LogWarning

FEWEST_SAMPLES = 4
"""A cubic needs as many."""

ANTI_ALIAS_ORDER = 8
"""Order of the Butterworth filter before decimation, run forth and back."""

ANTI_ALIAS_SHARE = 0.8
"""Its corner as a share of the new Nyquist frequency."""


def detrend(x: ArrayLike) -> Array:
    """Return the signal less its mean over the samples that are there.

    Parameters
    ----------
    x : array_like, shape (n,)
        Any signal; NaN where missing.

    Returns
    -------
    ndarray, shape (n,)
        Zero mean, NaN kept.

    Examples
    --------
    >>> detrend([1.0, 3.0]).tolist()
    [-1.0, 1.0]
    """
    values = np.asarray(x, dtype=np.float64)
    return values - np.nanmean(values)


def zero_phase_filter(
    u: ArrayLike,
    y: ArrayLike,
    sample_time: float,
    *,
    cutoff_hz: float = 30.0,
    order: int = 12,
    filter_input: bool = True,
) -> tuple[Array, Array]:
    """Low-pass input and output forth and back with one Butterworth filter (section 4 of the EHA paper).

    A linear relation between ``u`` and ``y`` survives the same filter on both. The paper filters the output
    only; that variant is ``filter_input=False`` and warns, because it moves the poles (errata E15). The
    filter makes the residual coloured: fit with ``covariance="coloured"`` afterwards.

    Parameters
    ----------
    u, y : array_like, shape (n,)
        Input and output; gaps (NaN) are bridged by straight lines for the filter, and stay gaps in the
        result.
    sample_time : float
        Seconds between samples [s].
    cutoff_hz : float
        -3 dB frequency of one pass [Hz]; two passes make it -6 dB.
    order : int
        Order of one pass; the paper's 12 is read so.
    filter_input : bool
        False leaves ``u`` as it is, as in section 4.

    Returns
    -------
    u_filtered, y_filtered : ndarray, shape (n,)
        The signals after the filter.

    Raises
    ------
    HydrostateError
        If the cutoff is not below the Nyquist frequency, the order is below 1, or the record is too short.

    Warns
    -----
    LogWarning
        If the input is not filtered.
    """
    if not filter_input:
        warnings.warn(LogWarning(IdentificationCode.OUTPUT_ALONE_FILTERED.note()), stacklevel=2)
    inputs = np.array(u, dtype=np.float64)
    filtered = _low_pass(inputs, sample_time, cutoff_hz, order) if filter_input else inputs
    return filtered, _low_pass(np.asarray(y, dtype=np.float64), sample_time, cutoff_hz, order)


def resample(x: ArrayLike, sample_time: float, new_sample_time: float) -> Array:
    """Return the signal on another sample time, beginning at the same instant.

    To a longer sample time, integer multiple or not, the signal is first low-passed without phase at 0.8 of
    the new Nyquist frequency; between samples it is interpolated by a cubic spline. Resample input and output
    alike, so that the filter cancels.

    Parameters
    ----------
    x : array_like, shape (n,)
        Any signal; NaN where missing.
    sample_time, new_sample_time : float
        Seconds between samples [s], before and after.

    Returns
    -------
    ndarray, shape (floor((n - 1) * sample_time / new_sample_time) + 1,)
        NaN where the nearest old sample is missing.

    Raises
    ------
    HydrostateError
        If a sample time is not positive, or the record is too short to filter.

    Examples
    --------
    >>> resample(np.arange(5.0), 1.0, 0.5)[:4].round(9).tolist()
    [0.0, 0.5, 1.0, 1.5]
    """
    values = np.array(x, dtype=np.float64)
    for name, value in (("sample_time", sample_time), ("new_sample_time", new_sample_time)):
        if not (np.isfinite(value) and value > 0.0):
            raise HydrostateError(f"{name} must be positive and finite, got {value!r}")
    ratio = new_sample_time / sample_time
    if np.isclose(ratio, 1.0, rtol=0.5 / max(values.size, 1), atol=0.0):
        return values
    if values.size < FEWEST_SAMPLES:
        raise HydrostateError(f"resampling needs {FEWEST_SAMPLES} samples or more, got {values.size}")
    missing = np.isnan(values)
    if ratio > 1.0:
        cutoff = ANTI_ALIAS_SHARE * 0.5 / new_sample_time
        smooth = bridged(_low_pass(values, sample_time, cutoff, ANTI_ALIAS_ORDER))
    else:
        smooth = bridged(values)
    step = float(round(ratio)) if abs(ratio - round(ratio)) * values.size < 0.5 * ratio and ratio > 1.0 else ratio
    position = step * np.arange(int(np.floor((values.size - 1) / step * (1.0 + np.finfo(float).eps))) + 1)
    nearest = np.rint(position).astype(np.intp)
    if step == round(step):
        return np.where(missing[nearest], np.nan, smooth[nearest])
    from scipy.interpolate import CubicSpline

    return np.where(missing[nearest], np.nan, CubicSpline(np.arange(values.size), smooth)(position))


def _low_pass(x: Array, sample_time: float, cutoff_hz: float, order: int) -> Array:
    nyquist = 0.5 / sample_time
    if not 0.0 < cutoff_hz < nyquist:
        raise HydrostateError(
            f"cutoff_hz must lie between 0 and the Nyquist frequency {nyquist:g} Hz, got {cutoff_hz!r}"
        )
    if order < 1:
        raise HydrostateError(f"the filter's order must be at least 1, got {order}")
    if x.size < 4 * ceil(order / 2) + 2:
        raise HydrostateError(
            f"filtering at {cutoff_hz:g} Hz, order {order}, needs more than {4 * ceil(order / 2) + 1} samples, "
            f"got {x.size}"
        )
    # the filter rings for about `order` cutoff periods; an odd extension of that length keeps the ends usable
    pad = min(ceil(order / (cutoff_hz * sample_time)), x.size - 1)
    longer = np.pad(bridged(x), pad, mode="reflect", reflect_type="odd")
    half = smooth_length(longer.size - 1, (2, 3, 5))
    there = np.pad(longer, (0, half + 1 - longer.size), mode="edge")
    # forwards and backwards, so that the ends do not meet each other
    spectrum = np.fft.rfft(np.concatenate([there, there[-2:0:-1]]))
    # two passes of a Butterworth filter, made digital by the bilinear transform: its squared gain, and no phase
    ratio = np.tan(np.linspace(0.0, 0.5 * np.pi, spectrum.size)) / np.tan(np.pi * cutoff_hz * sample_time)
    with np.errstate(over="ignore"):
        gain = 1.0 / (1.0 + ratio ** (2 * order))
    filtered = np.fft.irfft(spectrum * gain, 2 * half)[pad : pad + x.size]
    return np.where(np.isfinite(x), filtered, np.nan)
