"""`stalled_clock(time)`: stamps of a computer that was busy at times and stamped rows late.

A converter samples evenly, and its rows wait in a queue. A busy computer stamps none of them, then all waiting rows at
once. So stamps are late, never early, and return to the original line. If rows are lost the stamps do not return, and
if the clock itself has jitter no row is late by several sample times.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from plant.arrays import Array

MOST_EARLY = 0.5
"""How early a row may be stamped at most, in sample times [dimensionless]: stamps jitter beside their stalls."""

LEAST_STALL = 2.0
"""How late a row is at least that waited, in sample times [dimensionless]."""

SIMULTANEOUS_STEP = 0.25
"""Step between rows that are stamped at once, at most, in sample times [dimensionless]."""

MOST_LATE_ROWS = 0.2
"""Share of rows that may have waited [fraction]: the rest tells the clock."""

LEAST_UNEVENNESS = 0.2
"""How far a row's stamp is from halfway between its neighbours', from which its value tells its time [fraction]."""

FEWEST_ROWS = 50
"""Rows from which a clock is told apart from its stalls [count]."""


class StalledClock(NamedTuple):
    """The even clock behind stamps that stall.

    Parameters
    ----------
    start : float
        Time of the first row [s].
    sample_time : float
        Between rows [s].
    stalls : int
        How often stamps stalled.
    longest : float
        By how much a row was late at most [s].
    """

    start: float
    sample_time: float
    stalls: int
    longest: float


def stalled_clock(time: Array) -> StalledClock | None:
    """Return the even clock behind stamps that stall and catch up.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Stamps, not falling [s].

    Returns
    -------
    StalledClock or None
        None where stamps do not stall, rows were lost, or over a fifth of them waited.

    Examples
    --------
    >>> time = 0.01 * np.arange(400.0)
    >>> time[100:110] = time[110]
    >>> found = stalled_clock(time)
    >>> found and (round(found.sample_time, 6), found.stalls, round(found.longest, 6))
    (0.01, 1, 0.1)
    >>> stalled_clock(0.01 * np.arange(400.0)) is None
    True
    """
    if len(time) < FEWEST_ROWS:
        return None
    rows, half = np.arange(float(len(time))), len(time) // 2
    sample_time = float(np.median(time[half:] - time[:-half])) / half
    if not sample_time > 0.0:
        return None
    late = (time - time[0]) / sample_time - rows
    late -= np.median(late)
    waited = late > MOST_EARLY
    begins = np.flatnonzero(waited[1:-1] & ~waited[:-2]) + 1
    at_once = np.diff(time) < SIMULTANEOUS_STEP * sample_time
    stalls = [begin for begin in begins.tolist() if late[begin] > LEAST_STALL and at_once[begin]]
    even = late.min() > -MOST_EARLY and not waited[0] and not waited[-1] and np.mean(waited) < MOST_LATE_ROWS
    if not stalls or not even:
        return None
    start = float(np.mean((time - sample_time * rows)[~waited]))
    return StalledClock(start, sample_time, len(stalls), sample_time * float(np.max(late)))


def is_sampled_evenly(time: Array, channels: Mapping[str, Array], sample_time: float) -> bool:
    """Return whether rows with stalled stamps were sampled evenly, and only stamped late.

    A software loop that overruns gives the same stamps, but it also samples late. If a channel moves, its values tell
    the two apart: at the right times, each value lies nearer to the line between its neighbours.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Stamps, not falling [s].
    channels : Mapping[str, ndarray of shape (n,)]
        What was logged [any unit].
    sample_time : float
        Of the even clock [s].
    """
    late = (time - time[0]) / sample_time - np.arange(float(len(time)))
    waited = np.abs(late - np.median(late)) > MOST_EARLY
    span = time[2:] - time[:-2]
    share = np.divide(time[1:-1] - time[:-2], span, out=np.full_like(span, 0.5), where=span > 0.0)
    near = (waited[:-2] | waited[1:-1] | waited[2:]) & (np.abs(share - 0.5) > LEAST_UNEVENNESS)
    votes = 0.0
    for values in channels.values():
        rise, whole = values[1:-1] - values[:-2], values[2:] - values[:-2]
        even, stamped = (np.nansum((rise - part * whole)[near] ** 2) for part in (0.5, share))
        if even > 0.0 and stamped > 0.0:
            votes += float(np.log(even / stamped))
    return votes <= 0.0
