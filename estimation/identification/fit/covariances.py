"""Covariance of fitted coefficients: for a white residual, and robust for a coloured one."""

import numpy as np

from estimation.arrays import Array, BoolArray
from estimation.identification.search.experiments import Experiments
from estimation.identification.search.linear import inverse_of_triangle


def covariances(jacobian: Array, residual: Array, data: Experiments) -> tuple[Array, Array, bool]:
    """Return ``s^2 (J'J)^-1`` and the sandwich ``(J'J)^-1 J'RJ (J'J)^-1``.

    Parameters
    ----------
    jacobian : ndarray, shape (n, p)
        Derivatives of the model's output; zero rows where a sample is missing.
    residual : ndarray, shape (n,)
        Residual at the optimum; zero where a sample is missing.
    data : Experiments
        Says which samples are there, and which belong together.

    Returns
    -------
    white : ndarray, shape (p, p)
        Right if the residual is white.
    robust : ndarray, shape (p, p)
        With the residual's autocovariance R (Newey and West 1987): right, too, where it is coloured.
    determined : bool
        Whether the data tell the coefficients apart; otherwise both covariances are lower bounds.
    """
    scale = np.sqrt(np.einsum("ij,ij->j", jacobian, jacobian))
    # an initial state whose samples are all missing has no effect, and costs no degree of freedom
    felt = scale > 0.0
    scale[~felt] = 1.0
    columns = (jacobian / scale)[:, felt]
    triangle = np.asarray(np.linalg.qr(columns, mode="r"), dtype=np.float64)
    n_parameters = columns.shape[1]
    determined = bool(np.linalg.matrix_rank(triangle) == n_parameters)
    inverse = inverse_of_triangle(triangle) if determined else np.linalg.pinv(triangle)
    # orthonormal columns avoid squaring, so that the sandwich stays positive if coefficients are nearly dependent
    upright = columns @ inverse
    freedom = data.n_used - n_parameters
    white = inverse @ inverse.T * float(residual @ residual) / freedom
    meat = np.zeros_like(inverse)
    for part in data.slices:
        meat += _coloured_meat(upright[part], residual[part], int(data.used[part].sum()))
    robust = inverse @ meat @ inverse.T * (data.n_used / freedom)
    unscale = np.outer(scale[felt], scale[felt])
    return _spread(white / unscale, felt), _spread(robust / unscale, felt), determined


def _spread(matrix: Array, felt: BoolArray) -> Array:
    whole = np.full((felt.size, felt.size), np.nan)
    whole[np.ix_(felt, felt)] = matrix
    return whole


def _coloured_meat(columns: Array, residual: Array, n_used: int) -> Array:
    """Return ``J'RJ``, with R's autocovariance tapered by Parzen's window, which keeps it positive."""
    size = 1 << int(np.ceil(np.log2(2 * residual.size)))
    n_lags = max(1, min(n_used // 10, int(4.0 * n_used**0.5)))
    correlation = np.fft.irfft(np.abs(np.fft.rfft(residual, size)) ** 2, size)[: n_lags + 1] / n_used
    share = np.arange(n_lags + 1) / (n_lags + 1.0)
    window = np.where(share <= 0.5, 1.0 - 6.0 * share**2 + 6.0 * share**3, 2.0 * (1.0 - share) ** 3)
    two_sided = np.zeros(size)
    two_sided[: n_lags + 1] = window * correlation
    two_sided[size - n_lags :] = two_sided[n_lags:0:-1]
    spectrum = np.maximum(np.fft.rfft(two_sided).real, 0.0)
    spectrum[1:-1] *= 2.0
    moved = np.fft.rfft(columns.T, size)
    return np.asarray(np.real((moved * spectrum) @ np.conj(moved.T)) / size, dtype=np.float64)
