"""What a log of the diaphragm motor tells: leakage and load, from electrodes and position."""
