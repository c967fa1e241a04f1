"""Gauss-Newton steps within a trust region and bounds, for least squares."""

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from estimation.fits.root import root_between

Array = NDArray[np.float64]

FIRST_RADIUS = 30.0
"""Length of the longest first step, in fitted coordinates: logarithms, or typical sizes [dimensionless]."""

REACH = 30.0
"""Regularisation: the slope of a coordinate over this is added to its curvature, so it moves no farther alone
[dimensionless]."""

RIDGE = 1e-6
"""Added to the curvature: an unknown without effect stays where it is [dimensionless]."""

LEAST_GAIN = 1e-3
"""Half the sum of squares that a further step must promise: a smaller gain moves no unknown by a twentieth of its
deviation."""

SHORTEST_STEP = 1e-5
"""Length of a failed step after which the search ends [dimensionless]: the cost is rougher than its slopes say."""

MOST_SHORTENINGS = 12
"""Most often that a step which promises a loss is shortened."""

POOR, GOOD = 0.25, 0.75
"""Ratios of actual to promised gain below which the radius shrinks to that part of it, and above which it grows."""


@dataclass(frozen=True, eq=False)
class Point:
    """Cost and slopes at one point of the search.

    Parameters
    ----------
    theta : ndarray, shape (unknowns,)
        Fitted coordinates [dimensionless].
    cost : float
        Half the sum of squared normalised residuals, with outliers counted linearly, plus the prior's part
        [dimensionless].
    gradient : ndarray, shape (unknowns,)
        Gradient of the cost.
    gram : ndarray, shape (unknowns, unknowns)
        ``J'J`` with each block weighted, plus the prior's part.
    """

    theta: Array
    cost: float
    gradient: Array
    gram: Array


def descend(
    at: Callable[[Array], Point],
    start: Array,
    evaluations: int,
    bounds: tuple[Array, Array],
    least_gain: float = LEAST_GAIN,
    radius: float = FIRST_RADIUS,
    wanted: float = np.inf,
    least_share: float = 0.0,
    good: float = -np.inf,
) -> Point:
    """Return the lowest cost found downhill from a start: Gauss-Newton steps within a trust region and bounds.

    The radius limits the coordinates themselves, mostly logarithms, and not their effects: several unknowns may then
    move far together if their effects cancel (Conn, Gould and Toint 2000, Trust-Region Methods, algorithm 6.1.1).

    Parameters
    ----------
    at : callable
        The cost at given coordinates.
    start : ndarray, shape (unknowns,)
        Where to begin [dimensionless].
    evaluations : int
        Most evaluations of the cost [count].
    bounds : tuple of ndarray, shape (unknowns,)
        Lowest and highest coordinates [dimensionless].
    least_gain : float
        Cost that a further step must promise [dimensionless].
    radius : float
        Length of the longest first step [dimensionless].
    wanted : float
        Cost above which the result is of no use [dimensionless]: a search ends if all remaining steps would not reach
        it, should each gain what the last one did or the next one promises.
    least_share : float
        Share of the cost that is left which a further step must promise [fraction].
    good : float
        Cost below which the search ends: how far it would come is not asked [dimensionless].

    Returns
    -------
    Point
        The best point. Further steps promise less than the least gain, unless all evaluations were used.

    Examples
    --------
    >>> def valley(x: Array) -> Point:
    ...     slopes = np.array([[1.0, 0.0], [-20.0 * x[0], 10.0]])
    ...     errors = np.array([x[0] - 1.0, 10.0 * (x[1] - x[0] ** 2)])
    ...     return Point(x, 0.5 * errors @ errors, slopes.T @ errors, slopes.T @ slopes)
    >>> far = np.full(2, 10.0)
    >>> descend(valley, np.array([-1.2, 1.0]), 40, (-far, far)).theta.round(1).tolist()
    [1.0, 1.0]
    """
    return descend_together(
        lambda thetas: [at(one) for one in thetas],
        [start],
        evaluations,
        bounds,
        least_gain,
        radius,
        wanted,
        least_share,
        good,
    )[0]


def descend_together(
    at_each: Callable[[Sequence[Array]], Sequence[Point]],
    starts: Sequence[Array],
    evaluations: int,
    bounds: tuple[Array, Array],
    least_gain: float = LEAST_GAIN,
    radius: float = FIRST_RADIUS,
    wanted: float = np.inf,
    least_share: float = 0.0,
    good: float = -np.inf,
) -> list[Point]:
    """Return the lowest cost found downhill from each of several starts, with steps in parallel; see `descend`.

    Parameters
    ----------
    at_each : callable
        The costs at several coordinates.
    starts : sequence of ndarray, shape (unknowns,)
        Where to begin [dimensionless].
    evaluations : int
        Most evaluations of the cost for each start [count].
    bounds : tuple of ndarray, shape (unknowns,)
        Lowest and highest coordinates [dimensionless].
    least_gain : float
        Cost that a further step must promise [dimensionless].
    radius : float
        Length of the longest first step [dimensionless].
    wanted : float
        See `descend` [dimensionless].
    least_share : float
        See `descend` [fraction].
    good : float
        See `descend` [dimensionless].

    Returns
    -------
    list of Point
        The best point from each start.
    """

    def worth(best: Point, hoped: float) -> bool:
        return not hoped > wanted and not best.cost < good

    searches = [search(start, evaluations, bounds, least_gain, radius, worth, least_share) for start in starts]
    asked = {i: next(search) for i, search in enumerate(searches)}
    ended: dict[int, Point] = {}
    while asked:
        found = at_each(list(asked.values()))
        for i, point in zip(tuple(asked), found, strict=True):
            try:
                asked[i] = searches[i].send(point)
            except StopIteration as stop:
                ended[i] = stop.value
                del asked[i]
    return [ended[i] for i in range(len(searches))]


