"""`without_late_velocity(record)`: a velocity that was filtered, or differentiated with a delay, is left out.

A velocity that is late by T lags behind the gain of position: over any part, position gains ``int v dt + T dv`` to
first order, for a filter as for a delay. Encoder play and a late position have the opposite sign. See decision 288.
"""

import numpy as np

from estimation.log_checks.channel_names import POSITION, VELOCITY
from estimation.notes import SensorCode
from plant.arrays import Array
from plant.log.record import Record
from plant.notes import Note

STRETCH = 0.05
"""Length of the parts over which the two are compared [s]: several times the longest lag of a usual filter, and short
enough for little accumulated noise."""

LEAST_LATE = 1e-3
"""Least delay that is reported [s]; judged."""

EXPLAINED = 0.5
"""Share of the difference that one delay must explain [fraction]; judged: the rest may be noise correlated by a filter.
A wrong gain, proportional to velocity, explains none."""

LEAST_DIFFERENCE, BLOCK = 0.04, 0.01
"""Share of the velocity's root mean square from which the difference due to the delay matters [fraction], and the
length of its means [s]: noise adds to it, and from 0.05 on the diagnosis reports that two sensors disagree."""

LEAST_STRETCHES = 20
"""Least parts with both channels [count]."""


def without_late_velocity(record: Record) -> tuple[Record, tuple[Note, ...]]:
    """Return a log without a velocity that is late; position has the same information, on time.

    Returns
    -------
    tuple of (Record, tuple of Note)
        The log, and the delay of its velocity; unchanged if a channel is missing or on time.
    """
    if POSITION not in record or VELOCITY not in record:
        return record, ()
    apart, change = _differences_by_part(record[POSITION], record[VELOCITY], record.sample_time)
    late = _lateness(apart, change)
    if late < LEAST_LATE:
        return record, ()
    left = apart - late * change
    size = float(np.sqrt(np.nanmean(record[VELOCITY] ** 2)))
    differs = late * _fastest(record[VELOCITY], record.sample_time)
    explained = 1.0 - float(left @ left) / max(float(apart @ apart), float(np.finfo(float).tiny))
    if explained < EXPLAINED or differs < LEAST_DIFFERENCE * size:
        return record, ()
    note = SensorCode.VELOCITY_LATE.note(channel=VELOCITY, late_ms=1e3 * late)
    return record.replace(**{VELOCITY: None}), (note,)


def velocity_lateness(record: Record) -> float:
    """Return the delay of velocity behind position.

    Parameters
    ----------
    record : Record
        The log, with position and velocity.

    Returns
    -------
    float
        Delay [s]; 0 if there are too few samples of both.
    """
    return _lateness(*_differences_by_part(record[POSITION], record[VELOCITY], record.sample_time))


def velocity_difference(record: Record) -> float:
    """Return the difference between velocity and the slope of position over parts of `STRETCH`.

    Parameters
    ----------
    record : Record
        The log, with position and velocity.

    Returns
    -------
    float
        Root mean square [m/s]; 0 if there are too few samples of both.
    """
    apart, _ = _differences_by_part(record[POSITION], record[VELOCITY], record.sample_time)
    return float(np.sqrt(np.mean(apart**2))) / STRETCH if len(apart) else 0.0


def wrong_gain_explains(record: Record) -> float:
    """Return the share of the difference between position and integrated velocity that one's wrong gain explains.

    Parameters
    ----------
    record : Record
        The log, with position and velocity.

    Returns
    -------
    float
        Share of the squared difference over parts of `STRETCH` [fraction]; 1 if they do not differ.
    """
    gained, swept, _ = _changes_by_part(record[POSITION], record[VELOCITY], record.sample_time)
    apart = gained - swept
    both, left = float(apart @ apart), 0.0
    if both > 0.0:
        gain = float(apart @ gained) / max(float(gained @ gained), float(np.finfo(float).tiny))
        left = float(np.sum((apart - gain * gained) ** 2)) / both
    return 1.0 - left


def _lateness(apart: Array, change: Array) -> float:
    squares = float(change @ change)
    return float(apart @ change) / squares if len(change) >= LEAST_STRETCHES and squares > 0.0 else 0.0


def _fastest(velocity: Array, sample_time: float) -> float:
    """Return the rate of change of velocity over `BLOCK`, root mean square [m/s^2]."""
    rows = max(1, round(BLOCK / sample_time))
    change = velocity[rows:] - velocity[:-rows]
    return float(np.sqrt(np.nanmean(change**2))) / (rows * sample_time)


def _differences_by_part(position: Array, velocity: Array, sample_time: float) -> tuple[Array, Array]:
    """Return position's gain minus integrated velocity, and velocity's change, for each part."""
    gained, swept, change = _changes_by_part(position, velocity, sample_time)
    return gained - swept, change


def _changes_by_part(position: Array, velocity: Array, sample_time: float) -> tuple[Array, Array, Array]:
    """Return position's gain, integrated velocity, and velocity's change, for each part."""
    rows = max(1, round(STRETCH / sample_time))
    gone = 0.5 * sample_time * (velocity[1:] + velocity[:-1])
    unknown = np.concatenate([[0], np.cumsum(np.isnan(gone))])
    swept = np.concatenate([[0.0], np.cumsum(np.nan_to_num(gone))])
    ends = np.arange(0, len(position), rows)
    gained, went, change = np.diff(position[ends]), np.diff(swept[ends]), np.diff(velocity[ends])
    there = np.isfinite(gained) & np.isfinite(change) & (np.diff(unknown[ends]) == 0)
    return gained[there], went[there], change[there]
