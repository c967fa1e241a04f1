"""Denominators by their reflection coefficients: all values within ±1 are stable, so no step can leave the bound."""

import numpy as np

from estimation.arrays import Array
from estimation.identification.search.descent import solve_damped
from estimation.identification.search.jit import compiled

LARGEST_STEP = 2.0
"""Change of a coordinate in one step at most: what is left of the distance to one shrinks some 50-fold [dimensionless].
"""


def reflections(coefficients: Array) -> Array:
    """Return the reflection coefficients of a stable denominator (Levinson's recursion, backwards).

    Parameters
    ----------
    coefficients : ndarray, shape (n,)
        Behind the leading 1.

    Returns
    -------
    ndarray, shape (n,)
        Each between -1 and 1 [dimensionless]; NaN below one that rounding has put at 1 or beyond.

    Examples
    --------
    >>> reflections(np.array([-1.5, 0.56])).round(6).tolist(), reflections(np.array([-2.0, 1.0])).tolist()
    ([-0.961538, 0.56], [nan, 1.0])
    """
    row, found = np.asarray(coefficients, dtype=np.float64), np.zeros(coefficients.size)
    for size in range(row.size, 0, -1):
        last = found[size - 1] = float(row[-1])
        if abs(last) >= 1.0:
            found[: size - 1] = np.nan
            break
        row = (row[:-1] - last * row[-2::-1]) / (1.0 - last * last) if size > 1 else row[:0]
    return found


def denominator(reflected: Array) -> tuple[Array, Array]:
    """Return the denominator of reflection coefficients, and its derivative by them.

    Parameters
    ----------
    reflected : ndarray, shape (n,)
        Each between -1 and 1 [dimensionless].

    Returns
    -------
    tuple of ndarray, shapes (n,) and (n, n)
        Coefficients behind the leading 1; one column of the derivative a reflection coefficient.

    Examples
    --------
    >>> denominator(reflections(np.array([-1.5, 0.56])))[0].round(6).tolist()
    [-1.5, 0.56]
    """
    n = reflected.size
    row, slopes = np.zeros(n), np.zeros((n, n))
    _raise_order(np.ascontiguousarray(reflected), row, slopes)
    return row, slopes


@compiled
def _raise_order(reflected: Array, row: Array, slopes: Array) -> None:
    """Fill a denominator behind its 1 and its derivative, both zero before, one order after the other (Levinson).

    Parameters
    ----------
    reflected, row : ndarray, shape (n,)
        Reflection coefficients, and receives the denominator.
    slopes : ndarray, shape (n, n)
        Receives the derivative.
    """
    for size in range(reflected.size):
        last = reflected[size]
        for i in range(size // 2 + size % 2):
            j = size - 1 - i
            for k in range(size):
                near, far = slopes[i, k], slopes[j, k]
                slopes[i, k] = near + last * far
                slopes[j, k] = far + last * near
            slopes[i, size], slopes[j, size] = row[j], row[i]
            first, other = row[i], row[j]
            row[i] = first + last * other
            row[j] = other + last * first
        row[size] = last
        slopes[size, size] = 1.0


def stable_step(
    theta: Array, gram: Array, gradient: Array, damping: float, place: slice, stretched: Array
) -> tuple[Array, float] | None:
    """Return the result of a damped step in the reflection coefficients, which keeps it stable.

    The coordinates are ``atanh`` of the coefficients: the bound is at infinity, and each step leaves a share of the
    distance to it.

    Parameters
    ----------
    theta : ndarray, shape (p,)
        All values.
    gram, gradient : ndarray, shapes (p, p) and (p,)
        ``J'J`` and half the gradient there.
    damping : float
        Marquardt's factor [dimensionless].
    place : slice
        Where the denominator stands behind its 1; stable.
    stretched : ndarray, shape (n,)
        Factors that bring the circle within which poles must stay to the unit circle.

    Returns
    -------
    tuple of ndarray, shape (p,), and float, or None
        Values, and what the cost should fall by; None where there is no such step.
    """
    reflected = reflections(theta[place] * stretched)
    if not (np.abs(reflected) < 1.0).all():
        return None
    turned = np.eye(theta.size)
    turned[place, place] = denominator(reflected)[1] * (1.0 - reflected**2) / stretched[:, None]
    own_gram, own_gradient = turned.T @ gram @ turned, turned.T @ gradient
    step, factor = np.zeros(theta.size), np.zeros(gram.shape)
    if not solve_damped(own_gram, own_gradient, damping, step, factor):
        return None
    step *= min(1.0, LARGEST_STEP / max(float(np.abs(step[place]).max()), 1e-300))
    promised = -2.0 * float(own_gradient @ step) - float(step @ own_gram @ step)
    new = theta + step
    new[place] = denominator(np.tanh(np.arctanh(reflected) + step[place]))[0] / stretched
    return new, promised
