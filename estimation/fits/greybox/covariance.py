"""Covariance of a least-squares fit, for white and for coloured residuals."""

import warnings

import numpy as np

from estimation.fits.convolution import convolved, smooth_length
from estimation.notes import EstimateCode
from plant.arrays import Array
from plant.errors import LogWarning

FEW_LAGS = 32
"""Lags up to which products with an autocovariance are summed lag by lag, not by a Fourier transform [count]."""

LARGEST_PART = 100_000
"""Rows of a Jacobian that are factored at a time."""


def automatic_lags(residual: Array) -> int:
    """Return the correlation length of residuals, from their first-order correlation (Andrews 1991, equation 6.2).

    A fixed length would find slow correlation in white residuals, from which the fit has removed what is slow: the
    deviation would then be a fifth too small.

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
    jacobian: Array, residual: Array, n_used: int, lags: int, prior: Array, *, warned: bool = True
) -> tuple[Array, Array]:
    """Return ``B = (J'J + P)^-1`` and the sandwich ``B (J'RJ + P) B`` of a residual with autocovariance R.

    R is estimated with a Bartlett window (Newey and West 1987).

    Parameters
    ----------
    jacobian : ndarray, shape (n, p)
        Derivatives of the residual by the parameters; zero rows where a sample is missing.
    residual : ndarray, shape (n,)
        Residual at the optimum, in the Jacobian's unit; zero where a sample is missing.
    n_used : int
        Samples that are not missing.
    lags : int
        Number of lags of the autocovariance [samples], 0 for white; see `automatic_lags`.
    prior : ndarray, shape (p,)
        Diagonal of P: one over the variance of each parameter before the fit, zero where nothing is known.
    warned : bool
        Whether to warn if the parameters are not separately determined; otherwise they are infinite there.

    Returns
    -------
    tuple of ndarray, shape (p, p)
        The inverse, and the covariance of the parameters.

    Warns
    -----
    LogWarning
        If the parameters are not separately determined; the covariance is then a lower bound.
    """
    scale = np.sqrt(np.einsum("ij,ij->j", jacobian, jacobian) + prior)
    scale[scale == 0.0] = 1.0
    n_parameters = jacobian.shape[1]
    triangles = [np.linalg.qr(part, mode="r") for part in _parts(jacobian)]
    triangle = np.linalg.qr(np.concatenate([*triangles, np.diag(np.sqrt(prior))]), mode="r") / scale
    determined = np.linalg.matrix_rank(triangle) == n_parameters
    inverse = np.linalg.inv(triangle) if determined else np.linalg.pinv(triangle)
    bread = inverse @ inverse.T / np.outer(scale, scale)
    if not determined and not warned:
        return bread, np.full_like(bread, np.inf)
    if not determined:
        warnings.warn(LogWarning(EstimateCode.NOT_DETERMINED.note()), stacklevel=3)
    meat = _meat(jacobian, _autocovariance(residual, n_used, min(lags, n_used // 10)))
    return bread, bread @ (meat * (n_used / (n_used - n_parameters)) + np.diag(prior)) @ bread


def _parts(jacobian: Array) -> list[Array]:
    """Return the rows of a long Jacobian in parts, to save memory."""
    return np.array_split(jacobian, max(1, len(jacobian) // LARGEST_PART))


def _autocovariance(residual: Array, n_used: int, lags: int) -> Array:
    """Return the autocovariance from lag zero up to a lag, under a Bartlett window."""
    if lags <= FEW_LAGS:
        shifted = np.array([float(residual[lag:] @ residual[: residual.size - lag]) for lag in range(lags + 1)])
    else:  # one long transform gives hundreds of lags at the cost of a few
        size = smooth_length(residual.size + lags, (2, 3, 5))
        shifted = np.fft.irfft(np.abs(np.fft.rfft(residual, size)) ** 2, size)[: lags + 1]
    return shifted / n_used * (1.0 - np.arange(lags + 1) / (lags + 1.0))


def _meat(columns: Array, autocovariance: Array) -> Array:
    """Return ``J'RJ``."""
    if len(autocovariance) <= FEW_LAGS:
        shifted = [columns[lag:].T @ columns[: len(columns) - lag] for lag in range(len(autocovariance))]
        either = [shifted[0], *(one + one.T for one in shifted[1:])]
        return np.tensordot(autocovariance, either, axes=1)
    kernel = np.concatenate([autocovariance[:0:-1], autocovariance])
    return np.column_stack([columns.T @ convolved(column, kernel) for column in columns.T])
