"""Where a verdict turns: the size of an input at which what is told of it changes, a number that a limit decides."""

from collections.abc import Callable
from typing import Any

STEPS = 24
"""Halvings of the interval: an edge is found to some 1e-7 of it [count]."""


def edge(told: Callable[[float], Any], low: float, high: float, steps: int = STEPS) -> float | str:
    """Return the size at which a verdict changes, by bisection.

    Parameters
    ----------
    told : callable
        From a size [any unit] to a verdict that can be compared.
    low, high : float
        Sizes between which the verdict changes once [the same unit].
    steps : int
        Halvings [count].

    Returns
    -------
    float or str
        The size; or that nothing changes.

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
