"""Channels of a log of the electro-hydrostatic actuator that the checks use."""

from plant.log.chamber_pressures import CHAMBERS as CHAMBERS
from plant.log.chamber_pressures import PRESSURE as PRESSURE

SPEED, POSITION, VELOCITY = "motor_speed_rad_s", "position_m", "velocity_m_s"

PRESSURES = (PRESSURE, *CHAMBERS)
"""Channels of pressure: the difference, and the two chambers'."""

MEASURED = (SPEED, POSITION, VELOCITY, *PRESSURES)
"""All channels that the checks use."""
