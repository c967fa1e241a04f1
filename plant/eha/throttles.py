"""Throttle valves: the effect of a control voltage on leakage (valve A) and on load (valve B), section 3.

The valves are open at 0 V and shut at 10 V. Between them, their effect is known only at Table 1's voltages; the laws
here pass monotonically through calibrated points, in the logarithm if a quantity spans decades. Source: section 3,
Table 1.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import exp, isfinite, log

import numpy as np

from plant.errors import RigError

SHUT_VOLTS = 10.0
"""Control voltage at which a throttle is shut [V], section 3."""


@dataclass(frozen=True)
class ThrottleA:
    """Calibration of throttle A, chamber to chamber: lumped leakage and flow bias by control voltage.

    Parameters
    ----------
    volts : tuple of float
        Control voltages, decreasing from shut to open [V].
    leakage : tuple of float
        Lumped leakage L_t of the actuator at each [m^3/(s Pa)], increasing.
    bias : tuple of float
        Flow bias Q_b at each [m^3/s], increasing.

    Raises
    ------
    RigError
        If the points are fewer than two, of unequal count, or not monotone.
    """

    volts: tuple[float, ...]
    leakage: tuple[float, ...]
    bias: tuple[float, ...]

    def __post_init__(self) -> None:
        _require_monotone("throttle A", self.volts, self.leakage, self.bias)

    def at(self, volts: float) -> tuple[float, float]:
        """Return leakage and flow bias at a voltage; extrapolates along the line through the last two points.

        Parameters
        ----------
        volts : float
            Control voltage [V], 0 to 10.

        Returns
        -------
        tuple of float
            L_t [m^3/(s Pa)], interpolated in its logarithm, and Q_b [m^3/s].

        Raises
        ------
        RigError
            If the voltage is not between 0 and 10 V.
        """
        require_volts("throttle A", volts)
        leakage = exp(_monotone(volts, self.volts, [log(value) for value in self.leakage]))
        return leakage, _monotone(volts, self.volts, self.bias)


@dataclass(frozen=True)
class ThrottleB:
    """Calibration of throttle B on the coupled cylinder: effective area of an orifice by control voltage.

    Parameters
    ----------
    volts : tuple of float
        Control voltages, decreasing from shut to open [V].
    area : tuple of float
        Discharge coefficient times area C_d A_o at each [m^2], increasing.

    Raises
    ------
    RigError
        If the points are fewer than two, of unequal count, or not monotone.
    """

    volts: tuple[float, ...]
    area: tuple[float, ...]

    def __post_init__(self) -> None:
        _require_monotone("throttle B", self.volts, self.area)

    def at(self, volts: float) -> float:
        """Return the effective area at a voltage.

        Parameters
        ----------
        volts : float
            Control voltage [V], 0 to 10.

        Returns
        -------
        float
            C_d A_o [m^2], interpolated in its logarithm.

        Raises
        ------
        RigError
            If the voltage is not between 0 and 10 V.
        """
        require_volts("throttle B", volts)
        return exp(_monotone(volts, self.volts, [log(value) for value in self.area]))


def require_volts(name: str, volts: float) -> None:
    """Refuse a control voltage outside a throttle's range.

    Parameters
    ----------
    name : str
        Name of the throttle, for the message.
    volts : float
        Control voltage [V].

    Raises
    ------
    RigError
        If it is not between 0 and 10 V.
    """
    if not (isfinite(volts) and 0.0 <= volts <= SHUT_VOLTS):
        raise RigError(f"{name} takes 0 to {SHUT_VOLTS:g} V, got {volts!r} V")


def _require_monotone(name: str, volts: Sequence[float], *series: Sequence[float]) -> None:
    if len(volts) < 2 or any(len(values) != len(volts) for values in series):
        raise RigError(f"{name} must have at least two points, one value per voltage, got {len(volts)} voltages")
    rising = all(b > a > 0.0 for values in series for a, b in pairwise(values))
    if not rising or any(b >= a for a, b in pairwise(volts)):
        raise RigError(f"{name} must open as its voltage falls, got {volts} V and {series}")


def _monotone(volts: float, points: Sequence[float], values: Sequence[float]) -> float:
    """Interpolate by a monotone cubic; below the lowest voltage, extrapolate the line through the last two points."""
    from scipy.interpolate import PchipInterpolator

    rising, ordered = np.array(points[::-1]), np.array(values[::-1])
    if volts < rising[0]:
        slope = (ordered[1] - ordered[0]) / (rising[1] - rising[0])
        return float(ordered[0] + slope * (volts - rising[0]))
    return float(PchipInterpolator(rising, ordered)(min(volts, rising[-1])))
