"""Usual deviation of integrated velocity from position: a velocity sensor filters, averages and has a gain of its own.

A filter correlates the noise, so its integral wanders further than that of white noise, and velocity continues after
the piston has stopped. Neither is motion that position missed.
"""

import numpy as np

from estimation.log_checks.bridging import bridged
from estimation.log_checks.channel_names import POSITION, VELOCITY
from estimation.log_checks.late_velocity import velocity_lateness
from plant.log.record import Record

LEAST_STRAY_RATIO = 5.0
"""Ratio to the lower quartile by which velocity must deviate from a constant position to be believed [dimensionless].
The quartile is that of a sound part even if position is often constant; in 36 plain training logs under eight filters
of 20 to 150 Hz the ratio is never reached."""

LONGEST = 0.5
"""Longest window of the comparison [s]: a log that freezes for good must have some elsewhere."""


def strays_unusually(record: Record, stretch: slice, resolved: float) -> bool:
    """Return whether velocity deviates from position over a part by more than it does over equally long ones elsewhere.

    Parameters
    ----------
    record : Record
        The log, with position and velocity.
    stretch : slice
        Samples with a constant position.
    resolved : float
        Least travel of position that shows motion [m]; parts with less may be frozen too.

    Returns
    -------
    bool
        Also True if position moves nowhere else.
    """
    position, velocity = bridged(record[POSITION]), bridged(record[VELOCITY])
    went = np.cumsum(velocity) * record.sample_time + velocity_lateness(record) * velocity
    rows = min(stretch.stop - stretch.start, max(2, round(LONGEST / record.sample_time)))
    moving = [one for one in _windows(0, len(went), rows) if np.ptp(position[one]) > resolved]
    usual = sorted(float(np.ptp(went[one] - position[one])) for one in moving)
    here = max(float(np.ptp(went[one])) for one in _windows(stretch.start, stretch.stop, rows))
    return not usual or here > LEAST_STRAY_RATIO * usual[len(usual) // 4]


def _windows(first: int, stop: int, rows: int) -> list[slice]:
    return [slice(begin, begin + rows) for begin in range(first, stop - rows + 1, max(1, rows // 2))]
