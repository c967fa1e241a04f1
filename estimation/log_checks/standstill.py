"""`travels(record, p)`: how far a piston went, and how far its pump would have moved it."""

from typing import NamedTuple

import numpy as np

from estimation.log_checks.channel_blocks import channel_blocks
from estimation.log_checks.channel_physics import MIDDLE
from estimation.log_checks.frozen_encoder import SHORTEST_TRAVEL
from plant.arrays import Array
from plant.eha.model import EhaParameters
from plant.log.plausibility import LIMITS
from plant.log.record import Record

RESTING, TURNED = 0.2, 10.0
"""Times the least travel up to which a pump that delivers it rests, and from which on a still piston is stuck
[dimensionless]; judged. Noise of a resolver at rest makes a hundredth."""


class Travels(NamedTuple):
    """How far piston and pump went in a log, from the lowest to the highest point.

    Parameters
    ----------
    piston : float
        Travel of the piston [m].
    pump : float
        Travel of a piston that takes all that is pumped, without an offset of the speed [m].
    """

    piston: float
    pump: float

    @property
    def still(self) -> bool:
        """Whether the piston stands still: seals give way by as much."""
        return self.piston < SHORTEST_TRAVEL

    @property
    def at_rest(self) -> bool:
        """Whether the pump rests as well: no known volume then compresses the oil."""
        return self.still and self.pump < RESTING * SHORTEST_TRAVEL

    @property
    def stuck(self) -> bool:
        """Whether the piston stands still although the pump turns."""
        return self.still and self.pump > TURNED * SHORTEST_TRAVEL


def travels(record: Record, p: EhaParameters) -> Travels | None:
    """Return how far piston and pump went, noise averaged out over blocks; None where one is not logged.

    Without position, velocity tells, less an offset that is worth no more flow than one of motor speed may be.

    Parameters
    ----------
    record : Record
        The log.
    p : EhaParameters
        The actuator.
    """
    blocks = channel_blocks(record, p, MIDDLE)
    offset = p.pump_displacement * LIMITS["motor_speed_rad_s"].least
    position = blocks.position
    if position is None and blocks.velocity is not None and len(blocks.velocity):
        position = _swept(blocks.velocity, offset / p.piston_area) * blocks.length
    if position is None or blocks.pumped is None or not len(blocks.pumped):
        return None
    pumped = _swept(blocks.pumped, offset) * blocks.length
    return Travels(float(np.ptp(position)), float(np.ptp(pumped)) / p.piston_area)


def _swept(rate: Array, offset: float) -> Array:
    """Return the sums of a rate, whose mean is taken off as far as it may be an offset."""
    return np.cumsum(rate - np.clip(np.mean(rate), -offset, offset))
