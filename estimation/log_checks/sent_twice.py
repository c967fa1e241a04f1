"""Rows that a logger wrote twice: a repeated packet was stored under other times.

Noise never repeats a row of several channels digit by digit, and rest repeats one row more than a few times. So a
sequence of rows that each occur in few places, at one distance in time, was sent again.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from estimation.arrays import BoolArray, IntArray
from estimation.log_checks.channel_names import MEASURED, SPEED
from estimation.log_checks.held_alone import LEAST_NOISE, is_noisy
from estimation.notes import SensorCode
from estimation.stretches import stretches
from plant.arrays import Array
from plant.log.record import Record
from plant.notes import Note

FEWEST_CHANNELS, FEWEST_ROWS = 3, 5
"""Least logged channels, and least rows in a repeated sequence [count]."""

MOST_PLACES = 4
"""Most places of a log in which such a row may occur: more means rest, or a periodic drive without noise [count]."""

FARTHEST = 0.2
"""Share of the log by which a copy may follow: a run without noise repeats after a period of its drive [fraction]."""

JUMP = 3.0
"""Usual steps of a channel by which a copy jumps back at its beginning, if no noise proves that it is one: a periodic
drive has no jump."""


FEWEST_ANY, DISTINCT = 10, 0.8
"""Least rows of a copy of unknown columns [count], and the share of them that differ in a noisy column [fraction]: two
coarse columns repeat a few rows by chance, and a plant at rest repeats its level."""


def without_rows_sent_twice(record: Record, columns: Sequence[str] | None = None) -> tuple[Record, tuple[Note, ...]]:
    """Return a log without rows that its logger wrote again.

    If a channel continues after the copy as if no time had passed, the copy is cut out and the clock closed up.
    Otherwise the copy replaced rows that were lost, and these are missing.

    Parameters
    ----------
    record : Record
        The log.
    columns : sequence of str, optional
        Two columns or more of unknown meaning; one of them must be noisy where rows are repeated. By default the
        channels of an actuator.

    Returns
    -------
    tuple of (Record, tuple of Note)
        The log, and a note if there are such rows.

    Examples
    --------
    >>> rows = np.cumsum(np.random.default_rng(1).standard_normal((3, 200)), axis=1)
    >>> sent = rows[:, np.r_[0:110, 100:200]]  # ten rows came again
    >>> names = ("motor_speed_rad_s", "position_m", "differential_pressure_pa")
    >>> len(without_rows_sent_twice(Record(1e-3, dict(zip(names, sent, strict=True))))[0])
    200
    """
    asked = [name for name in columns or MEASURED if name in record]
    if len(asked) < (FEWEST_CHANNELS if columns is None else 2):
        return record, ()
    copies = _copies(np.stack([record[name] for name in asked]), known=columns is None)
    if not len(copies[0]):
        return record, ()
    copied = np.zeros(len(record), dtype=np.bool_)
    for first, behind in zip(*copies, strict=True):
        copied[first:behind] = True
    shown = [record[name] for name in asked if name != SPEED or columns is not None]
    time_passed = sum(_evidence_of_elapsed_time(values, *copies) for values in shown) > 0.0
    data = {"rows": int(np.count_nonzero(copied)), "count": len(copies[0])}
    notes = (SensorCode.SENT_TWICE.note(channel=SPEED if SPEED in asked else asked[0], **data),)
    if time_passed:
        return record.replace(**{name: np.where(copied, np.nan, record[name]) for name in asked}), notes
    kept = {name: record[name][~copied] for name in record}
    return Record(record.sample_time, kept, record.metadata, record.start_time), notes


def _copies(rows: Array, *, known: bool) -> tuple[IntArray, IntArray]:
    """Return the first row of each copy, and the one after its last; rows have shape (channels, n)."""
    bits = np.ascontiguousarray(rows).view(np.uint64)
    keys = np.zeros(rows.shape[1], dtype=np.uint64)
    for one in bits:
        keys = (keys ^ one) * np.uint64(0x9E3779B97F4A7C15)
        keys ^= keys >> np.uint64(29)
    order = np.argsort(keys, kind="stable")
    same = np.diff(keys[order]) == 0
    none = np.empty(0, dtype=np.int64)
    if np.count_nonzero(same) < FEWEST_ROWS:
        return none, none
    lag = np.zeros(len(keys), dtype=np.int64)
    lag[order[1:][same]] = np.diff(order)[same]
    often = np.zeros(len(keys), dtype=np.bool_)
    for first, behind in zip(*stretches(np.append(False, same)), strict=True):
        often[order[first - 1 : behind]] = behind - first + 1 > MOST_PLACES
    again = (lag > 0) & (lag <= FARTHEST * len(keys)) & ~often & np.all(np.isfinite(rows), axis=0)
    found = [
        (a, b) for a, b in _copies_at_one_lag(again, lag) if b - a >= FEWEST_ROWS and b - a <= MOST_PLACES * lag[a]
    ]
    whole = [_extended_copy(keys, a, b, int(lag[a])) for a, b in found]
    least = LEAST_NOISE * np.array([np.ptp(one[np.isfinite(one)]) for one in rows])
    if known:
        jumped = sum(_goes_back(rows, a, b) or _has_noise(rows[:, a:b], least) for a, b in whole)
        whole = whole if 2 * jumped >= len(whole) else []
    else:
        whole = [(a, b) for a, b in whole if _is_certain_copy(rows[:, a:b], least)]
    if not whole:
        return none, none
    first, behind = np.array(whole, dtype=np.int64).T
    return first, behind


def _copies_at_one_lag(again: BoolArray, lag: IntArray) -> list[tuple[int, int]]:
    """Return stretches of rows that repeat others at one distance."""
    out: list[tuple[int, int]] = []
    for first, behind in zip(*stretches(again), strict=True):
        cuts = first + 1 + np.flatnonzero(np.diff(lag[first:behind]))
        ends = [int(first), *cuts.tolist(), int(behind)]
        out += list(pairwise(ends))
    return out


def _extended_copy(keys: NDArray[np.uint64], first: int, behind: int, lag: int) -> tuple[int, int]:
    """Return a copy with the rows at either end that occur in more places, as those of a rest do."""
    while first - 1 >= lag and behind - first < lag and keys[first - 1] == keys[first - 1 - lag]:
        first -= 1
    while behind < len(keys) and behind - first < lag and keys[behind] == keys[behind - lag]:
        behind += 1
    return first, behind


def _goes_back(rows: Array, first: int, behind: int) -> bool:
    """Return whether a channel steps at the start of a copy by far more than within it."""
    usual = np.median(np.abs(np.diff(rows[:, first:behind], axis=1)), axis=1)
    return bool(np.any(np.abs(rows[:, first] - rows[:, first - 1]) > JUMP * usual))


def _has_noise(rows: Array, least: Array) -> bool:
    """Return whether at least two channels of a copy are noisy."""
    return sum(is_noisy(one, size) for one, size in zip(rows, least.tolist(), strict=True)) >= 2


def _is_certain_copy(rows: Array, least: Array) -> bool:
    """Return whether a copy is too long, and a channel of it too noisy, for a repetition by chance."""
    n = rows.shape[1]
    noisy = (is_noisy(one, size) and np.unique(one).size >= DISTINCT * n for one, size in zip(rows, least, strict=True))
    return n >= FEWEST_ANY and any(noisy)


def _evidence_of_elapsed_time(values: Array, first: IntArray, behind: IntArray) -> float:
    """Return the evidence of a channel that time went on while copies were written [log-likelihood]."""
    inner = behind < len(values)
    first, behind = first[inner], behind[inner]
    out = 0.0
    for a, b in zip(first.tolist(), behind.tolist(), strict=True):
        over = b - a + 1
        around = values[max(0, a - 10 * over) : a]
        if len(around) <= 2 * over:
            continue
        at_once, after = (float(np.nanmean((around[k:] - around[:-k]) ** 2)) for k in (1, over))
        step = float(values[b] - values[a - 1]) ** 2
        if min(at_once, after) > 0.0:
            out += _step_cost(step, at_once) - _step_cost(step, after)
    return out


def _step_cost(squared: float, variance: float) -> float:
    """Return minus the log-likelihood of a step by Student's law with three degrees of freedom: it has long tails."""
    return 0.5 * np.log(variance) + 2.0 * np.log1p(squared / (3.0 * variance))
