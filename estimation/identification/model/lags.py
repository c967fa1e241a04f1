"""Shifts of a signal as columns of a matrix."""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from estimation.arrays import Array


def lagged(x: Array, first: int, count: int) -> Array:
    """Return ``x[t - first - k]`` for k < count as columns, zero before the record.

    Parameters
    ----------
    x : ndarray, shape (n,)
        A signal.

    Returns
    -------
    ndarray, shape (n, count)
        One lag a column.
    """
    if count == 0:
        return np.empty((x.size, 0))
    padded = np.concatenate([np.zeros(first + count - 1), x])
    return sliding_window_view(padded, count)[: x.size, ::-1]
