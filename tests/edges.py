"""Finds the edge of a verdict: the size of an input at which the verdict changes."""

from collections.abc import Callable
from typing import Any

STEPS = 24
"""Number of bisections of the interval [count]: the edge is accurate to about 1e-7 of it."""


def edge(told: Callable[[float], Any], low: float, high: float, steps: int = STEPS) -> float | str:
    """Return the size at which a verdict changes, by bisection.

    Parameters
    ----------
    told : callable
        Returns the verdict, which can be compared, at a size [any unit].
    low, high : float
        Sizes between which the verdict changes once [the same unit].
    steps : int
        Number of bisections [count].

    Returns
    -------
    float or str
        The size; or a text if the verdict does not change.

    Examples
    --------
    >>> round(edge(lambda size: size > 0.3, 0.0, 1.0), 6)
    0.3
    """
    first = told(low)
    if told(high) == first:
        return f"always {first}"
    for _ in range(steps):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if told(middle) == first else (low, middle)
    return 0.5 * (low + high)
