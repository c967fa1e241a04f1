"""`annealed(problem, point, ...) -> Point`: escape from a minimum that nearly explains a log, by larger noise.

Where the piston sticks and slips, the misfit has pits a few thousandths apart. In which of them a descent ends hangs on
rounding: one part in 1e13 of the noise decides. Under larger noise of increments the pits are not there.
"""

from collections.abc import Callable

from estimation.fits.greybox.descent import Point, descend
from estimation.fits.greybox.freed_problem import FreedProblem
from plant.arrays import Array

LARGER_WALK = 1e3
"""Factor on the random walk of the residual under which an end is left [dimensionless]: a way on which starts are
brought near, but with model steps as short as the log's. Longer ones end in chatter that is no motion."""

LEAVING, RETURNING = 12, 100
"""Evaluations of the model on the way out and back. Descents of 25 were still falling by tenths at their last."""

LEFT_BY = 0.01
"""Cost that a further step must promise on the way out [dimensionless]."""

TIMES = 3
"""How often at most an end is left."""


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
    problem : FreedProblem
        The problem.
    point : Point
        Where a descent ended.
    bounds : tuple of ndarray, shape (unknowns,)
        Lowest and highest coordinates [dimensionless].
    promising : float
        Cost that a further step must promise on the way back [dimensionless].
    deeper : float
        Fall of the cost from which an end is left in its turn [dimensionless].
    at : callable, optional
        Returns a problem's misfit as a function of the coordinates; `FreedProblem.at` by default.
    least_share : float
        Share of the cost that a further step must promise on the way back [fraction].

    Returns
    -------
    Point
        No worse than the one given.
    """
    softened = problem.on(problem.log.softened(1.0, LARGER_WALK))
    for _ in range(TIMES):
        near = descend(at(softened), point.theta, LEAVING, bounds, LEFT_BY)
        back = descend(at(problem), near.theta, RETURNING, bounds, promising, least_share=least_share)
        gained = point.cost - back.cost
        point = back if gained > 0.0 else point
        if gained < deeper:
            break
    return point
