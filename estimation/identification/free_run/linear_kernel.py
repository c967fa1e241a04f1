"""Series through one denominator side by side, each from the state that its level before the log has brought about."""

import numpy as np

from estimation.arrays import Array
from estimation.identification.search.descent import stable
from estimation.identification.search.jit import compiled


@compiled
def decay_rows(f: Array, rows: Array, levels: Array, state: Array) -> None:
    """Put every row through ``1/F``, in place.

    Parameters
    ----------
    f : ndarray, shape (k,)
        Denominator, monic.
    rows : ndarray, shape (r, n)
        One series a row.
    levels : ndarray, shape (r,)
        What each stood at before its first sample.
    state : ndarray, shape (k,)
        Room for the filter's state.
    """
    order = f.size - 1
    total = 0.0
    for i in range(f.size):
        total += f[i]
    for r in range(rows.shape[0]):
        level = levels[r] / total
        state[order] = 0.0
        for i in range(order - 1, -1, -1):
            state[i] = state[i + 1] - level * f[i + 1]
        for t in range(rows.shape[1]):
            out = state[0] + rows[r, t]
            for i in range(order):
                state[i] = state[i + 1] - out * f[i + 1]
            rows[r, t] = out


def settles(coefficients: Array) -> bool:
    """Return whether a denominator has all its roots inside the unit circle, and a sum that is positive.

    A run begins at rest: its level is divided by that sum, of which rounding may leave nothing beside roots near one.

    Parameters
    ----------
    coefficients : ndarray, shape (n,)
        Behind the leading 1.

    Returns
    -------
    bool
        Whether a run can begin at rest.

    Examples
    --------
    >>> settles(np.array([-0.9])), settles(np.array([-1.9999999999999947, 0.9999999999999947]))
    (True, False)
    """
    whole = np.concatenate([[1.0], coefficients])
    # NumPy sums eight values or more in another order than the loop above
    return bool(stable(coefficients)) and min(float(whole.sum()), sum(whole.tolist())) > 0.0
