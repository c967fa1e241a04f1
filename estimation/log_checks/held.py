"""Held samples: a slow channel that its logger repeats until the next sample comes, told by its steps.

A repeated value is no measurement. It is left out, so that a fit sees a slow sensor and no late one.
"""

import numpy as np

from estimation.log_checks.sensor_check import PRESSURE, PRESSURES
from estimation.notes import SensorCode
from plant.arrays import Array
from plant.log.record import Record
from plant.notes import Note

HELD = tuple(dict.fromkeys(("position_m", "velocity_m_s", PRESSURE, *PRESSURES)))
"""Channels that are asked: none can jump. A motor speed that is held may be how the motor was driven."""

LEAST_STEPS = 100
"""Steps over its resolution that a channel must make to be judged [count]."""

RESOLVED = 2.5
"""Steps larger than this many of the smallest are no single ones of a converter [dimensionless]."""

RUN_ON, ON_TIME = 0.01, 0.9
"""Share of those steps that may follow another one row before, and share of them after which the next comes in the
usual time, a row more or less [fraction]. A channel that is sampled in every row steps in most while it moves."""


def without_held(record: Record) -> tuple[Record, tuple[Note, ...]]:
    """Return a log without the values that its logger only repeated.

    Parameters
    ----------
    record : Record
        The log.

    Returns
    -------
    tuple of (Record, tuple of Note)
        The log, and a note for each channel that was held.
    """
    changed, notes = dict[str, Array](), list[Note]()
    for name in HELD:
        if name not in record or (rows := held_rows(record[name])) < 2:
            continue
        values = record[name].copy()
        values[1:][np.diff(record[name]) == 0.0] = np.nan
        changed[name] = values
        notes.append(SensorCode.HELD.note(channel=name, rows=rows, milliseconds=1e3 * rows * record.sample_time))
    return (record.replace(**changed), tuple(notes)) if notes else (record, ())


def held_rows(values: Array) -> int:
    """Return the rows over which a channel repeats each sample; 1 where it is sampled in every row.

    Parameters
    ----------
    values : ndarray, shape (n,)
        The channel [any unit]; NaN where missing.

    Returns
    -------
    int
        Usual count of rows from sample to sample.

    Examples
    --------
    >>> time = 1e-3 * np.arange(2000)
    >>> wave = np.round(np.sin(20.0 * time), 4)
    >>> held_rows(wave), held_rows(wave[np.arange(2000) // 4 * 4])
    (1, 4)
    """
    steps = np.abs(np.diff(values))
    moved = np.flatnonzero(steps > 0.0)  # a step to or from a missing sample is none
    if len(moved) < LEAST_STEPS or np.count_nonzero(np.isnan(values)):
        return 1
    large = moved[steps[moved] > RESOLVED * np.min(steps[moved])]
    runs_on = np.count_nonzero(steps[large[large > 0] - 1] > 0.0)
    if len(large) < LEAST_STEPS or runs_on > RUN_ON * len(large):
        return 1
    apart = np.diff(moved)[np.isin(moved[:-1], large)]
    rows = int(np.median(apart))
    return rows if np.mean(np.abs(apart - rows) <= 1) > ON_TIME else 1