def cached_cost(at: Callable[[Array], Point]) -> Callable[[Array], Point]:
    """Return a cost function that is computed once per point: searches from the same starts share their first points.

    Parameters
    ----------
    at : callable
        The cost at given coordinates.
    """
    known: dict[bytes, Point] = {}

    def asked(theta: Array) -> Point:
        place = theta.tobytes()
        if place not in known:
            known[place] = at(theta)
        return known[place]

    return asked


def search(
    start: Array,
    evaluations: int,
    bounds: tuple[Array, Array],
    least_gain: float,
    radius: float,
    worth: Callable[[Point, float], bool],
    least_share: float,
) -> Generator[Array, Point, Point]:
    """Yield the coordinates at which the cost is needed, and return the best point; see `descend`.

    Parameters
    ----------
    start : ndarray, shape (unknowns,)
        Where to begin [dimensionless].
    evaluations : int
        Most evaluations of the cost [count].
    bounds : tuple of ndarray, shape (unknowns,)
        Lowest and highest coordinates [dimensionless].
    least_gain : float
        Cost that a further step must promise [dimensionless].
    radius : float
        Length of the longest first step [dimensionless].
    worth : callable
        ``worth(best, hoped)``: whether to go on, given the best point and the cost that the remaining steps may reach.
    least_share : float
        Share of the remaining cost that a further step must promise [fraction].

    Yields
    ------
    ndarray, shape (unknowns,)
        The next coordinates [dimensionless]; the cost there is to be sent.

    Returns
    -------
    Point
        The best.
    """
    best = yield np.clip(start, *bounds)
    # gain of the last step; infinite (unknown) before the first one, and after one that gained too little
    gained = np.inf
    for left in range(evaluations - 1, 0, -1):
        curvature = best.gram + np.diag(np.abs(best.gradient) / REACH)
        step, promised, radius = _best_step(best, curvature, radius, bounds)
        if promised < max(least_gain, least_share * best.cost):
            break
        if not worth(best, best.cost - left * max(promised, gained)):
            break
        tried = yield best.theta + step
        gain, length = (best.cost - tried.cost) / promised, _length(step)
        if gain <= 0.0 and length < SHORTEST_STEP:
            break
        if gain < POOR:
            radius = POOR * length
        elif gain > GOOD:
            radius = max(radius, 2.0 * length)
        gained = best.cost - tried.cost if gain > POOR else np.inf
        if gain > 0.0:
            best = tried
    return best


def _best_step(
    point: Point, curvature: Array, radius: float, bounds: tuple[Array, Array]
) -> tuple[Array, float, float]:
    """Return the best step, by how much it lowers the quadratic model, and its radius.

    A bound may turn a long step uphill; a shorter one then goes down.
    """
    for _ in range(MOST_SHORTENINGS):
        step = _step(point, curvature, radius, bounds)
        promised = float(-point.gradient @ step - 0.5 * step @ curvature @ step)
        if promised >= 0.0:
            return step, promised, radius
        radius = POOR * _length(step)
    return np.zeros_like(point.theta), 0.0, radius


def _step(point: Point, curvature: Array, radius: float, bounds: tuple[Array, Array]) -> Array:
    """Return the best step by the quadratic model that ends within the radius and within bounds."""
    lower, upper = (bound - point.theta for bound in bounds)
    step = _shortened_step(curvature, point.gradient, radius)
    outside = (step < lower) | (step > upper)
    if not outside.any():
        return step
    step, free = np.clip(step, lower, upper), ~outside
    while free.any():
        rows, held = np.flatnonzero(free)[:, None], np.flatnonzero(~free)
        gradient = point.gradient[free] + curvature[rows, held] @ step[held]
        step[free] = _shortened_step(curvature[rows, rows.T], gradient, radius)
        outside = (step < lower) | (step > upper)
        if not outside.any():
            break
        step = np.clip(step, lower, upper)
        free &= ~outside
    return step


def _shortened_step(curvature: Array, gradient: Array, radius: float) -> Array:
    """Return ``-(C + shift)^-1 g``, with the least shift that makes it no longer than the radius."""
    values, vectors = np.linalg.eigh(curvature)
    values, along = np.maximum(values, 0.0) + RIDGE, vectors.T @ gradient

    def excess(logarithm: float) -> float:
        return _length(along / (values + np.exp(logarithm))) - radius

    shift = 0.0
    if _length(along / values) > radius:
        longest = float(np.log(_length(along) / radius))
        shift = float(np.exp(root_between(excess, float(np.log(RIDGE)) - 40.0, longest, 0.01)))
    return -vectors @ (along / (values + shift))


def _length(vector: Array) -> float:
    """Return a vector's length, bit for bit as `numpy.linalg.norm`, which takes several times as long."""
    return sqrt(vector.dot(vector))
