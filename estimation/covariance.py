"""Covariance of a least-squares fit, for white and for coloured residuals."""

import warnings

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.signal import oaconvolve

from plant.errors import LogWarning

FloatArray = NDArray[np.float64]


def least_squares_covariance(jacobian: FloatArray, residual: FloatArray, n_used: int, *, coloured: bool) -> FloatArray:
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
        spread = bread @ _coloured_meat(columns, residual, n_used) @ bread * (n_used / freedom)
    else:
        spread = bread * float(residual @ residual) / freedom
    return spread / np.outer(scale, scale)


def _coloured_meat(columns: FloatArray, residual: FloatArray, n_used: int) -> FloatArray:
    """Return ``J'RJ`` with ``R`` the residual's autocovariance, Bartlett window (Newey and West, 1987)."""
    n_lags = max(1, min(n_used // 10, int(4.0 * n_used**0.5)))
    spectrum = np.fft.rfft(residual, 2 * residual.size)
    lags = np.fft.irfft(np.abs(spectrum) ** 2)[: n_lags + 1] / n_used
    lags = lags * (1.0 - np.arange(n_lags + 1) / (n_lags + 1.0))
    kernel = np.concatenate([lags[:0:-1], lags])
    return columns.T @ oaconvolve(columns, kernel[:, None], mode="same", axes=0)
