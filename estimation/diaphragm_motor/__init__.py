"""Estimation for the diaphragm motor: leakage and load from a log of electrodes and position."""
