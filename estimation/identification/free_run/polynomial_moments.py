"""Least squares of a polynomial's one-step error by the moments of its terms, which all penalties share."""

import numpy as np

from estimation.arrays import Array, IntArray
from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.polynomial_variables import Variables, products

Moments = tuple[Array, Array, int]
"""Sums of products of terms with each other and with the output, and the number of samples."""


def moments(variables: Variables, terms: IntArray, data: Channels) -> Moments:
    """Return sums of products of terms with each other and with the output, one step ahead.

    Parameters
    ----------
    terms : ndarray of int, shape (k, 3)
        Variables of each term; -1 stands for 1.
    data : Channels
        Scaled; outputs held back are NaN.

    Returns
    -------
    tuple of ndarray (k, k), ndarray (k,) and int
        The sums, and the number of samples.
    """
    count = terms.shape[0]
    gram, right, n = np.zeros((count, count)), np.zeros(count), 0
    for u, y in zip(data.u, data.y, strict=True):
        known = np.isfinite(y)
        used = known.copy()
        used[: max(int(variables.lag.max()), 1)] = False
        for lag in range(1, variables.n_start + 1):
            used[lag:] &= known[:-lag]
        rows = products(variables, terms, u, np.where(known, y, 0.0))[used]
        gram, right, n = gram + rows.T @ rows, right + rows.T @ y[used], n + rows.shape[0]
    return gram, right, n


def one_step_values(terms: IntArray, known: Moments, penalty: float) -> Array | None:
    """Return coefficients of the least squares of the one-step error; None if there are too few samples.

    Parameters
    ----------
    terms : ndarray of int, shape (k, 3)
        Variables of each term; -1 stands for 1.
    known : tuple
        From `moments`.
    penalty : float
        On products of unit deviation [dimensionless].

    Returns
    -------
    ndarray, shape (k,), or None
        One per term.
    """
    gram, right, n = known
    if n < terms.shape[0]:
        return None
    size = np.sqrt(np.diag(gram) / n)
    size[size == 0.0] = 1.0
    # linear terms are penalised only as far as keeps the equations solvable
    weight = np.where(terms[:, 1] >= 0, penalty, 1e-6 * penalty) + 1e-12
    unit = gram / np.outer(size, size) + n * np.diag(weight)
    return np.linalg.solve(unit, right / size) / size
