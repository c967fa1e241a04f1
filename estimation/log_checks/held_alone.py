"""A single channel that was constant for a while: its logger had no new sample.

If a channel is noisy on either side, it cannot repeat one value for long. Those samples are left out as missing. A
sensor that never comes back, or is constant for long, is reported instead (`sensor_check`).
"""

import numpy as np

from estimation.arrays import BoolArray
from estimation.log_checks.channel_names import PRESSURES, SPEED, VELOCITY
from estimation.notes import SensorCode
from estimation.stretches import stretches
from plant.arrays import Array
from plant.log.record import Record
from plant.notes import Note

CHECKED_CHANNELS = (SPEED, VELOCITY, *PRESSURES)
"""Channels that are checked. A piston at rest repeats its position too; a jump shows the difference
(`discontinuities`)."""

FEWEST_ROWS, BESIDE = 20, 50
"""Least rows that a channel repeats, and rows on either side that show its noise [count]."""

REPEATS, LONGER = 0.1, 4.0
"""Largest share of those rows that repeat the one before [fraction]; and length of a hold over any other
[dimensionless]: rest, a clipped pressure and a coarse sensor recur."""

NOISY, LEAST_NOISE = 1.0, 1e-5
"""Least ratio of fourth to third differences for noise, 1.9 on average and far smaller for motion [dimensionless]; and
the least share of a channel's range that is noise, and not rounding of the file [fraction]."""

MOST_HELD = 0.2
"""Largest share of a log for which a channel may be held [fraction]."""


def without_temporary_holds(record: Record) -> tuple[Record, tuple[Note, ...]]:
    """Return a log without the samples of a channel that its logger only repeated for a while.

    Parameters
    ----------
    record : Record
        The log; rows that repeat all channels are already missing.
    """
    changed: dict[str, Array] = {}
    notes: list[Note] = []
    for name in (one for one in CHECKED_CHANNELS if one in record):
        held = _held_samples(record[name])
        if not np.any(held):
            continue
        first, _ = stretches(held)
        begin = float(record.time[first[0]])
        seconds = record.sample_time * float(np.count_nonzero(held))
        notes.append(SensorCode.HELD_ALONE.note(channel=name, seconds=seconds, count=len(first), begin_s=begin))
        changed[name] = np.where(held, np.nan, record[name])
    return (record.replace(**changed), tuple(notes)) if notes else (record, ())


def _held_samples(values: Array) -> BoolArray:
    """Return which samples repeat the one before, where the channel itself would not."""
    out = np.zeros(len(values), dtype=np.bool_)
    first, behind = stretches(np.append(False, np.diff(values) == 0.0))
    lengths = behind - first
    long = np.flatnonzero(lengths >= FEWEST_ROWS)
    if not len(long) or np.sum(lengths[long]) > MOST_HELD * len(values):
        return out
    rest = np.delete(lengths, long)
    usual = int(np.max(rest, initial=1))
    ends = {float(np.nanmax(values)), float(np.nanmin(values))}
    for k in long.tolist():
        a, b = int(first[k]), int(behind[k])
        if lengths[k] < LONGER * usual or float(values[a]) in ends or values[a] == 0.0:
            return np.zeros_like(out)
        beside = values[max(0, a - 1 - BESIDE) : max(0, a - 1)], values[b : b + BESIDE]
        if not all(len(one) == BESIDE and is_noisy(one, LEAST_NOISE * (max(ends) - min(ends))) for one in beside):
            return np.zeros_like(out)
        out[a:b] = True
    return out


def is_noisy(values: Array, least: float) -> bool:
    """Return whether nearly every row of a part shows noise.

    Parameters
    ----------
    values : ndarray, shape (n,)
        The part [any unit].
    least : float
        Size of third differences above a file's rounding [unit of the channel].

    Examples
    --------
    >>> time = 1e-3 * np.arange(50)
    >>> is_noisy(np.sin(60.0 * time), 1e-5)
    False
    >>> is_noisy(np.sin(60.0 * time) + np.random.default_rng(1).normal(0.0, 1e-3, 50), 1e-5)
    True
    """
    there = values[np.isfinite(values)]
    if len(there) < 5:
        return False
    bends, rough = (np.median(np.abs(np.diff(there, order))) for order in (3, 4))
    return bool(np.mean(np.diff(there) == 0.0) < REPEATS and bends > least and rough > NOISY * bends)
