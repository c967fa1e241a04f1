"""Jumps in a series of logs: an unrecorded repair, another pump, a burst seal."""

from collections.abc import Collection, Iterator

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from faults.trend.kalman import JUMP_PRIOR, Belief, Settings, beliefs, evidence_of
from plant.arrays import Array

FEWEST, LATEST = 3, 6
"""Number of logs of a new stretch from which a jump can be seen, and up to which it is searched for [count]."""

JUMP = 4.0
"""Jump of the medians, in standard deviations of a log, at which a change is tried [dimensionless]."""


def stretches(
    times: Array, values: Array, stds: Array, known: Collection[int], grid: Settings
) -> Iterator[tuple[int, Belief]]:
    """Yield the first log of the stretch and the belief after each log; later logs are not used.

    Parameters
    ----------
    times, values, stds : ndarray, shape (n,)
        As in `faults.trend.kalman.beliefs`.
    known : collection of int
        Logs with which a stretch certainly begins: the first after each maintenance.
    grid : Settings
        The grid.

    Yields
    ------
    tuple of int and Belief
        Index of the stretch's first log, and the belief.
    """
    jumped = {length: jumps(values, stds, length) for length in range(FEWEST, LATEST + 1)}
    start, run = 0, beliefs(times, values, stds, grid)
    for place in range(len(values)):
        if place in known and place > start:
            start, run = place, beliefs(times[place:], values[place:], stds[place:], grid)
        for length, large in jumped.items():
            begin = place + 1 - length
            if begin - start < FEWEST or not large[begin]:
                continue
            later = slice(begin, place + 1)
            fresh = beliefs(times[later], values[later], stds[later], grid)[-1]
            apart = evidence_of(run[begin - start], grid) + evidence_of(fresh, grid) + np.log(JUMP_PRIOR)
            if apart > evidence_of(run[place + 1 - start], grid):
                start, run = begin, beliefs(times[begin:], values[begin:], stds[begin:], grid)
                break
        yield start, run[place + 1 - start]


def jumps(values: Array, stds: Array, length: int) -> "np.ndarray[tuple[int], np.dtype[np.bool_]]":
    """Return the logs at which the following logs lie far from those before.

    Parameters
    ----------
    values, stds : ndarray, shape (n,)
        Value of each log, and its own standard deviation [one unit].
    length : int
        Number of logs compared from each log on; `FEWEST` before it, and the scatter of `LATEST` [count].

    Returns
    -------
    ndarray of bool, shape (n,)
        Whether the medians differ by more than `JUMP`; False if there are too few logs on either side.
    """
    count = len(values)
    found = np.zeros(count, dtype=np.bool_)
    if count < FEWEST + length:
        return found
    later, noise = _medians(values, length)[FEWEST:], _medians(stds, length)[FEWEST:]
    before = _medians(values, FEWEST)[: len(later)]
    steps = np.concatenate([np.zeros(LATEST - 1), np.abs(np.diff(values))])
    scatter = 1.4826 / np.sqrt(2.0) * _medians(steps, LATEST)[FEWEST - 2 :][: len(later)]
    found[FEWEST : FEWEST + len(later)] = np.abs(later - before) > JUMP * np.maximum(scatter, noise)
    return found


def _medians(values: Array, length: int) -> Array:
    """Return the median of each value and its next neighbours; `numpy.median` is ten times slower on so few."""
    ranked = np.sort(sliding_window_view(values, length), axis=1)
    return 0.5 * (ranked[:, (length - 1) // 2] + ranked[:, length // 2])
