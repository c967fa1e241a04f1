"""Position at the end of its sensor's range: it stays at an extreme value while velocity shows that the piston moves.

A piston at rest or at a stop repeats its position too, but has no velocity. A frozen encoder jumps when it recovers;
one at the end of its range continues from there.
"""

import numpy as np

from estimation.log_checks.channel_names import POSITION, VELOCITY
from estimation.log_checks.sensor_check import FEWEST_HELD, LEAST_RUN, holds, shows_motion
from estimation.notes import SensorCode
from plant.log.record import Record
from plant.notes import Note

FARTHEST = 1.5
"""Step of a position as it leaves its range or comes back, over its largest step elsewhere [dimensionless]."""

MOST_STAYS_TESTED = 5
"""Number of longest stays at a level that are tested for motion [count]."""


def without_position_beyond_range(record: Record) -> tuple[Record, tuple[Note, ...]]:
    """Return a log without the samples at which position was at the end of its sensor's range.

    Parameters
    ----------
    record : Record
        The log; it needs a velocity sensor.

    Returns
    -------
    tuple of (Record, tuple of Note)
        The log, with position missing at those samples, and a note if there are any.
    """
    if POSITION not in record or VELOCITY not in record:
        return record, ()
    values = record[POSITION]
    seen = values[np.isfinite(values)]
    if len(seen) < FEWEST_HELD or np.ptp(seen) == 0.0:
        return record, ()
    levels = [level for level in (float(np.max(seen)), float(np.min(seen))) if _is_end_of_range(record, level)]
    if not levels:
        return record, ()
    beyond = np.isin(values, levels)
    note = SensorCode.SENSOR_CLIPPED.note(
        channel=POSITION,
        levels=" and ".join(f"{1e3 * level:.4g}" for level in levels),
        unit="mm",
        percent=100.0 * np.count_nonzero(beyond) / len(seen),
    )
    return record.replace(**{POSITION: np.where(beyond, np.nan, values)}), (note,)


def _is_end_of_range(record: Record, level: float) -> bool:
    """Return whether position stays at a level while the piston moves on, and leaves it without a jump."""
    values = record[POSITION]
    starts, lengths = holds(values)
    there = (values[starts] == level) & (lengths >= LEAST_RUN)
    first, behind = starts[there], starts[there] + lengths[there]
    came_back = behind < len(values)
    longest = np.argsort((behind - first) * came_back)[::-1][:MOST_STAYS_TESTED]
    if not any(
        came_back[at] and shows_motion(record, slice(int(first[at]), int(behind[at])))[0] for at in longest.tolist()
    ):
        return False
    ends = np.concatenate([first[first > 0] - 1, behind[came_back]])
    steps = np.abs(np.diff(values))
    away = np.abs(values[ends] - level)
    steps[np.concatenate([first[first > 0] - 1, behind[came_back] - 1])] = 0.0
    return bool(np.all(~(away > FARTHEST * np.nanmax(steps, initial=0.0))))
