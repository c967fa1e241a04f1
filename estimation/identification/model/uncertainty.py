"""Delta method: uncertainty of poles, zeros, gain and frequency response from that of coefficients."""

from dataclasses import dataclass

import numpy as np

from estimation.arrays import Array, ComplexArray
from estimation.trust.chi_square import chi_square_quantile

CANCELLING_DEVIATIONS = 4.0
"""A pole and a zero that are closer than this many standard deviations of their distance are near cancellation."""

CANCELLING_SHARE = 0.5
"""And closer than this share of the pole's distance from zero frequency."""

ROUNDING_DISTANCE = 1e-8
"""Distance of a zero from a pole, over the pole's modulus, within which rounding does not tell them apart."""


@dataclass(frozen=True)
class Cancellation:
    """A pole and a zero that the data do not clearly separate.

    Parameters
    ----------
    pole, zero : complex
        Their places in the z plane, or s plane [1/s].
    deviations : float
        Their distance over its standard deviation [dimensionless].
    """

    pole: complex
    zero: complex
    deviations: float


def sorted_roots(coefficients: Array) -> ComplexArray:
    """Return the roots of a polynomial in descending powers, largest modulus first.

    Parameters
    ----------
    coefficients : ndarray, shape (n + 1,)
        Descending powers.

    Returns
    -------
    ndarray of complex, shape (n,) at most
        Roots.
    """
    roots = np.roots(coefficients).astype(np.complex128)
    return roots[np.argsort(-np.abs(roots), kind="stable")]


def root_gradients(coefficients: Array, roots: ComplexArray) -> ComplexArray:
    """Return the derivative of each root by each coefficient, ``-r^(n-k) / P'(r)``.

    Parameters
    ----------
    coefficients : ndarray, shape (n + 1,)
        Descending powers.
    roots : ndarray of complex, shape (m,)
        Simple roots; at a multiple root the derivative is infinite.

    Returns
    -------
    ndarray of complex, shape (m, n + 1)
        Derivatives.
    """
    degree = coefficients.size - 1
    slope = np.polyval(np.polyder(coefficients), roots)
    powers = np.asarray(roots[:, None] ** np.arange(degree, -1, -1), dtype=np.complex128)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return np.asarray(-powers / slope[:, None], dtype=np.complex128)


def complex_std(gradients: ComplexArray, covariance: Array) -> ComplexArray:
    """Return standard deviations of real and imaginary part, as one complex number each.

    Parameters
    ----------
    gradients : ndarray of complex, shape (m, p)
        By the coefficients.
    covariance : ndarray, shape (p, p)
        Of the coefficients.

    Returns
    -------
    ndarray of complex, shape (m,)
        ``std(real) + 1j std(imaginary)``.
    """
    real = np.einsum("ij,jk,ik->i", gradients.real, covariance, gradients.real)
    imaginary = np.einsum("ij,jk,ik->i", gradients.imag, covariance, gradients.imag)
    return np.sqrt(np.maximum(real, 0.0)) + 1j * np.sqrt(np.maximum(imaginary, 0.0))


def cancellations(
    numerator: Array, denominator: Array, covariance: Array, at_rest: complex
) -> tuple[Cancellation, ...]:
    """Return the poles that a zero nearly cancels, within the accuracy of the data.

    Parameters
    ----------
    numerator : ndarray, shape (n_b,)
        Free coefficients, descending powers.
    denominator : ndarray, shape (n_f + 1,)
        Monic, descending powers.
    covariance : ndarray, shape (n_b + n_f, n_b + n_f)
        Of both.
    at_rest : complex
        Where zero frequency is: 1 in the z plane, 0 in the s plane.

    Returns
    -------
    tuple of Cancellation
        Nearest zero of each pole concerned; one of a conjugate pair.
    """
    if not np.isfinite(covariance).all():
        return ()
    poles, zeros = sorted_roots(denominator), sorted_roots(numerator)
    pole_slopes = root_gradients(denominator, poles)[:, 1:]
    zero_slopes = root_gradients(numerator, zeros)
    found: list[Cancellation] = []
    for i, pole in enumerate(poles):
        if pole.imag < 0.0:
            continue
        for j, zero in enumerate(zeros):
            gradient = np.concatenate([-zero_slopes[j], pole_slopes[i]])
            both = np.stack([np.real(gradient), np.imag(gradient)])
            apart = complex(pole) - complex(zero)
            distance = np.array([apart.real, apart.imag])
            spread = both @ covariance @ both.T
            # if they coincide the Jacobian is singular, and the covariance of their distance is only rounding
            away = 0.0 if abs(apart) <= ROUNDING_DISTANCE * abs(pole) else _deviations(distance, spread)
            # a distant zero that is hardly determined is uncertain, but cancels nothing
            near = abs(pole - zero) < CANCELLING_SHARE * abs(pole - at_rest)
            if near and away < CANCELLING_DEVIATIONS and zero.imag >= 0.0:
                found.append(Cancellation(complex(pole), complex(zero), away))
    return tuple(sorted(found, key=lambda pair: pair.deviations))


def _deviations(distance: Array, spread: Array) -> float:
    """Return a distance in standard deviations along itself; infinite derivatives say nothing apart."""
    length = float(np.hypot(distance[0], distance[1]))
    if length == 0.0 or not np.isfinite(spread).all():
        return 0.0
    along = distance / length
    variance = float(along @ spread @ along)
    return length / float(np.sqrt(variance)) if variance > 0.0 else float("inf")


@dataclass(frozen=True, eq=False)
class ResponseBand:
    """A frequency response with its uncertainty from the covariance.

    Parameters
    ----------
    frequency_hz : ndarray, shape (k,)
        Frequencies [Hz].
    response : ndarray of complex, shape (k,)
        Output per input [output unit per input unit].
    gain_std : ndarray, shape (k,)
        Standard deviation of ``|response|`` [output unit per input unit].
    phase_std : ndarray, shape (k,)
        Standard deviation of the phase [rad].
    gain_low, gain_high : ndarray, shape (k,)
        Band of the gain, pointwise [output unit per input unit].
    """

    frequency_hz: Array
    response: ComplexArray
    gain_std: Array
    phase_std: Array
    gain_low: Array
    gain_high: Array


def response_band(
    frequency_hz: Array, response: ComplexArray, gradient: ComplexArray, covariance: Array, level: float
) -> ResponseBand:
    """Return pointwise bands of gain and phase, first order in the covariance.

    Parameters
    ----------
    frequency_hz : ndarray, shape (k,)
        Frequencies [Hz].
    response : ndarray of complex, shape (k,)
        Output per input [output unit per input unit].
    gradient : ndarray of complex, shape (k, p)
        By the coefficients.
    covariance : ndarray, shape (p, p)
        Of the coefficients.
    level : float
        Probability that a band covers.
    """
    gain = np.abs(response)
    turned = gradient * np.where(gain > 0.0, np.conj(response) / np.where(gain > 0.0, gain, 1.0), 1.0)[:, None]
    spread = complex_std(turned, covariance)
    reach = chi_square_quantile(level, 1) ** 0.5 * spread.real
    with np.errstate(divide="ignore", invalid="ignore"):
        phase = spread.imag / gain
    return ResponseBand(frequency_hz, response, spread.real, phase, np.maximum(gain - reach, 0.0), gain + reach)
