"""Starts of an ARMA noise model (Hannan and Rissanen, 1982)."""

import numpy as np

from estimation.arrays import Array
from estimation.identification.model.lags import lagged
from estimation.identification.search.criterion import stabilised_denominator
from estimation.identification.search.linear import least_squares

LONG = 30
"""Coefficients of the long autoregression whose residual stands for the innovations."""


def noise_start(v: Array, n_c: int, n_d: int) -> tuple[Array, Array]:
    """Return C and D of ``v = C/D e`` by two regressions, stable and invertible.

    Parameters
    ----------
    v : ndarray, shape (n,)
        Coloured noise, no gaps.
    n_c, n_d : int
        Coefficients behind the leading 1.

    Returns
    -------
    c : ndarray, shape (n_c + 1,)
        Monic.
    d : ndarray, shape (n_d + 1,)
        Monic.
    """
    if n_c + n_d == 0:
        return np.ones(1), np.ones(1)
    long = max(1, min(LONG, v.size // 20))
    columns = lagged(v, 1, long)[long:]
    innovation = np.zeros(v.size)
    innovation[long:] = v[long:] - columns @ least_squares(columns.T @ columns, columns.T @ v[long:])
    begin = long + max(n_c, n_d)
    regressors = np.concatenate([-lagged(v, 1, n_d), lagged(innovation, 1, n_c)], axis=1)[begin:]
    values = least_squares(regressors.T @ regressors, regressors.T @ v[begin:])
    d = np.concatenate([[1.0], values[:n_d]])
    c = np.concatenate([[1.0], values[n_d:]])
    return stabilised_denominator(c, v.size), stabilised_denominator(d, v.size)
