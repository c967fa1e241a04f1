"""Least squares by scaled normal equations."""

import numpy as np

from estimation.arrays import Array


def least_squares(columns: Array, target: Array) -> tuple[Array, float]:
    """Return values of a least-squares fit by scaled normal equations, and its cost.

    Parameters
    ----------
    columns : ndarray, shape (n, p)
        Regressors.
    target : ndarray, shape (n,)
        What they should give.

    Returns
    -------
    tuple of ndarray, shape (p,), and float
        Values, and the sum of squared residuals.
    """
    scale = np.sqrt(np.einsum("ij,ij->j", columns, columns))
    scale[scale == 0.0] = 1.0
    unit = columns / scale
    values = np.linalg.lstsq(unit.T @ unit, unit.T @ target, rcond=None)[0]
    left = target - unit @ values
    return values / scale, float(left @ left)
