"""Series through one denominator side by side, each from the steady state of its level before the log."""

import numpy as np

from estimation.arrays import Array
from estimation.identification.search.descent import stable
from estimation.identification.search.jit import compiled


@compiled
def decay_rows(f: Array, rows: Array, levels: Array) -> None:
    """Filter every row by ``1/F``, in place.

    A sample waits for the one before it, so two rows are computed side by side, and the product with the latest output
    is added last.

    Parameters
    ----------
    f : ndarray, shape (k,)
        Denominator, monic.
    rows : ndarray, shape (r, n)
        One series per row.
    levels : ndarray, shape (r,)
        Level of each before its first sample.
    """
    order = f.size - 1
    count, n = rows.shape
    if order == 0 or n == 0:
        return
    total = 0.0
    for i in range(f.size):
        total += f[i]
    head = min(order, n)
    for r in range(count):
        before = levels[r] / total
        for t in range(head):
            value = rows[r, t]
            for i in range(1, order + 1):
                value -= f[i] * (rows[r, t - i] if t >= i else before)
            rows[r, t] = value
    nearest = f[1]
    for pair in range(count // 2):
        r = 2 * pair
        last, other = rows[r, head - 1], rows[r + 1, head - 1]
        for t in range(head, n):
            far, away = rows[r, t], rows[r + 1, t]
            for i in range(2, order + 1):
                far -= f[i] * rows[r, t - i]
                away -= f[i] * rows[r + 1, t - i]
            last = far - nearest * last
            other = away - nearest * other
            rows[r, t] = last
            rows[r + 1, t] = other
    if count % 2 == 1:
        r = count - 1
        last = rows[r, head - 1]
        for t in range(head, n):
            far = rows[r, t]
            for i in range(2, order + 1):
                far -= f[i] * rows[r, t - i]
            last = far - nearest * last
            rows[r, t] = last


def settles(coefficients: Array) -> bool:
    """Return whether a denominator has all its roots inside the unit circle, and a positive sum.

    A run begins at rest: its level is divided by that sum, which rounding may reduce to zero for roots near one.

    Parameters
    ----------
    coefficients : ndarray, shape (n,)
        Without the leading 1.

    Examples
    --------
    >>> settles(np.array([-0.9])), settles(np.array([-1.9999999999999947, 0.9999999999999947]))
    (True, False)
    """
    whole = np.concatenate([[1.0], coefficients])
    # NumPy sums eight values or more in another order than the loop in `decay_rows`
    return bool(stable(coefficients)) and min(float(whole.sum()), sum(whole.tolist())) > 0.0


def record_length_pole(n_samples: int) -> float:
    """Return the pole whose time constant is a record's length.

    Parameters
    ----------
    n_samples : int
        Of the record.

    Returns
    -------
    float
        Distance from the origin [dimensionless].
    """
    return float(np.exp(-1.0 / n_samples))
