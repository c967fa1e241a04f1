"""Dropouts: rows that a logger filled with its last ones, and gaps of one channel that matter to the flow balance.

A logger that misses data may write its last row again and again. Only the end distinguishes that from rest: piston or
pressure then jump farther than they ever move from one row to the next.
"""

import numpy as np
from numpy.typing import NDArray

from estimation.log_checks.bridging import gaps, within_gaps
from estimation.log_checks.channel_names import POSITION, PRESSURE, PRESSURES, SPEED, VELOCITY
from estimation.log_checks.order import median
from estimation.notes import SensorCode
from estimation.stretches import in_long_stretches, stretches
from plant.arrays import Array
from plant.log.record import Record
from plant.notes import Note

CHECKED_CHANNELS = (SPEED, POSITION, VELOCITY, *PRESSURES)
"""Channels that a row must repeat, if they are logged."""

FEWEST_CHANNELS, FEWEST_ROWS = 3, 10
"""Least logged channels, and least repeated rows, for a dropout [count]."""

JUMP = 2.0
"""Ratio of the jump at the end of a dropout to the largest step elsewhere [dimensionless]."""

LONG_GAP = 5
"""Missing samples in a row from which a straight line across the gap is of no use [samples]."""


def without_dropouts(record: Record) -> tuple[Record, tuple[Note, ...]]:
    """Return a log without the rows that its logger only repeated.

    Returns
    -------
    tuple of (Record, tuple of Note)
        The log, with those rows missing in all channels, and a note for each channel if there are any.
    """
    asked = [name for name in CHECKED_CHANNELS if name in record]
    if len(asked) < FEWEST_CHANNELS:
        return record, ()
    again = record[asked[0]][1:] == record[asked[0]][:-1]
    for name in asked[1:]:
        if np.count_nonzero(again) < FEWEST_ROWS:
            return record, ()
        again &= record[name][1:] == record[name][:-1]
    first, behind = (ends + 1 for ends in stretches(again))
    long = (behind - first >= FEWEST_ROWS) & (behind < len(record))
    first, behind = first[long], behind[long]
    if not len(first):
        return record, ()
    # a motor may leave rest from one row to the next; neither the piston nor the pressure does
    ended = np.any([_jumps(record[name], behind) for name in asked if name != SPEED], axis=0)
    dropped = np.zeros(len(record), dtype=np.bool_)
    for begin, end in zip(first[ended], behind[ended], strict=True):
        dropped[begin:end] = True
    if not np.any(dropped):
        return record, ()
    rows, count = int(np.count_nonzero(dropped)), int(np.count_nonzero(ended))
    notes = tuple(SensorCode.DROPOUT.note(channel=name, rows=rows, count=count) for name in asked)
    return record.replace(**{name: np.where(dropped, np.nan, record[name]) for name in asked}), notes


def _jumps(values: Array, at: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return whether a channel's steps to some samples exceed all of its steps elsewhere."""
    steps = np.abs(np.diff(values))
    there = steps[at - 1]
    steps[at - 1] = 0.0
    return there > JUMP * np.nanmax(steps, initial=0.0)


def without_pauses(record: Record) -> Record:
    """Return a log for the flow balance, in which a long gap of motor speed or position is a gap of all channels.

    Without either, pressure within the gap is of no use, and the missing pumped or swept volume follows from the other
    only if nothing leaks, opens or runs empty.

    Parameters
    ----------
    record : Record
        The log, with motor speed, position and differential pressure.

    Returns
    -------
    Record
        Unchanged if there is no such gap.
    """
    gone = long_gaps(record[SPEED]) | long_gaps(record[POSITION])
    if not np.any(gone):
        return record
    return record.replace(**{name: np.where(gone, np.nan, record[name]) for name in (SPEED, POSITION, PRESSURE)})


def long_gaps(values: Array) -> NDArray[np.bool_]:
    """Return the samples in gaps of `LONG_GAP` samples or more; never between those of a slow channel.

    Parameters
    ----------
    values : ndarray, shape (n,)
        A channel [any unit]; NaN where missing.

    Returns
    -------
    ndarray of bool, shape (n,)
        Whether a sample is in one; nowhere in an empty channel.

    Examples
    --------
    >>> gone = np.nan
    >>> np.flatnonzero(long_gaps(np.array([1.0, gone, 1.0, 1.0, gone, gone, gone, gone, gone, 1.0]))).tolist()
    [4, 5, 6, 7, 8]
    """
    missing = np.isnan(values)
    if np.count_nonzero(missing) < LONG_GAP or missing.all():
        return np.zeros(len(values), dtype=np.bool_)
    apart, _ = gaps(values)
    usual = median(apart) if len(apart) else 1.0
    return in_long_stretches(within_gaps(values), max(LONG_GAP, usual))  # at its end a slow channel lacks fewer rows
