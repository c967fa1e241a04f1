"""Covariance of a least-squares fit, for white and for coloured residuals."""

import warnings

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.signal import oaconvolve

from plant.errors import LogWarning

FloatArray = NDArray[np.float64]


def automatic_lags(residual: FloatArray) -> int:
    """Return the span of a residual's colour, read off its first-order correlation (Andrews 1991, equation 6.2).

    A span that is fixed in advance reads slow colour into white residuals, from which the fit has taken what is slow:
    the deviation then comes out a fifth too small.

    Parameters
    ----------
    residual : ndarray, shape (n,)
        Residual at the optimum; zero where a sample is missing.

    Returns
    -------
    int
        Lags of a Bartlett window, 0 for white.

    Examples
    --------
    >>> automatic_lags(np.random.default_rng(1).standard_normal(10_000)) < 4
    True
    """
    power = float(residual @ residual)
    if power == 0.0:
        return 0
    rho = min(abs(float(residual[1:] @ residual[:-1])) / power, 0.97)
    return int(1.1447 * (4.0 * rho**2 / (1.0 - rho**2) ** 2 * len(residual)) ** (1.0 / 3.0))


def least_squares_covariance(
    jacobian: FloatArray, residual: FloatArray, n_used: int, *, coloured: bool, lags: int | None = None
) -> FloatArray:
    """Return ``s^2 (J'J)^-1``, or the sandwich ``(J'J)^-1 J'RJ (J'J)^-1`` where the residual is coloured.

    Parameters
    ----------
    jacobian : ndarray, shape (n, p)
        Derivatives of the residual by the parameters; zero rows where a sample is missing.
    residual : ndarray, shape (n,)
        Residual at the optimum, in the Jacobian's unit; zero where a sample is missing.
    n_used : int
        Samples that are not missing.
    coloured : bool
        Whether the residual's autocovariance R is estimated (Newey and West 1987) or taken as white.
    lags : int, optional
        Span of the autocovariance [samples]; about four times the root of the samples where not given.

    Returns
    -------
    ndarray, shape (p, p)
        Covariance of the parameters.

    Warns
    -----
    LogWarning
        If the parameters are not separately determined; the covariance is then a lower bound.
    """
    scale = np.sqrt(np.einsum("ij,ij->j", jacobian, jacobian))
    scale[scale == 0.0] = 1.0
    columns = jacobian / scale
    triangle = np.linalg.qr(columns, mode="r")
    n_parameters = columns.shape[1]
    if np.linalg.matrix_rank(triangle) < n_parameters:
        warnings.warn(
            "the coefficients are not separately determined by this record (a pole cancels a zero, or the "
            "order is too high): the covariance is a lower bound",
            LogWarning,
            stacklevel=3,
        )
        inverse = np.linalg.pinv(triangle)
    else:
        inverse = solve_triangular(triangle, np.eye(n_parameters))
    bread = inverse @ inverse.T
    freedom = n_used - n_parameters
    if coloured:
        spread = bread @ _coloured_meat(columns, residual, n_used, lags) @ bread * (n_used / freedom)
    else:
        spread = bread * float(residual @ residual) / freedom
    return spread / np.outer(scale, scale)


def _coloured_meat(columns: FloatArray, residual: FloatArray, n_used: int, wanted: int | None) -> FloatArray:
    """Return ``J'RJ`` with ``R`` the residual's autocovariance, Bartlett window (Newey and West, 1987)."""
    n_lags = min(n_used // 10, int(4.0 * n_used**0.5) if wanted is None else wanted)
    n_lags = max(n_lags, 1 if wanted is None else 0)
    spectrum = np.fft.rfft(residual, 2 * residual.size)
    lags = np.fft.irfft(np.abs(spectrum) ** 2)[: n_lags + 1] / n_used
    lags = lags * (1.0 - np.arange(n_lags + 1) / (n_lags + 1.0))
    kernel = np.concatenate([lags[:0:-1], lags])
    return np.column_stack([columns.T @ oaconvolve(column, kernel, mode="same") for column in columns.T])
