"""Held samples: a slow channel that its logger repeats until the next sample comes, or bridges by straight lines.

Neither is a measurement. These rows are left out, so that a fit sees a slow sensor, and not a late or noiseless one. If
all channels do so in the same rows, with motor speed among them, a slow log was written in the rows of a faster clock.
If speed alone does, or in rows of its own, the pumped volume is known at its samples: the log is reduced to these.
"""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from estimation.log_checks.channel_names import POSITION, PRESSURES, SPEED, VELOCITY
from estimation.log_checks.slow_speed import is_repeated_by_logger
from estimation.notes import SensorCode
from plant.arrays import Array
from plant.log.record import Record
from plant.notes import Note

CHECKED_CHANNELS = (POSITION, VELOCITY, *PRESSURES)
"""Channels that are checked: none can jump. A motor speed that is held may be the motor's own (`slow_speed`)."""

LEAST_STEPS = 100
"""Least steps above its resolution for a channel to be judged [count]."""

RESOLVED = 2.5
"""Size of a step, over the smallest, above which it is no single step of a converter [dimensionless]."""

RUN_ON, ON_TIME = 0.01, 0.9
"""Largest share of those steps that may follow another one row later, and least share after which the next comes in the
usual time, give or take a row [fraction]. A channel that is sampled in every row steps in most rows while it moves."""

STRAIGHT, MOSTLY = 1e-3, 0.45
"""Bend over the root mean square bend below which a row is on the line between its neighbours; and the least share of
such rows in a bridged channel, in which at most every second row is sampled."""


class _SlowSampling(NamedTuple):
    """A channel with a sample every so many rows, from the first of them on; repeated, or bridged by lines."""

    rows: int
    first: int
    bridged: bool


def without_held_values(record: Record) -> tuple[Record, tuple[Note, ...]]:
    """Return a log without the values that its logger only repeated, or interpolated between samples.

    Returns
    -------
    tuple of (Record, tuple of Note)
        The log, and a note for each channel that was held or bridged. If all channels were, in the same rows, the log
        gets the clock of its samples, and so does one whose motor speed was repeated.
    """
    slow = {
        name: one for name in CHECKED_CHANNELS if name in record and (one := _slow_sampling(record[name])) is not None
    }
    turning = _slow_speed(record)
    if not slow and turning is None:
        return record, ()
    every = next(iter(slow.values()), turning)
    asked = [name for name in (SPEED, *CHECKED_CHANNELS) if name in record]
    if every is not None and all(_changes_only_at_samples(record[name], every) for name in asked):
        return record.slice(every.first, None, every.rows), tuple(_notes(record, dict.fromkeys(asked, every)))
    changed: dict[str, Array] = {}
    for name, one in slow.items():
        values = record[name].copy()
        values[~_rows_of_samples(record[name], one)] = np.nan
        changed[name] = values
    found, notes = record.replace(**changed) if changed else record, tuple(_notes(record, slow))
    if turning is None or not is_repeated_by_logger(found, others=bool(slow)):
        return found, notes
    said = SensorCode.SPEED_HELD.note(**_note_data(record, SPEED, turning))
    return found.slice(turning.first, None, turning.rows), (said, *notes)


def _notes(record: Record, slow: Mapping[str, _SlowSampling]) -> Iterator[Note]:
    for name, one in slow.items():
        yield (SensorCode.BRIDGED if one.bridged else SensorCode.HELD).note(**_note_data(record, name, one))


def _note_data(record: Record, name: str, one: _SlowSampling) -> dict[str, Any]:
    return {"channel": name, "rows": one.rows, "milliseconds": 1e3 * one.rows * record.sample_time}


def _slow_speed(record: Record) -> _SlowSampling | None:
    """Return the hold of motor speed, by motor or logger; None if it is not held over a fixed number of rows."""
    one = _repeated_sampling(record[SPEED]) if SPEED in record else None
    return one if one is not None and _changes_only_at_samples(record[SPEED], one) else None


def _repeated_sampling(values: Array) -> _SlowSampling | None:
    """Return the hold of a channel that repeats its samples; None if it does not."""
    if (rows := held_rows(values)) == 1:
        return None
    return _SlowSampling(rows, int(np.argmax(np.diff(values) != 0.0) + 1) % rows, bridged=False)


def _slow_sampling(values: Array) -> _SlowSampling | None:
    """Return the hold or bridging of a channel; None if it is sampled in every row."""
    if (repeated := _repeated_sampling(values)) is not None:
        return repeated
    if len(values) < LEAST_STEPS:
        return None
    straight = _rows_on_line(values)
    if np.mean(straight) < MOSTLY or (knots := np.flatnonzero(~straight) + 1).size < LEAST_STEPS:
        return None
    bridged = _SlowSampling(int(np.median(np.diff(knots))), 0, bridged=True)
    bridged = bridged._replace(first=int(knots[0]) % max(bridged.rows, 1))
    return bridged if bridged.rows > 1 and _changes_only_at_samples(values, bridged) else None


def _rows_on_line(values: Array) -> NDArray[np.bool_]:
    """Return which inner rows are on the line between their neighbours; none if a sample is missing."""
    bends = np.diff(values, 2)
    return np.abs(bends) < STRAIGHT * np.sqrt(np.mean(bends**2))


def _rows_of_samples(values: Array, one: _SlowSampling) -> NDArray[np.bool_]:
    """Return the rows in which a slow channel has a sample."""
    if not one.bridged:
        return np.concatenate([[True], np.diff(values) != 0.0])
    return np.arange(len(values)) % one.rows == one.first


def _changes_only_at_samples(values: Array, one: _SlowSampling) -> bool:
    """Return whether a channel steps, or bends, only in the rows of its samples."""
    moved = ~_rows_on_line(values) if one.bridged else np.diff(values) != 0.0
    at = np.flatnonzero(moved) + 1
    return bool(np.all(at % one.rows == one.first)) and not np.any(np.isnan(values))


def held_rows(values: Array) -> int:
    """Return the number of rows over which a channel repeats each sample; 1 if it is sampled in every row.

    Parameters
    ----------
    values : ndarray, shape (n,)
        The channel [any unit]; NaN where missing.

    Returns
    -------
    int
        Usual number of rows from sample to sample.

    Examples
    --------
    >>> time = 1e-3 * np.arange(2000)
    >>> wave = np.round(np.sin(20.0 * time), 4)
    >>> held_rows(wave), held_rows(wave[np.arange(2000) // 4 * 4])
    (1, 4)
    """
    steps = np.abs(np.diff(values))
    moved = np.flatnonzero(steps > 0.0)  # a step to or from a missing sample is NaN and does not count
    if len(moved) < LEAST_STEPS or np.count_nonzero(np.isnan(values)):
        return 1
    sizes = steps[moved]
    is_large = sizes > RESOLVED * np.min(sizes)
    large = moved[is_large]
    runs_on = np.count_nonzero(steps[large[large > 0] - 1] > 0.0)
    if len(large) < LEAST_STEPS or runs_on > RUN_ON * len(large):
        return 1
    apart = np.diff(moved)[is_large[:-1]]
    rows = int(np.median(apart))
    return rows if np.mean(np.abs(apart - rows) <= 1) > ON_TIME else 1
