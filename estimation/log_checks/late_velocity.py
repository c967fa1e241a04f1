"""`without_late_velocity(record)`: a velocity that was filtered, or derived from position with a delay, is left out.

A velocity that comes late by T is behind what position gained: over any stretch, position gains ``int v dt + T dv``,
to first order, whether a filter or a delay makes it late. Play of the encoder and a late position have the other sign.
See decision 288.
"""

import numpy as np

from estimation.log_checks.channel_names import POSITION, VELOCITY
from estimation.notes import SensorCode
from plant.arrays import Array
from plant.log.record import Record
from plant.notes import Note

STRETCH = 0.05
"""Stretch over which the two are compared [s]: several times the longest lag of a usual filter; noise of velocity adds
up to little over it."""

LEAST_LATE = 2e-3
"""Least lateness of which a log is asked [s]; judged."""

EXPLAINED = 0.8
"""Share of how far the two are apart that one lateness must explain [fraction]; judged."""

MATTERS = 0.05
"""Share of the velocity's root mean square that lateness must make of a difference, to matter [fraction]: from there on
the diagnosis says that two sensors disagree."""

LEAST_STRETCHES = 20
"""Stretches that must hold both channels [count]."""


def without_late_velocity(record: Record) -> tuple[Record, tuple[Note, ...]]:
    """Return a log without a velocity that comes late; position tells the same, on time.

    Returns
    -------
    tuple of (Record, tuple of Note)
        The log, and by how much its velocity was late; the same log and none where a channel is missing or on time.
    """
    if POSITION not in record or VELOCITY not in record:
        return record, ()
    apart, change = _compared(record[POSITION], record[VELOCITY], record.sample_time)
    squares = float(change @ change)
    if len(change) < LEAST_STRETCHES or squares == 0.0:
        return record, ()
    late = float(apart @ change) / squares
    left = apart - late * change
    size = float(np.sqrt(np.nanmean(record[VELOCITY] ** 2)))
    differs = late * float(np.sqrt(squares / len(change))) / STRETCH
    explained = 1.0 - float(left @ left) / max(float(apart @ apart), float(np.finfo(float).tiny))
    if late < LEAST_LATE or explained < EXPLAINED or differs < MATTERS * size:
        return record, ()
    note = SensorCode.VELOCITY_LATE.note(channel=VELOCITY, late_ms=1e3 * late)
    return record.replace(**{VELOCITY: None}), (note,)


def _compared(position: Array, velocity: Array, sample_time: float) -> tuple[Array, Array]:
    """Return by how much position gains more than velocity says, and what velocity changes, over each stretch."""
    rows = max(1, round(STRETCH / sample_time))
    swept = np.concatenate([[0.0], np.cumsum(0.5 * sample_time * (velocity[1:] + velocity[:-1]))])
    ends = np.arange(0, len(position), rows)
    apart, change = np.diff((position - swept)[ends]), np.diff(velocity[ends])
    there = np.isfinite(apart) & np.isfinite(change)
    return apart[there], change[there]
