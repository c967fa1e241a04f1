"""Slips of the units of speed and length, by their factors."""

from collections.abc import Mapping

import numpy as np

from estimation.notes import ChannelCode
from plant.notes import Note

NEAR = 1.15
"""Factor within which a ratio of two sensors of one motion agrees with a slip of units [dimensionless]."""

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


def matching_slip(
    ratio: float, slips: Mapping[float, str], least: float = 1.0 / NEAR, most: float = NEAR
) -> float | None:
    """Return the factor of the slip that a ratio is near.

    Parameters
    ----------
    ratio : float
        A ratio that is 1 without a slip [dimensionless].
    slips : Mapping[float, str]
        The slips, by their factors [dimensionless].
    least, most : float
        Range of the ratio over a factor [dimensionless].

    Returns
    -------
    float or None
        The nearest factor within the range [dimensionless]; None if there is none.

    Examples
    --------
    >>> matching_slip(9.3, LENGTHS), matching_slip(3.0, LENGTHS)
    (10.0, None)
    """
    close = [one for one in slips if least <= ratio / one <= most]
    return min(close, key=lambda one: abs(np.log(ratio / one)), default=None)


def unit_note(channel: str, against: str, factor: float, slip: str) -> Note:
    """Return the note on a channel in a wrong unit.

    Parameters
    ----------
    channel, against : str
        The channel, and the one that contradicts it.
    factor : float
        Factor by which it is too large [dimensionless].
    slip : str
        What was read as what.
    """
    return ChannelCode.CHANNEL_UNIT.note(channel=channel, against=against, factor=factor, slip=slip)
