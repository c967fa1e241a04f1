"""Levenberg-Marquardt descent on any criterion that gives its normal equations.

`estimation.identification.search.descent` compiles it together with one criterion, for thousands of starts.
"""

from collections.abc import Callable

import numpy as np

from estimation.arrays import Array
from estimation.identification.search.descent import solve_damped


def levenberg(
    at: Callable[[Array], tuple[float, Array, Array]],
    start: Array,
    acceptable: Callable[[Array], bool],
    *,
    tolerance: float,
    most_steps: int,
    slower: float = 3.0,
    least_gain: float = 0.0,
    within: Callable[[Array, Array, Array, float], tuple[Array, float] | None] | None = None,
) -> tuple[float, Array]:
    """Minimise a sum of squares from one start. A step that is not acceptable is rejected like one that raises it.

    Parameters
    ----------
    at : callable
        Cost, ``J'J`` and half the gradient at given values.
    start : ndarray, shape (p,)
        Where to begin; acceptable.
    acceptable : callable
        Whether values may be evaluated.
    tolerance : float
        Share of the cost that a further step may promise at the end [dimensionless].
    most_steps : int
        Evaluations at most.
    slower : float
        Factor on the damping after a step that gains less than half of what it promised [dimensionless].
    least_gain : float
        Share of the cost; where two accepted steps in a row gain less each, with little damping, the descent ends: with
        much of it a step is short and says nothing [dimensionless].
    within : callable, optional
        Where a step that is not acceptable may lead instead, by values, normal equations and damping, and what the cost
        should fall by; None where there is no such step.

    Returns
    -------
    tuple of (float, ndarray)
        Least cost, and where it is.

    Examples
    --------
    >>> slopes = np.array([[1.0, 0.0], [0.0, 2.0], [1.0, 1.0]])
    >>> wanted = np.array([1.0, 2.0, 2.0])
    >>> def line(x: Array) -> tuple[float, Array, Array]:
    ...     left = slopes @ x - wanted
    ...     return float(left @ left), slopes.T @ slopes, slopes.T @ left
    >>> levenberg(line, np.zeros(2), lambda x: True, tolerance=1e-12, most_steps=20)[1].round(6).tolist()
    [1.0, 1.0]
    """
    theta, step, factor = start.copy(), np.zeros(start.size), np.zeros((start.size, start.size))
    cost, gram, gradient = at(theta)
    damping, idle = 1e-3, 0
    for _ in range(most_steps):
        if not solve_damped(gram, gradient, damping, step, factor):
            damping = max(10.0 * damping, 1e-10)
            continue
        promised = -float(gradient @ step) + damping * float(np.diag(gram) @ step**2)
        trial, near = theta + step, promised <= tolerance * cost
        allowed = acceptable(trial)
        if not allowed and within is not None:
            other = within(theta, gram, gradient, damping)
            if other is not None and acceptable(other[0]):
                (trial, promised), allowed = other, True
                near = promised <= tolerance * cost
        new = at(trial) if allowed else (np.inf, gram, gradient)
        if new[0] < cost:
            gained, theta, (cost, gram, gradient) = cost - new[0], trial, new
            idle = idle + 1 if gained < least_gain * cost and damping <= 1e-2 else 0
            if idle == 2 or (near and damping <= 1e-2):
                break
            damping = max(0.1 * damping, 1e-14) if gained > 0.5 * promised else slower * damping
        elif near or damping > 1e12:
            break
        else:
            damping = max(10.0 * damping, 1e-8)
    return cost, theta
