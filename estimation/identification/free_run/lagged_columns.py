"""Series some samples later, as columns of linear models."""

from typing import TYPE_CHECKING

import numpy as np

from estimation.arrays import Array

if TYPE_CHECKING:
    from estimation.identification.free_run.linear_fit import Form


def shifted(series: Array, lag: int, before: float) -> Array:
    """Return a series some samples later, a level in front of it.

    Parameters
    ----------
    series : ndarray, shape (n,)
        Any.
    lag : int
        By how many samples.
    before : float
        The level [any unit].

    Returns
    -------
    ndarray, shape (n,)
        In the series' unit.
    """
    out = np.full(series.size, before)
    out[lag:] = series[: max(series.size - lag, 0)]
    return out


def columns_of(form: "Form", u: Array) -> Array:
    """Return the lagged inputs of one log; before it every input stood at its first value.

    Parameters
    ----------
    u : ndarray, shape (n, m)
        Inputs.

    Returns
    -------
    ndarray, shape (n, n_b)
        One column a numerator coefficient.
    """
    columns = [
        shifted(one, delay + k, one[0])
        for one, size, delay in zip(u.T, form.sizes, form.delays, strict=True)
        for k in range(size)
    ]
    return np.column_stack(columns) if columns else np.zeros((u.shape[0], 0))
