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
    shifted: list[Array] = []
    for index, (size, delay) in enumerate(zip(form.sizes, form.delays, strict=True)):
        one = u[:, index]
        for k in range(size):
            lag = min(delay + k, one.size)
            shifted.append(np.concatenate([np.full(lag, one[0]), one[: one.size - lag]]))
    return np.column_stack(shifted) if shifted else np.zeros((u.shape[0], 0))
