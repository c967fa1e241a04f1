"""`without_still_beginning(record, longest) -> Record`: a long log from just before it first moves.

Only the beginning of a long log is simulated. Where a bench is switched on half a minute before its test, nothing moves
in that beginning, and the test would not be seen.
"""

import numpy as np

from estimation.log_checks.bridging import bridged
from estimation.log_checks.channel_names import POSITION, SPEED, VELOCITY
from estimation.log_checks.measurement_noise import measurement_variances
from plant.arrays import Array
from plant.log.record import Record

REST = 0.5
"""Time at rest that is kept before the first motion [s]: a model starts at rest."""

BLOCK = 0.01
"""Time over which channels are averaged, so that noise and single strays are no motion [s]."""

MOVES = 0.02
"""Share of the largest motor speed, velocity and distance from the start, from which something moves [fraction]: what
is below moves too little to be missed."""

NOISE = 6.0
"""Standard deviations of a mean's noise that are added to it [dimensionless]."""


def without_still_beginning(record: Record, longest: float) -> Record:
    """Return a log without the part before its motor or piston first moves, if it is too long to be used whole.

    Parameters
    ----------
    record : Record
        A log with motor speed, and position or velocity.
    longest : float
        Longest part that is used [s].

    Returns
    -------
    Record
        It begins `REST` before the first motion; the log itself if it is short enough, or moves from the start.
    """
    if record.duration <= longest:
        return record
    rows = max(1, round(BLOCK / record.sample_time))
    there = [name for name in (SPEED, POSITION, VELOCITY) if name in record and np.any(np.isfinite(record[name]))]
    channels = [name for name in there if name != VELOCITY or POSITION not in there]  # its offset is no motion
    if SPEED not in channels:
        return record
    variances = measurement_variances(record, channels)
    moves = [
        _first_motion(_means(record[name], rows), (variances[name] / rows) ** 0.5, start=name == POSITION)
        for name in channels
    ]
    begin = rows * min(moves, default=0) - round(REST / record.sample_time)
    return record.slice(begin, None) if begin > 0 else record


def _first_motion(means: Array, noise: float, *, start: bool) -> int:
    """Return the first block in which a channel moves, 0 if it never does; ``start``: from where it began."""
    moved = np.abs(means - means[0]) if start else np.abs(means)
    return int(np.argmax(moved > MOVES * np.max(moved) + NOISE * noise))


def _means(values: Array, rows: int) -> Array:
    return bridged(values)[: len(values) // rows * rows].reshape(-1, rows).mean(axis=1)
