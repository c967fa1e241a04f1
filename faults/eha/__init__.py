"""Faults of the gear-pump actuator: physical causes, injection, banks of models, isolability."""
