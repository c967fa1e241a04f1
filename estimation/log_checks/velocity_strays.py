"""How far velocity, summed up, usually strays from position: its sensor filters, averages and has a gain of its own.

A filter makes the noise alike from sample to sample, so its sum wanders further than that of white noise, and lets
velocity run on after the piston has stopped. Neither is motion that position missed.
"""

import numpy as np

from estimation.log_checks.bridging import bridged
from estimation.log_checks.channel_names import POSITION, VELOCITY
from estimation.log_checks.late_velocity import velocity_lateness
from plant.log.record import Record

USUAL = 5.0
"""Times the lower quartile that velocity must stray from a position that stays, for velocity to be believed
[dimensionless]. The quartile is a sound stretch's also where position stays often; of 36 plain training logs under
eight filters of 20 to 150 Hz none gets there."""

LONGEST = 0.5
"""Window over which they are compared at most [s]: there are some elsewhere in a log that freezes for good."""


def strays_unusually(record: Record, stretch: slice, resolved: float) -> bool:
    """Return whether velocity leaves position further behind over a stretch than it does over as long a one elsewhere.

    Parameters
    ----------
    record : Record
        The log, with position and velocity.
    stretch : slice
        Samples over which position stays.
    resolved : float
        How far position must go to tell where it moves [m]; where it does not, it may be as frozen.

    Returns
    -------
    bool
        True too where position moves nowhere else.
    """
    position, velocity = bridged(record[POSITION]), bridged(record[VELOCITY])
    went = np.cumsum(velocity) * record.sample_time + velocity_lateness(record) * velocity
    rows = min(stretch.stop - stretch.start, max(2, round(LONGEST / record.sample_time)))
    moving = [one for one in _windows(0, len(went), rows) if np.ptp(position[one]) > resolved]
    usual = sorted(float(np.ptp(went[one] - position[one])) for one in moving)
    here = max(float(np.ptp(went[one])) for one in _windows(stretch.start, stretch.stop, rows))
    return not usual or here > USUAL * usual[len(usual) // 4]


def _windows(first: int, stop: int, rows: int) -> list[slice]:
    return [slice(begin, begin + rows) for begin in range(first, stop - rows + 1, max(1, rows // 2))]
