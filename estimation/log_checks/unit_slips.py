"""Slips of the units of speed and length, by their factors."""

from collections.abc import Mapping

import numpy as np

FARTHEST = 3.0
"""Ratio to the pumped flow that no piston can reach, whatever is wrong in the rig file [dimensionless]."""

RPM = 60.0 / (2.0 * np.pi)
TURN = 2.0 * np.pi
TURNS: Mapping[float, str] = {
    1.0 / RPM: "rpm read as rad/s",
    RPM: "rad/s read as rpm",
    TURN: "rev/s read as rad/s",
}
"""Slips of the speed's unit, by the factor by which the piston then seems to move too far."""

DEGREES = 180.0 / np.pi
"""Degrees in a radian [dimensionless]."""

IN_DEGREES = "deg/s read as rad/s"
"""Slip of a speed that is too fast in revolutions a minute too."""

LENGTHS: Mapping[float, str] = {
    10.0: "mm read as cm",
    100.0: "cm read as m",
    1e3: "mm read as m",
    1e6: "um read as m",
    0.1: "cm read as mm",
    0.01: "m read as cm",
    1e-3: "m read as mm",
    1e-6: "m read as um",
}
"""Slips of a length's unit, by their factors."""
