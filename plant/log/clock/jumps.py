"""Clocks that were set during a log, and counters that overflowed: stamps jump although rows were sampled evenly."""

import numpy as np

from plant.arrays import Array
from plant.log.clock.jitter import GAP, usual_step

HOUR = 3600.0

MOST_HOURS, MOST_JUMPS = 24, 2
"""Hours that a clock is set by at most, and how often within a log [count]."""

ROUNDING = 1e-9
"""Share of an hour by which rounding may move a step [fraction]."""

LONGEST_STEP = 1.0
"""Longest step of stamps at which an hour, and a step, is no pause that came out so by chance [s]."""

COUNTER_BITS = (16, 24, 31, 32)
"""Bits of a counter that a logger or a controller keeps its time in [count]."""

FINEST_TICK_DECIMALS = 9
"""Decimal places of a second in the finest tick of such a counter [count]."""

BY_CHANCE, OFTEN = 1e-3, 3
"""Step over what a counter counts to, from which a fall may be as long by chance, unless it comes so often [fraction,
count]; judged: of ten such lengths a decade, a few thousandths are hit."""


def without_jumps(time: Array) -> tuple[Array, list[tuple[int, int]]]:
    """Return stamps without jumps of whole hours: the next row comes one step after the last.

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
    longest = _longest_regular_step(np.delete(step, far))
    hours = np.floor(step[far] / HOUR + ROUNDING)
    left = np.maximum(0.0, step[far] - HOUR * hours)
    if not longest <= GAP * LONGEST_STEP or np.any((left > longest) | (np.abs(hours) > MOST_HOURS)):
        return time, []
    out = time.copy()
    for row, after in zip(far, left, strict=True):
        out[row + 1 :] -= step[row] - after
    return out, [(int(row) + 1, int(jump)) for row, jump in zip(far, hours, strict=True)]


def _longest_regular_step(step: Array) -> float:
    """Return the longest step that skips no row."""
    if not len(step):
        return np.inf
    return GAP * max(usual_step(step), float(np.min(step[step > 0.0], initial=np.inf)))


def stray_ends(time: Array, most_missing: float) -> tuple[int, ...]:
    """Return the first and the last row where their time alone does not fit: 0, -1, both or none.

    A logger may stamp its first row late, or before its clock is set, and its last row when it is already off. A time
    does not fit if it falls back, or leaves a gap of more samples than a log may lack.

    Parameters
    ----------
    time : ndarray, shape (n,)
        The stamps [s].
    most_missing : float
        Share of the samples that a log may lack [fraction].

    Examples
    --------
    >>> even = 0.01 * np.arange(100.0)
    >>> stray_ends(np.r_[0.015, even[1:]], 0.05), stray_ends(np.r_[even[:-1], 0.0], 0.05), stray_ends(even, 0.05)
    ((0,), (-1,), ())
    """
    step = np.diff(time)
    usual = usual_step(step) if (step > 0.0).any() else 0.0
    wrong = np.flatnonzero((step < 0.0) | (step > most_missing * len(time) * usual))
    ends = {0: 0, len(step) - 1: -1}
    if not usual > 0.0 or not len(wrong) or any(int(row) not in ends for row in wrong):
        return ()
    return tuple(ends[int(row)] for row in wrong)


def without_overruns(time: Array) -> tuple[Array, tuple[int, int, float] | None]:
    """Return stamps of a counter that overflowed, as if it had gone on counting.

    All falls have the same size: 2^16, 2^24, 2^31 or 2^32 ticks of a power of ten of a second, less one step. If a test
    starts again, its stamps fall back to the start of the log; these stay unchanged.

    Parameters
    ----------
    time : ndarray, shape (n,)
        The stamps [s].

    Returns
    -------
    ndarray, shape (n,)
        The stamps [s].
    tuple of int, int and float, or None
        Number of overflows, the first row after the first one (from 0), and the period of the counter [s].

    Examples
    --------
    >>> on, overruns = without_overruns((0.06 + 1e-3 * np.arange(150.0)) % 0.065536)
    >>> overruns, float(round(on[-1], 9))
    ((3, 6, 0.065536), 0.209)
    """
    step = np.diff(time)
    falls = np.flatnonzero(step < 0.0)
    if not 0 < len(falls) < len(step) // 2:
        return time, None
    rising = np.delete(step, falls)
    usual, longest = float(np.median(rising)), _longest_regular_step(rising)
    spans = np.array([2.0**bits * 10.0**-places for bits in COUNTER_BITS for places in range(FINEST_TICK_DECIMALS + 1)])
    after = spans + float(np.median(step[falls]))
    span = float(spans[np.argmin(np.abs(after - usual))])
    left = step[falls] + span
    begins_again = np.abs(time[falls + 1] - time[0]) <= 0.1 * usual
    chance = longest > BY_CHANCE * span and len(falls) < OFTEN
    if np.any((left < 0.5 * usual) | (left > longest)) or begins_again.all() or chance or not usual > 0.0:
        return time, None
    out = time.copy()
    out[1:] += span * np.cumsum(step < 0.0)
    return out, (len(falls), int(falls[0]) + 1, span)
