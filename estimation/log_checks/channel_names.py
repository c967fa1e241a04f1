"""Channels of a log of the electro-hydrostatic actuator that the checks use."""

from plant.log.chamber_pressures import CHAMBERS as CHAMBERS
from plant.log.chamber_pressures import PRESSURE as PRESSURE
from plant.log.record import Record

SPEED, POSITION, VELOCITY = "motor_speed_rad_s", "position_m", "velocity_m_s"

PRESSURES = (PRESSURE, *CHAMBERS)
"""Channels of pressure: the difference, and the two chambers'."""

MEASURED = (SPEED, POSITION, VELOCITY, *PRESSURES)
"""All channels that the checks use."""


def motion_channels(record: Record) -> str:
    """Return the names of the channels of a log that measure the piston's motion, joined by "and"."""
    return " and ".join(name for name in (POSITION, VELOCITY) if name in record)


def has_both_motions(record: Record) -> bool:
    """Return whether a log has both position and velocity."""
    return POSITION in record and VELOCITY in record
