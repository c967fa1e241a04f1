"""Plain loops that sum the normal equations of a fit block by block; they are compiled."""

from estimation.arrays import Array
from plant.compiled.native.loops import natively_compiled


@natively_compiled()
def fill_differences(found: Array, nudge: float, here: Array, slopes: Array) -> None:
    """Fill in the residuals at a point and their slopes, from the residuals there and at its neighbours.

    Parameters
    ----------
    found : ndarray, shape (outputs, blocks, lanes)
        Residuals at the point, and at its neighbours one after another; further lanes are ignored.
    nudge : float
        Distance of the neighbours [dimensionless].
    here : ndarray, shape (outputs, blocks)
        Output array for the residuals at the point.
    slopes : ndarray, shape (outputs, blocks, unknowns)
        Output array for their slopes.
    """
    for i in range(slopes.shape[0]):
        for k in range(slopes.shape[1]):
            value = found[i, k, 0]
            here[i, k] = value
            for j in range(slopes.shape[2]):
                slopes[i, k, j] = (found[i, k, j + 1] - value) / nudge


@natively_compiled()
def fill_quadratic(
    errors: Array, slopes: Array, outlier: float, straight: float, squares: Array, pulling: Array, bent: Array
) -> None:
    """Fill in the terms whose sums are cost, gradient and ``J'J``; gross outliers count linearly (Huber 1964).

    Parameters
    ----------
    errors : ndarray, shape (n,)
        Normalised residuals [dimensionless].
    slopes : ndarray, shape (n, unknowns)
        Their derivatives [dimensionless].
    outlier : float
        Residual from which outliers count linearly [dimensionless].
    straight : float
        Weight in ``J'J`` of an outlier [dimensionless].
    squares : ndarray, shape (n,)
        Output array for each residual's part of the cost.
    pulling : ndarray, shape (n,)
        Output array for each residual as it counts in the gradient.
    bent : ndarray, shape (n, unknowns)
        Output array for each one's slopes as they count in ``J'J``.
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
