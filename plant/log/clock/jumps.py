"""A clock that is set while it is logged: hours that stamps jump by where rows go on evenly."""

import numpy as np

from plant.arrays import Array
from plant.log.clock.jitter import GAP, usual_step

HOUR = 3600.0

MOST_HOURS, MOST_JUMPS = 24, 2
"""Hours that a clock is set by at most, and how often within a log [count]."""

ROUNDING = 1e-9
"""Share of an hour by which rounding may move a step [fraction]."""

SLOWEST = 1.0
"""Longest step of stamps at which an hour, and a step, is no pause that came out so by chance [s]."""


def without_jumps(time: Array) -> tuple[Array, list[tuple[int, int]]]:
    """Return stamps without jumps of whole hours, after which the next row comes one step later.

    Parameters
    ----------
    time : ndarray, shape (n,)
        The stamps [s].

    Returns
    -------
    ndarray, shape (n,)
        The stamps; from each jump on, set back by its hours [s].
    list of tuple of int
        The row of each jump, from 0, and its hours.

    Examples
    --------
    >>> even = 0.01 * np.arange(100.0)
    >>> back, jumps = without_jumps(even - 3600.0 * (even > 0.495))
    >>> jumps, float(np.abs(back - even).max()) < 1e-9
    ([(50, -1)], True)
    """
    step = np.diff(time)
    far = np.flatnonzero(np.abs(step) > 0.5 * HOUR)
    if not 0 < len(far) <= MOST_JUMPS:
        return time, []
    near = np.delete(step, far)
    longest = GAP * max(usual_step(near), float(np.min(near[near > 0.0], initial=np.inf))) if len(near) else np.inf
    hours = np.floor(step[far] / HOUR + ROUNDING)
    left = np.maximum(0.0, step[far] - HOUR * hours)
    if not longest <= GAP * SLOWEST or np.any((left > longest) | (np.abs(hours) > MOST_HOURS)):
        return time, []
    out = time.copy()
    for row, after in zip(far, left, strict=True):
        out[row + 1 :] -= step[row] - after
    return out, [(int(row) + 1, int(jump)) for row, jump in zip(far, hours, strict=True)]
