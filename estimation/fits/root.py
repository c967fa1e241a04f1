"""A root between two ends, by Brent's method (1973, Algorithms for Minimization without Derivatives, chapter 4).

The steps are those of `scipy.optimize.brentq`, to the bit. Importing scipy.optimize takes longer than the fit of a log.
"""

from collections.abc import Callable
from math import copysign, inf
from sys import float_info

MOST_STEPS = 100
"""Bisection alone needs fewer steps, for any tolerance and finite ends."""


def root_between(function: Callable[[float], float], low: float, high: float, tolerance: float) -> float:
    """Return the root of a function between two ends at which its signs differ.

    Parameters
    ----------
    function : callable
        A continuous function of one number.
    low, high : float
        The ends [any unit].
    tolerance : float
        Largest error of the root [unit of the ends].

    Returns
    -------
    float
        The root.

    Raises
    ------
    ValueError
        If the signs do not differ.

    Examples
    --------
    >>> round(root_between(lambda x: x * x - 2.0, 0.0, 2.0, 1e-12), 9)
    1.414213562
    """
    old, here = (low, function(low)), (high, function(high))
    if old[1] * here[1] > 0.0:
        raise ValueError(f"a root wants ends of unlike signs, got {old[1]} and {here[1]}")
    across, last, step = old, 0.0, 0.0
    for _ in range(MOST_STEPS):
        if (old[1] < 0.0) != (here[1] < 0.0):
            across, last = old, here[0] - old[0]
            step = last
        if abs(across[1]) < abs(here[1]):
            old, here, across = here, across, here
        least = 0.5 * (tolerance + 4.0 * float_info.epsilon * abs(here[0]))
        half = 0.5 * (across[0] - here[0])
        if here[1] == 0.0 or abs(half) < least:
            break
        tempting = abs(last) > least and abs(here[1]) < abs(old[1])
        tried = _interpolated(old, here, across) if tempting else inf
        last, step = (step, tried) if 2.0 * abs(tried) < min(abs(last), 3.0 * abs(half) - least) else (half, half)
        x = here[0] + (step if abs(step) > least else copysign(least, half))
        old, here = here, (x, function(x))
    return here[0]


def _interpolated(old: tuple[float, float], here: tuple[float, float], across: tuple[float, float]) -> float:
    """Return the secant step for two points, or the step by inverse quadratic interpolation for three.

    It is infinite, and so not taken, if values are so small that their products underflow to zero.
    """
    (x, y), (x_old, y_old), (x_across, y_across) = here, old, across
    if x_old == x_across:
        return -y * (x - x_old) / (y - y_old)
    slope, other = (y_old - y) / (x_old - x), (y_across - y) / (x_across - x)
    divisor = other * slope * (y_across - y_old)
    return -y * (y_across * other - y_old * slope) / divisor if divisor else inf
