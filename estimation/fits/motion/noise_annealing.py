"""`annealed(problem, point, ...) -> Point`: escape from a minimum that nearly explains a log, by larger noise.

With stick-slip the cost has local minima a few thousandths apart. In which of them a descent ends depends on rounding:
one part in 1e13 of the noise decides. With a larger random walk they disappear.
"""

from collections.abc import Callable

from estimation.fits.greybox.descent import Point, descend
from estimation.fits.greybox.freed_problem import FreedProblem
from plant.arrays import Array

LARGER_WALK = 1e3
"""Factor on the random walk of the residual for the escape [dimensionless]. Model steps stay as short as the log's:
longer ones end in chatter."""

LEAVING, RETURNING = 12, 100
"""Evaluations of the model for the escape and the return. Descents of 25 were still falling by tenths at their last."""

ESCAPE_GAIN = 0.01
"""Cost that a further step of the escape must promise [dimensionless]."""

MOST_ESCAPES = 3
"""Most escapes."""


def annealed(
    problem: FreedProblem,
    point: Point,
    bounds: tuple[Array, Array],
    promising: float,
    deeper: float,
    at: Callable[[FreedProblem], Callable[[Array], Point]] = lambda problem: problem.at,
    least_share: float = 0.0,
) -> Point:
    """Return the lowest minimum that is found.

    Parameters
    ----------
    point : Point
        Where a descent ended.
    bounds : tuple of ndarray, shape (unknowns,)
        Lowest and highest coordinates [dimensionless].
    promising : float
        Cost that a further step of the return must promise [dimensionless].
    deeper : float
        Decrease of the cost from which another escape is made [dimensionless].
    at : callable, optional
        A problem's cost as a function of the coordinates; `FreedProblem.at` by default.
    least_share : float
        Share of the cost that a further step of the return must promise [fraction].

    Returns
    -------
    Point
        No worse than the one given.
    """
    softened = problem.on(problem.log.with_larger_noise(1.0, LARGER_WALK))
    for _ in range(MOST_ESCAPES):
        near = descend(at(softened), point.theta, LEAVING, bounds, ESCAPE_GAIN)
        back = descend(at(problem), near.theta, RETURNING, bounds, promising, least_share=least_share)
        gained = point.cost - back.cost
        point = back if gained > 0.0 else point
        if gained < deeper:
            break
    return point
