"""Faults of the diaphragm motor, and which a log shows."""
