"""`without_velocity_offset(record)`: the offset of a velocity sensor, from the piston's travel."""

import numpy as np

from estimation.log_checks.channel_names import POSITION, VELOCITY
from estimation.notes import SensorCode
from plant.arrays import Array
from plant.log.record import Record
from plant.notes import Note

PARTS = 16
"""Parts of a log over which mean velocity is compared with the gain of position [count]."""

LEAST_PARTS = 8
"""Least parts with both channels [count]."""

CERTAIN = 6.0
"""Standard errors from which an offset is believed [dimensionless]: with 14 degrees of freedom, one log in 30,000."""

LEAST_OFFSET_SHARE = 0.01
"""Share of the velocity's root mean square from which an offset is subtracted [fraction]; judged: class and severities
are less exact than that."""

MOST_SAMPLES_OFF = 0.2
"""Share of a part's samples that may be missing [fraction]."""


def without_velocity_offset(record: Record) -> tuple[Record, tuple[Note, ...]]:
    """Return a log without the offset of its velocity sensor, if position shows one.

    Over each part of the log the mean velocity is ``offset + gain * (gain of position) / (its time)``. A wrong gain is
    thus no offset, and is not corrected.

    Returns
    -------
    tuple of (Record, tuple of Note)
        The log, and what was subtracted; unchanged if a channel is missing, or if the offset is too small to matter or
        not certain.
    """
    if POSITION not in record or VELOCITY not in record:
        return record, ()
    position, velocity = record[POSITION], record[VELOCITY]
    size = float(np.sqrt(np.nanmean(velocity**2))) if np.any(np.isfinite(velocity)) else 0.0
    gained, mean = _mean_rates(position, velocity, record.sample_time)
    if len(mean) < LEAST_PARTS or size == 0.0:
        return record, ()
    sides = np.column_stack([np.ones(len(gained)), gained])
    if np.linalg.matrix_rank(sides) < sides.shape[1]:  # a piston at rest determines no gain, and needs none
        sides = sides[:, :1]
    found = np.linalg.lstsq(sides, mean, rcond=None)[0]
    left = mean - sides @ found
    variance = float(left @ left) / (len(mean) - sides.shape[1])
    error = float(np.sqrt(variance * np.linalg.inv(sides.T @ sides)[0, 0]))
    offset = float(found[0])
    if abs(offset) <= max(CERTAIN * error, LEAST_OFFSET_SHARE * size):
        return record, ()
    note = SensorCode.VELOCITY_OFFSET.note(channel=VELOCITY, offset_m_s=offset)
    return record.replace(**{VELOCITY: velocity - offset}), (note,)


def _mean_rates(position: Array, velocity: Array, sample_time: float) -> tuple[Array, Array]:
    """Return the mean rate of position, and mean velocity, for each part with enough samples of both [m/s]."""
    gained: list[float] = []
    means: list[float] = []
    there = np.isfinite(position) & np.isfinite(velocity)
    for part in np.array_split(np.arange(len(position)), PARTS):
        rows = part[there[part]]
        if len(rows) < max(2, (1.0 - MOST_SAMPLES_OFF) * len(part)):
            continue
        first, last = rows[0], rows[-1]
        between = velocity[rows]
        gained.append(float(position[last] - position[first]) / ((last - first) * sample_time))
        means.append(float(np.mean(0.5 * (between[1:] + between[:-1]))))
    return np.array(gained), np.array(means)
