"""Empirical transfer function estimates: a frequency response straight from the data, with its coherence."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.signal import csd, welch
from scipy.special import ndtri

from estimation.arrays import Array, ComplexArray
from plant.errors import HydrostateError


@dataclass(frozen=True, eq=False)
class FrequencyResponse:
    """A frequency response estimated without a parametric model.

    Parameters
    ----------
    frequency_hz : ndarray, shape (k,)
        Frequencies [Hz]; those at which the input has no power are left out.
    response : ndarray of complex, shape (k,)
        Output per input [output unit per input unit].
    coherence : ndarray, shape (k,)
        Squared coherence, 0 to 1: the share of the output's power that the input explains.
    gain_std : ndarray, shape (k,)
        Standard deviation of ``|response|`` by its asymptotic variance (Bendat and Piersol, Random Data,
        9.1); the bias from smoothing over `resolution_hz` is not in it.
    resolution_hz : float, or ndarray of shape (k,)
        Width over which the estimate is smoothed [Hz]; narrower peaks are flattened. One value a frequency where the
        window was chosen locally.
    """

    frequency_hz: Array
    response: ComplexArray
    coherence: Array
    gain_std: Array
    resolution_hz: float | Array

    def gain_band(self, level: float = 0.95) -> tuple[Array, Array]:
        """Return the band that covers the gain at each frequency with a given probability.

        Parameters
        ----------
        level : float
            Probability, pointwise.

        Returns
        -------
        tuple of ndarray, shape (k,)
            Lowest and highest gain [output unit per input unit].
        """
        gain, reach = np.abs(self.response), float(ndtri(0.5 + 0.5 * level)) * self.gain_std
        return np.maximum(gain - reach, 0.0), gain + reach


def etfe(u: ArrayLike, y: ArrayLike, sample_time: float, *, lag_window: int | None = None) -> FrequencyResponse:
    """Return the empirical transfer function estimate smoothed by a Hann lag window (Blackman and Tukey).

    Parameters
    ----------
    u, y : array_like, shape (n,)
        Input and output, no gaps; means are removed.
    sample_time : float
        Seconds between samples [s].
    lag_window : int, optional
        Half length of the Hann window in lags; a twentieth of the record unless told. Longer resolves
        narrower peaks and is noisier.

    Returns
    -------
    FrequencyResponse
        At ``lag_window + 1`` frequencies from 0 to Nyquist.

    Raises
    ------
    HydrostateError
        If the arrays do not match, hold unusable values, or are too short, or the window does not fit.

    Examples
    --------
    >>> u = np.random.default_rng(1).standard_normal(4000)
    >>> estimate = etfe(u, 2.0 * u, 0.01)
    >>> bool(np.allclose(estimate.response, 2.0)), round(estimate.resolution_hz, 9)
    (True, 0.5)
    """
    inputs, outputs = checked_signals(u, y, sample_time)
    n = inputs.size
    lags = max(n // 20, 8) if lag_window is None else lag_window
    if not 1 < lags < n // 2:
        raise HydrostateError(f"lag_window must lie between 2 and half the record ({n // 2}), got {lags}")
    frequency = np.arange(lags + 1) / (2.0 * lags * sample_time)
    power_u, power_y, cross = smoothed_spectra(correlations(inputs, outputs), lags, 2 * lags)
    # the Hann window's spectrum has small negative lobes, which can dominate where a signal has hardly any power
    usable = (power_u > 0.0) & (power_y > 0.0)
    averages = n / (0.75 * lags)  # the squares of a Hann lag window, 2 * lags wide, sum to 0.75 * lags
    spectra = power_u[usable], power_y[usable], cross[usable]
    return _response(frequency[usable], *spectra, averages, 1.0 / (lags * sample_time))


def correlations(u: Array, y: Array) -> tuple[Array, Array, Array]:
    """Return circular correlations of the zero-padded signals.

    Parameters
    ----------
    u, y : ndarray, shape (n,)
        Input and output, without means.

    Returns
    -------
    tuple of ndarray, shape (2 n,)
        uu, yy and yu, lag 0 first.
    """
    spectrum_u, spectrum_y = np.fft.rfft(u, 2 * u.size), np.fft.rfft(y, 2 * u.size)
    products = (spectrum_u * np.conj(spectrum_u), spectrum_y * np.conj(spectrum_y), spectrum_y * np.conj(spectrum_u))
    uu, yy, yu = (np.fft.irfft(product) for product in products)
    return uu, yy, yu


def smoothed_spectra(
    correlations: tuple[Array, Array, Array], lags: int, size: int
) -> tuple[Array, Array, ComplexArray]:
    """Return the spectra uu, yy, yu through a Hann lag window.

    Parameters
    ----------
    correlations : tuple of ndarray, shape (2 n,)
        As `correlations` returns them.
    size : int
        Length of the transform, 2 * lags or more.

    Returns
    -------
    tuple of ndarray, shape (size // 2 + 1,)
        Up to the Nyquist frequency.
    """
    half = 0.5 * (1.0 + np.cos(np.pi * np.arange(lags) / lags))
    spectra: list[ComplexArray] = []
    for correlation in correlations:
        windowed = np.zeros(size)
        windowed[:lags] = half * correlation[:lags]
        windowed[size - lags + 1 :] = half[:0:-1] * correlation[-lags + 1 :]
        spectra.append(np.fft.rfft(windowed))
    return spectra[0].real, spectra[1].real, spectra[2]


def etfe_welch(
    u: ArrayLike, y: ArrayLike, sample_time: float, *, segment_length: int | None = None
) -> FrequencyResponse:
    """Return the frequency response by averaged Hann-windowed segments, half overlapping (Welch).

    Parameters
    ----------
    u, y : array_like, shape (n,)
        Input and output, no gaps; the mean of each segment is removed, so the response at 0 Hz is left out.
    sample_time : float
        Seconds between samples [s].
    segment_length : int, optional
        Samples a segment; a tenth of the record unless told.

    Returns
    -------
    FrequencyResponse
        At ``segment_length // 2`` frequencies above 0 up to Nyquist.

    Raises
    ------
    HydrostateError
        If the arrays do not match, hold unusable values, or are too short, or fewer than two segments fit.

    Examples
    --------
    >>> u = np.random.default_rng(1).standard_normal(4000)
    >>> bool(np.allclose(etfe_welch(u, 2.0 * u, 0.01).coherence, 1.0))
    True
    """
    inputs, outputs = checked_signals(u, y, sample_time)
    length = max(inputs.size // 10, 8) if segment_length is None else segment_length
    if not 8 <= length <= 2 * inputs.size // 3:
        raise HydrostateError(
            f"segment_length must lie between 8 and two thirds of the record, {2 * inputs.size // 3}, got {length}"
        )
    rate = 1.0 / sample_time
    frequency, power_u = welch(inputs, rate, nperseg=length, detrend=False)
    cross = csd(inputs, outputs, rate, nperseg=length, detrend=False)[1]
    power_y = welch(outputs, rate, nperseg=length, detrend=False)[1]
    usable = (power_u > 0.0) & (power_y > 0.0) & (frequency > 0.0)
    segments = 2.0 * inputs.size / length - 1.0
    averages = 9.0 / 11.0 * segments  # half-overlapping Hann segments are worth 9/11 of independent ones
    spectra = power_u[usable], power_y[usable], cross[usable]
    return _response(frequency[usable], *spectra, averages, 1.5 / (length * sample_time))


def _response(
    frequency: Array,
    power_u: Array,
    power_y: Array,
    cross: ComplexArray,
    averages: float,
    resolution: float,
) -> FrequencyResponse:
    squared = np.clip(np.abs(cross) ** 2 / (power_u * power_y), 0.0, 1.0)
    response = np.asarray(cross / power_u, dtype=np.complex128)
    return FrequencyResponse(frequency, response, squared, gain_std(response, squared, averages), resolution)


def gain_std(response: ComplexArray, squared: Array, averages: float) -> Array:
    """Return the asymptotic standard deviation of the gain (Bendat and Piersol, Random Data, 9.1).

    Parameters
    ----------
    response : ndarray of complex, shape (k,)
        Output per input [output unit per input unit].
    squared : ndarray, shape (k,)
        Squared coherence.
    averages : float
        Independent estimates averaged; a count.

    Returns
    -------
    ndarray, shape (k,)
        Standard deviation [output unit per input unit].
    """
    unexplained = (1.0 - squared) / np.maximum(squared, np.finfo(float).tiny)
    return np.abs(response) * np.sqrt(unexplained / (2.0 * averages))


def checked_signals(u: ArrayLike, y: ArrayLike, sample_time: float) -> tuple[Array, Array]:
    """Return checked signals without their means.

    Parameters
    ----------
    u, y : array_like, shape (n,)
        Input and output.
    sample_time : float
        Seconds between samples [s].

    Returns
    -------
    tuple of ndarray, shape (n,)
        Input and output.

    Raises
    ------
    HydrostateError
        If the arrays do not match, hold unusable values, or are too short.
    """
    inputs, outputs = np.asarray(u, dtype=np.float64), np.asarray(y, dtype=np.float64)
    if not (np.isfinite(sample_time) and sample_time > 0.0):
        raise HydrostateError(f"sample_time must be positive and finite, got {sample_time!r}")
    if inputs.ndim != 1 or inputs.shape != outputs.shape or inputs.size < 64:
        raise HydrostateError(
            "input and output must be one-dimensional, of one length, and 64 samples or longer, "
            f"got shapes {inputs.shape} and {outputs.shape}"
        )
    if not (np.isfinite(inputs).all() and np.isfinite(outputs).all()):
        raise HydrostateError("a frequency response needs input and output without gaps, got NaN or infinite values")
    if inputs.min() == inputs.max():
        raise HydrostateError(f"the input must vary, got the constant {inputs[0]:g}")
    return inputs - inputs.mean(), outputs - outputs.mean()
