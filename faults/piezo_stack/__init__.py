"""Faults of the piezo-stack actuator, and which a log shows."""
