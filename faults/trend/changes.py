"""Where a series of logs jumps: a repair that nobody wrote down, another pump, a seal that burst."""

from collections.abc import Collection, Iterator

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from faults.trend.kalman import Belief, Settings, beliefs, evidence_of, first_belief, next_belief
from plant.arrays import Array

FEWEST, LATEST = 3, 6
"""Logs of a new stretch from which a jump is seen, and up to which it is looked for [count]."""

JUMP = 4.0
"""Jump of the medians, in standard deviations of a log, from which a change is tried [dimensionless]."""

RARE = 1.0 / 200.0
"""Jumps that are expected a log [probability]."""


def stretches(
    times: Array, values: Array, stds: Array, known: Collection[int], grid: Settings
) -> Iterator[tuple[int, Belief]]:
    """Yield, after each log, where its stretch begins and what is believed of it; later logs play no part.

    Parameters
    ----------
    times, values, stds : ndarray, shape (n,)
        As `faults.trend.kalman.beliefs` takes them.
    known : collection of int
        Logs with which a stretch begins for certain: the first after each maintenance.
    grid : Settings
        The grid.

    Yields
    ------
    tuple of int and Belief
        Place of the stretch's first log, and the belief.
    """
    jumped = {length: jumps(values, stds, length) for length in range(FEWEST, LATEST + 1)}
    start, run = 0, [first_belief(grid)]
    for place in range(len(values)):
        if place in known and place > start:
            start, run = place, [first_belief(grid)]
        step = float(times[place] - times[place - 1]) if place > start else 0.0
        run.append(next_belief(run[-1], step, float(values[place]), float(stds[place]), grid))
        for length, large in jumped.items():
            begin = place + 1 - length
            if begin - start < FEWEST or not large[begin]:
                continue
            fresh = list(beliefs(times[begin : place + 1], values[begin : place + 1], stds[begin : place + 1], grid))
            apart = evidence_of(run[begin - start], grid) + evidence_of(fresh[-1], grid) + np.log(RARE)
            if apart > evidence_of(run[-1], grid):
                start, run = begin, [first_belief(grid), *fresh]
                break
        yield start, run[-1]


def jumps(values: Array, stds: Array, length: int) -> "np.ndarray[tuple[int], np.dtype[np.bool_]]":
    """Return the logs from which on the next ones lie far from those before.

    Parameters
    ----------
    values, stds : ndarray, shape (n,)
        What each log says, and its own standard deviation [one unit].
    length : int
        So many logs from each on; `FEWEST` before it, and the scatter of `LATEST` [count].

    Returns
    -------
    ndarray of bool, shape (n,)
        Whether the medians lie more than `JUMP` apart; False where there are too few logs on either side.
    """
    count = len(values)
    found = np.zeros(count, dtype=np.bool_)
    if count < FEWEST + length:
        return found
    later = np.median(sliding_window_view(values, length), axis=1)[FEWEST:]
    noise = np.median(sliding_window_view(stds, length), axis=1)[FEWEST:]
    before = np.median(sliding_window_view(values, FEWEST), axis=1)[: len(later)]
    steps = np.concatenate([np.zeros(LATEST - 1), np.abs(np.diff(values))])
    scatter = 1.4826 / np.sqrt(2.0) * np.median(sliding_window_view(steps, LATEST), axis=1)[FEWEST - 2 :][: len(later)]
    found[FEWEST : FEWEST + len(later)] = np.abs(later - before) > JUMP * np.maximum(scatter, noise)
    return found
