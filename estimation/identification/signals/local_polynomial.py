"""Frequency response by the local polynomial method: leakage is modelled, so no window biases it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import fdtri

from estimation.arrays import Array, ComplexArray
from plant.errors import HydrostateError

DEGREE = 2
"""Of the polynomials that response and leakage are taken for, around each frequency."""

HALF_WIDTH = 6
"""Frequencies on either side that are taken into account; 7 degrees of freedom are left for the noise."""

EMPTY = (1e-9, 1e-12)
"""A band without input holds less than these shares of the median line and of the largest; rounding leaves 1e-15 of
the largest [fraction]."""


@dataclass(frozen=True, eq=False)
class FrequencyResponse:
    """A frequency response with what noise leaves uncertain.

    Parameters
    ----------
    frequency : ndarray, shape (k,)
        Hz.
    response : ndarray of complex, shape (k,)
        Output over input.
    variance : ndarray, shape (k,)
        Mean squared size of its error, real and imaginary part together [unit of the response, squared].
    freedom : int
        Complex degrees of freedom with which the variance is known.
    """

    frequency: Array
    response: ComplexArray
    variance: Array
    freedom: int

    def radius(self, probability: float = 0.95) -> Array:
        """Return the radius of the circle around each response that holds the truth.

        Parameters
        ----------
        probability : float
            With which it does [probability].

        Returns
        -------
        ndarray, shape (k,)
            In the unit of the response.
        """
        return np.sqrt(self.variance * float(fdtri(2, 2 * self.freedom, probability)))


def without_gaps(u: ArrayLike, y: ArrayLike) -> tuple[Array, Array]:
    """Return input and output of one log as arrays.

    Parameters
    ----------
    u, y : array_like, shape (n,)
        Input and output [any unit].

    Returns
    -------
    tuple of ndarray, shape (n,)
        Both.

    Raises
    ------
    HydrostateError
        If their lengths differ, or a sample is missing.
    """
    inputs, outputs = (np.asarray(one, dtype=np.float64) for one in (u, y))
    if inputs.ndim != 1 or inputs.shape != outputs.shape or not (np.isfinite(inputs) & np.isfinite(outputs)).all():
        raise HydrostateError(
            f"input and output of one length without gaps are needed, got shapes {inputs.shape} and {outputs.shape}"
        )
    return inputs, outputs


def local_polynomial_response(u: ArrayLike, y: ArrayLike, sample_time: float) -> FrequencyResponse:
    """Return the frequency response of one log, whatever its input.

    Around every frequency, response and leakage are polynomials of second degree, fitted by least squares to the
    spectra at 13 neighbours (Pintelon, Schoukens, Vandersteen and Barbé, Mechanical Systems and Signal Processing 24,
    2010, section 3).

    Parameters
    ----------
    u, y : array_like, shape (n,)
        Input and output, no gaps [any unit].
    sample_time : float
        Seconds between samples [s].

    Returns
    -------
    FrequencyResponse
        At all frequencies between zero and half the sample rate.

    Raises
    ------
    HydrostateError
        If the signals do not match, have gaps, or are too short, or the input holds too few frequencies.
    """
    inputs, outputs = without_gaps(u, y)
    span = 2 * HALF_WIDTH + 1
    spectra = [np.fft.rfft(one - one.mean())[1 : (len(one) + 1) // 2] / len(one) ** 0.5 for one in (inputs, outputs)]
    count = len(spectra[0])
    if count < span:
        raise HydrostateError(f"{2 * span + 2} samples or more are needed, got {len(inputs)}")
    begin = np.clip(np.arange(count) - HALF_WIDTH, 0, count - span)
    places = begin[:, None] + np.arange(span)
    distance = (places - np.arange(count)[:, None]) / HALF_WIDTH
    powers = distance[:, :, None] ** np.arange(DEGREE + 1)
    columns = np.concatenate([powers * spectra[0][places][:, :, None], powers.astype(np.complex128)], axis=2)
    size = np.linalg.norm(columns, axis=1, keepdims=True)
    lines = np.abs(spectra[0])
    # if most bands are empty, the median is only rounding too
    least = max(EMPTY[0] * float(np.median(lines)), EMPTY[1] * float(lines.max()))
    if (size[:, 0] < least).any() or not least > 0.0:
        raise HydrostateError(
            "the input must hold all frequencies, got bands without any; drive with noise, PRBS or steps"
        )
    basis, triangle = np.linalg.qr(columns / size)
    target = spectra[1][places][:, :, None]
    along = basis.conj().transpose(0, 2, 1) @ target
    left = target - basis @ along
    freedom = span - columns.shape[2]
    noise = np.sum(np.abs(left[:, :, 0]) ** 2, axis=1) / freedom
    inverse = np.linalg.inv(triangle)
    response = (inverse @ along)[:, 0, 0] / size[:, 0, 0]
    variance = noise * np.sum(np.abs(inverse[:, 0]) ** 2, axis=1) / size[:, 0, 0] ** 2
    frequency = np.arange(1, count + 1) / (len(inputs) * sample_time)
    return FrequencyResponse(frequency, response, variance, freedom)
