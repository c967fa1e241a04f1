"""Channels of a log of the electro-hydrostatic actuator that the checks ask."""

SPEED, POSITION, VELOCITY = "motor_speed_rad_s", "position_m", "velocity_m_s"

PRESSURE = "differential_pressure_pa"

PRESSURES = (PRESSURE, "pressure_a_pa", "pressure_b_pa")
"""Channels of pressure: the difference, and the two chambers'."""
