"""Linear models of the diaphragm-motor paper: vibration, hysteresis, control loops."""
