"""`sign_constrained_covariance(problem, ...)`: covariance of a fit with unknowns that cannot be negative.

A motor leads and never lags, and an inner circuit does not suck. A search holds such an unknown at zero if noise would
carry it below, and finds the others at that value. A covariance that ignores the bound makes their intervals too wide.
"""

from math import erfc, exp, inf, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from estimation.fits.greybox.descent import Point
from estimation.fits.greybox.problem import Problem
from plant.arrays import Array

FAR = 8.0
"""Deviations beyond a bound from which the tail of a normal distribution falls off as an exponential
[dimensionless]."""


def sign_constrained_covariance(
    problem: Problem, point: Point, least: Array, felt: NDArray[np.intp], bread: Array, spread: Array
) -> Array:
    """Return the covariance of a fit, given the known signs of unknowns that are not logarithms.

    Parameters
    ----------
    problem : Problem
        The problem.
    point : Point
        Its solution.
    least : ndarray, shape (unknowns,)
        Lowest coordinates of its search; only zeros are physical bounds [dimensionless].
    felt : ndarray of int, shape (felt,)
        Indices of the unknowns that have an effect.
    bread : ndarray, shape (felt, felt)
        Inverse of the normal equations of those [dimensionless].
    spread : ndarray, shape (felt or more, felt or more)
        Their covariance without bounds; what follows them has no bounds [dimensionless].

    Returns
    -------
    ndarray, of the same shape
        [dimensionless]
    """
    sizes = dict(problem.model.linear)
    signed = [place for place, at in enumerate(felt) if problem.model.unknowns[at] in sizes and least[at] == 0.0]
    wanted = point.theta[felt] - bread @ point.gradient[felt]
    ends = {place: (float(point.theta[felt[place]]), float(wanted[place])) for place in signed}
    kept = not_negative(spread, ends)
    kept[signed, signed] = spread[signed, signed]  # its own deviation decides whether it exists at all
    return kept


def not_negative(spread: Array, found: dict[int, tuple[float, float]]) -> Array:
    """Return the covariance about an estimate of normal unknowns, some of which are not negative.

    Each of those is treated separately: the others follow it along their regression on it.

    Parameters
    ----------
    spread : ndarray, shape (p, p)
        Covariance without bounds [dimensionless].
    found : dict[int, tuple of float]
        By the index of an unknown that is not negative: its estimate, and the optimum without bounds [dimensionless].

    Returns
    -------
    ndarray, shape (p, p)
        Never larger than the covariance without bounds [dimensionless].

    Examples
    --------
    >>> not_negative(np.array([[1.0, 0.8], [0.8, 1.0]]), {1: (0.0, -2.0)}).round(2)
    array([[0.52, 0.2 ],
           [0.2 , 0.25]])
    """
    kept = spread.copy()
    for place, (here, wanted) in found.items():
        variance = float(kept[place, place])
        if 0.0 < variance < inf:
            std, freely = sqrt(variance), wanted if wanted < 0.0 else here  # the end of a search counts as its optimum
            share = min(square_about(-freely / std, (here - freely) / std), 1.0)
            most = np.sqrt(np.maximum(np.diag(kept), 0.0) * variance)
            follows = np.clip(kept[place], -most, most)  # rounding may put the correlation of unknowns above 1
            kept -= np.outer(follows, follows) * ((1.0 - share) / variance)
    return kept


def square_about(low: float, point: float) -> float:
    """Return the mean square of a standard normal variable about a point, given that it lies above another one.

    Johnson, Kotz and Balakrishnan 1994, Continuous Univariate Distributions 1, equations 13.134 and 13.135.

    Parameters
    ----------
    low : float
        Lower limit of the variable [dimensionless].
    point : float
        Point about which the mean square is taken [dimensionless].

    Returns
    -------
    float
        [dimensionless]

    Examples
    --------
    >>> square_about(-inf, 0.0), square_about(0.0, 0.0), round(square_about(1.0, 1.0), 3)
    (1.0, 1.0, 0.475)
    """
    if low > FAR:
        return 2.0 / low**2 + 2.0 * (low - point) / low + (low - point) ** 2
    mean = exp(-0.5 * low**2) / sqrt(2.0 * pi) / (0.5 * erfc(low / sqrt(2.0)))
    return 1.0 + (low * mean if mean else 0.0) - 2.0 * point * mean + point**2
