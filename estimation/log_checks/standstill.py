"""`travels(record, p)`: travel of a piston, and the travel due to its pump."""

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
"""Factors on the least travel: up to the first the pump is at rest, and from the second on a still piston is stuck
[dimensionless]; judged. Noise of a resolver at rest makes a hundredth."""


class Travels(NamedTuple):
    """Range of piston and pump in a log, from the lowest to the highest point.

    Parameters
    ----------
    piston : float
        Travel of the piston [m].
    pump : float
        Travel of a piston that takes all pumped flow, without an offset of the speed [m].
    """

    piston: float
    pump: float

    @property
    def still(self) -> bool:
        """Whether the piston stands still: seals yield by as much."""
        return self.piston < SHORTEST_TRAVEL

    @property
    def at_rest(self) -> bool:
        """Whether the pump is at rest as well: the compressed volume is then unknown."""
        return self.still and self.pump < RESTING * SHORTEST_TRAVEL

    @property
    def stuck(self) -> bool:
        """Whether the piston stands still although the pump turns."""
        return self.still and self.pump > TURNED * SHORTEST_TRAVEL


def travels(record: Record, p: EhaParameters) -> Travels | None:
    """Return the travel of piston and pump, with noise averaged out over blocks; None if one is not logged.

    Without position, velocity tells, less an offset that is worth no more flow than one of motor speed may be.
    """
    blocks = channel_blocks(record, p, MIDDLE)
    offset = p.pump_displacement * LIMITS["motor_speed_rad_s"].least
    position = blocks.position
    if position is None and blocks.velocity is not None and len(blocks.velocity):
        position = _integrated_rate(blocks.velocity, offset / p.piston_area) * blocks.length
    if position is None or blocks.pumped is None or not len(blocks.pumped):
        return None
    pumped = _integrated_rate(blocks.pumped, offset) * blocks.length
    return Travels(float(np.ptp(position)), float(np.ptp(pumped)) / p.piston_area)


def _integrated_rate(rate: Array, offset: float) -> Array:
    """Return the integral of a rate, without its mean as far as that may be an offset."""
    return np.cumsum(rate - np.clip(np.mean(rate), -offset, offset))
