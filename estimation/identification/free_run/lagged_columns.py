"""Series some samples later, as columns of linear models."""

from typing import TYPE_CHECKING

import numpy as np

from estimation.arrays import Array

if TYPE_CHECKING:
    from estimation.identification.free_run.linear_fit import Form


def lay_shifted(column: Array, series: Array, lag: int, before: float) -> None:
    """Write a shifted series into a column, with a constant level before it.

    Parameters
    ----------
    column : ndarray, shape (n,)
        Output.
    series : ndarray, shape (n,)
        Any.
    lag : int
        Shift in samples.
    before : float
        The level [any unit].
    """
    column[:lag] = before
    column[lag:] = series[: max(series.size - lag, 0)]


def columns_of(form: "Form", u: Array) -> Array:
    """Return the lagged inputs of one log; before it every input had its first value.

    Parameters
    ----------
    u : ndarray, shape (n, m)
        Inputs.

    Returns
    -------
    ndarray, shape (n, n_b)
        One column per numerator coefficient.
    """
    columns, place = np.empty((u.shape[0], form.n_b), order="F"), 0
    for one, size, delay in zip(u.T, form.sizes, form.delays, strict=True):
        for k in range(size):
            lay_shifted(columns[:, place + k], one, delay + k, float(one[0]))
        place += size
    return columns
