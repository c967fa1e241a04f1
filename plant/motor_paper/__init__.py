"""Linear models of the diaphragm motor's paper: vibration, hysteresis, control loops."""
