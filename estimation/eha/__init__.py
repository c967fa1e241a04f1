"""Effective bulk modulus, leakage and friction of the gear-pump actuator from a log."""
