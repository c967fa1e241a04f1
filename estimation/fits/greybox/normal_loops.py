"""Plain loops that sum the normal equations of a fit block by block; they are compiled."""

import numpy as np

from estimation.arrays import Array
from plant.compiled.native.loops import natively


@natively()
def fill_differences(found: Array, nudge: float, here: Array, slopes: Array) -> None:
    """Fill in the residuals at a point and their slopes, of the residuals there and at its neighbours.

    Parameters
    ----------
    found : ndarray, shape (outputs, blocks, lanes)
        Residuals at the point, and at its neighbours one after another; what lanes are left count for nothing.
    nudge : float
        How far away the neighbours are [dimensionless].
    here : ndarray, shape (outputs, blocks)
        Room for the residuals at the point.
    slopes : ndarray, shape (outputs, blocks, unknowns)
        Room for their slopes.
    """
    for i in range(slopes.shape[0]):
        for k in range(slopes.shape[1]):
            value = found[i, k, 0]
            here[i, k] = value
            for j in range(slopes.shape[2]):
                slopes[i, k, j] = (found[i, k, j + 1] - value) / nudge


@natively(freely=("contract",))
def sum_normal_equations(
    found: Array, outlier: float, straight: float, away: Array, gradient: Array, gram: Array
) -> float:
    """Sum cost, gradient and ``J'J`` of the residuals at a point and at its neighbours, and return the cost.

    The same as `fill_differences`, `fill_weighed` and sums over what they fill in, without the room for it. Four blocks
    are summed at a time: each sum is then read and written once for all four.

    Parameters
    ----------
    found : ndarray, shape (outputs, blocks, lanes)
        Residuals at the point, and at its neighbours one after another; what lanes are left count for nothing.
    outlier : float
        Residual from which on they count linearly [dimensionless].
    straight : float
        Weight in ``J'J`` of one that does [dimensionless].
    away : ndarray, shape (4, lanes)
        Room for how far the neighbours' residuals are from the point's in four blocks.
    gradient : ndarray, shape (lanes,)
        Zeros, to which the gradient is added, times the distance to each neighbour; the point itself comes first.
    gram : ndarray, shape (unknowns, lanes)
        Zeros, to which ``J'J`` is added, times the distances to both neighbours; likewise.

    Returns
    -------
    float
        The cost [dimensionless].
    """
    cost, pulling, counts = 0.0, np.zeros(4), np.zeros(4)
    blocks, lanes = found.shape[1], away.shape[1]
    for i in range(found.shape[0]):
        for first in range(0, blocks, 4):
            for row in range(4):
                k, present = min(first + row, blocks - 1), 1.0 if first + row < blocks else 0.0
                value = found[i, k, 0]
                weight = outlier / max(abs(value), outlier)
                cost += present * ((1.0 - 0.5 * weight) * weight * (value * value))
                pulling[row] = present * weight * value
                counts[row] = present * (straight if weight < 1.0 else 1.0)
                for j in range(lanes):
                    away[row, j] = found[i, k, j] - value
            p0, p1, p2, p3 = pulling[0], pulling[1], pulling[2], pulling[3]
            for j in range(lanes):
                gradient[j] += p0 * away[0, j] + p1 * away[1, j] + p2 * away[2, j] + p3 * away[3, j]
            for m in range(gram.shape[0]):
                g0, g1 = counts[0] * away[0, m + 1], counts[1] * away[1, m + 1]
                g2, g3 = counts[2] * away[2, m + 1], counts[3] * away[3, m + 1]
                for j in range(lanes):
                    gram[m, j] += g0 * away[0, j] + g1 * away[1, j] + g2 * away[2, j] + g3 * away[3, j]
    return cost


@natively()
def fill_weighed(
    errors: Array, slopes: Array, outlier: float, straight: float, squares: Array, pulling: Array, bent: Array
) -> None:
    """Fill in what cost, gradient and ``J'J`` are sums of; what is grossly off counts linearly (Huber 1964).

    Parameters
    ----------
    errors : ndarray, shape (n,)
        Normalised residuals [dimensionless].
    slopes : ndarray, shape (n, unknowns)
        Their derivatives [dimensionless].
    outlier : float
        Residual from which on they count linearly [dimensionless].
    straight : float
        Weight in ``J'J`` of one that does [dimensionless].
    squares : ndarray, shape (n,)
        Room for each residual's part of the cost.
    pulling : ndarray, shape (n,)
        Room for each residual as it counts in the gradient.
    bent : ndarray, shape (n, unknowns)
        Room for each one's slopes as they count in ``J'J``.
    """
    for k in range(errors.shape[0]):
        value = errors[k]
        weight = outlier / max(abs(value), outlier)
        squares[k] = (1.0 - 0.5 * weight) * weight * (value * value)
        pulling[k] = weight * value
        if weight < 1.0:
            for j in range(slopes.shape[1]):
                bent[k, j] = slopes[k, j] * straight
        else:
            for j in range(slopes.shape[1]):
                bent[k, j] = slopes[k, j]
