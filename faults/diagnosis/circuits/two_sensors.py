"""Do a velocity sensor and the encoder show the same motion? If not, one of the two is wrong."""

import numpy as np

from estimation.notes import SensorCode
from faults.diagnosis.circuits.blocks import FEWEST, Blocks, blocks_of
from plant.arrays import Array
from plant.log.record import Record
from plant.notes import Note

AGREEMENT = 0.05
"""Share by which velocity and the slope of position may differ, root mean square [dimensionless]."""

ALLOWED_DEVIATIONS = 3.0
"""Difference between velocity and the slope of position that is always allowed, in standard deviations of its noise."""

ALLOWED_FILTERED = 1.5
"""Allowed difference over the noise of filtered channels [dimensionless]: between blocks two apart such noise is almost
uncorrelated, while a lasting sensor error is not."""


def sensor_disagreements(record: Record, blocks: Blocks) -> tuple[Note, ...]:
    """Compare a velocity sensor with the encoder, over the blocks.

    Parameters
    ----------
    record : Record
        The log.
    blocks : Blocks
        The same in blocks.

    Returns
    -------
    tuple of Note
        One note if they differ by more than their noise and `AGREEMENT`.
    """
    if "velocity_m_s" not in record or "position_m" not in record:
        return ()
    other = blocks_of(record.replace(position_m=None))
    apart = (_trapezoidal_velocity(record, other) - blocks.velocity)[blocks.first :]
    there = np.isfinite(apart)
    size = float(np.sqrt(np.nanmean(blocks.velocity**2)))
    noise = ALLOWED_DEVIATIONS * float(np.hypot(blocks.noise[0], other.noise[0]))
    sampled = float(np.hypot(noise, _sampling_error(record, other)))
    filtered = _filtered_noise(apart[there], blocks.velocity[blocks.first :][there])
    allowed = max(AGREEMENT * size, sampled, ALLOWED_FILTERED * filtered)
    differs = float(np.sqrt(np.mean(apart[there] ** 2))) if np.any(there) else 0.0
    return () if differs <= allowed else (SensorCode.SENSORS_DISAGREE.note(difference_m_s=differs),)


def _filtered_noise(apart: Array, velocity: Array) -> float:
    """Return the noise of the difference between two sensors of one motion, however it was filtered [m/s].

    What is proportional to velocity or its change, as with a wrong gain or a lag, is no noise.
    """
    if len(apart) < FEWEST:
        return 0.0
    motion = np.column_stack([velocity, np.gradient(velocity)])
    left = apart - motion @ np.linalg.lstsq(motion, apart, rcond=None)[0]
    return float(np.sqrt(0.5 * np.mean((left[2:] - left[:-2]) ** 2)))


def _trapezoidal_velocity(record: Record, blocks: Blocks) -> Array:
    """Return the mean velocity over each block by the trapezoidal rule [m/s], comparable to the slope of position.

    Means of samples are half a sample early: an error of 5 % if velocity doubles within a block.
    """
    pooled = round(blocks.sample_time / record.sample_time) * blocks.block
    rows = record["velocity_m_s"][: len(blocks.velocity) * pooled + 1 : pooled]
    late = np.diff(rows) / (2.0 * blocks.block)
    return blocks.velocity + np.nan_to_num(np.pad(late, (0, len(blocks.velocity) - len(late))))


def _sampling_error(record: Record, blocks: Blocks) -> float:
    """Return the sampling error of block means of velocity, root mean square [m/s].

    Velocity changes at an unknown moment between two samples, so a sample represents too much or too little of it: by a
    share of the change that is uniform between 0 and 1. Changes due to noise are counted already.
    """
    rows = round(blocks.block * blocks.sample_time / record.sample_time)
    steps = np.diff(record["velocity_m_s"])
    steps = steps[np.isfinite(steps)]
    if not len(steps):  # the channel is slower than the rows, so no two samples are adjacent
        return 0.0
    changes = float(np.mean(steps**2)) - 2.0 * rows * float(blocks.noise[0]) ** 2
    return (max(changes, 0.0) / (3.0 * rows)) ** 0.5
