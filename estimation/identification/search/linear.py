"""Linear least squares of a few unknowns. The import of scipy.linalg takes longer than the fit of a model."""

import numpy as np
from numpy.typing import NDArray

from estimation.arrays import Array

EPSILON = float(np.finfo(np.float64).eps)
"""Singular values below this share of the largest count as zero."""


def least_squares(matrix: NDArray[np.float64], wanted: NDArray[np.float64]) -> Array:
    """Return the least-squares solution of smallest norm.

    Parameters
    ----------
    matrix : ndarray, shape (n, p)
        Columns [any unit].
    wanted : ndarray, shape (n,) or (n, m)
        What they are to add up to.

    Returns
    -------
    ndarray, shape (p,) or (p, m)
        Their factors.

    Examples
    --------
    >>> least_squares(np.array([[1.0], [1.0]]), np.array([1.0, 3.0])).round(9).tolist()
    [2.0]
    """
    return np.asarray(np.linalg.lstsq(matrix, wanted, rcond=EPSILON)[0], dtype=np.float64)


def inverse_of_triangle(triangle: Array) -> Array:
    """Return the inverse of an upper triangle, by substitution.

    Parameters
    ----------
    triangle : ndarray, shape (p, p)
        No zero on its diagonal.

    Returns
    -------
    ndarray, shape (p, p)
        An upper triangle.

    Examples
    --------
    >>> inverse_of_triangle(np.array([[2.0, 1.0], [0.0, 4.0]])).tolist()
    [[0.5, -0.125], [0.0, 0.25]]
    """
    p = len(triangle)
    inverse = np.eye(p)
    for i in range(p - 1, -1, -1):
        inverse[i] = (inverse[i] - triangle[i, i + 1 :] @ inverse[i + 1 :]) / triangle[i, i]
    return inverse
