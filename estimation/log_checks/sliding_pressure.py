"""`sliding_pressure(record, p)`: pressure under which a piston slides, over what the rig's friction takes.

A flow balance contains only pressure over stiffness, so it cannot distinguish a unit of pressure from oil that is
stiffer by the same factor. Friction can: no piston slides below the pressure of its friction, and few at many times
that.
"""

from math import log as ln

import numpy as np

from estimation.log_checks.channel_blocks import channel_blocks
from estimation.log_checks.channel_physics import MIDDLE
from estimation.log_checks.order import median
from plant.components.friction import quadratic_friction
from plant.eha.model import EhaParameters
from plant.log.record import Record

SLIDING = 0.1
"""Share of the highest velocity from which a piston slides [fraction]."""

LEAST, MOST = 0.8, 6.0
"""Range of the sliding pressure over what the rig's friction takes [dimensionless]; judged: faults raise friction, and
a rig file may have a fifth too much of it. Loads may need more."""


def sliding_pressure(record: Record, p: EhaParameters) -> float:
    """Return the median pressure while the piston slides, over what the rig's friction takes at its speed.

    Returns
    -------
    float
        Their ratio; 1 if position or pressure is not logged, or never changes, and if the rig has no friction
        [dimensionless].
    """
    blocks = channel_blocks(record, p, MIDDLE)
    if blocks.slope is None or blocks.pressure is None or not np.any(blocks.slope):
        return 1.0
    size = np.abs(blocks.slope)
    slides = size > SLIDING * size.max()
    # clipped: a faster piston means that position has another unit
    speed = np.minimum(size[slides], p.rated_flow / p.piston_area)
    rubs = quadratic_friction(speed, 1.0, p.friction_quadratic, p.friction_linear, p.friction_coulomb)
    return median(np.abs(blocks.pressure[slides]) * p.piston_area / rubs) if np.all(rubs > 0.0) else 1.0


def sliding_excess(ratio: float) -> float:
    """Return how far a ratio is below the least at which pistons slide (negative), or above the most [logarithm].

    Parameters
    ----------
    ratio : float
        See `sliding_pressure` [dimensionless].

    Returns
    -------
    float
        Logarithm of the factor; 0 within the range [dimensionless].

    Examples
    --------
    >>> sliding_excess(1.0), round(sliding_excess(0.08), 3), round(sliding_excess(60.0), 3)
    (0.0, -2.303, 2.303)
    """
    return min(ln(max(ratio, 1e-12) / LEAST), 0.0) + max(ln(max(ratio, 1e-12) / MOST), 0.0)
