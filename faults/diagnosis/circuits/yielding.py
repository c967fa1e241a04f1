"""Largest residual velocity that a circuit may have, in general and for a piston that only yields on its seals."""

import math

import numpy as np

from faults.diagnosis.circuits.actuator import Actuator
from faults.diagnosis.circuits.blocks import Blocks
from faults.diagnosis.circuits.class_fit import PointFit

UNEXPLAINED = (0.12, 0.08)
"""Share of velocity and of pressure, root mean square, that the best circuit may leave unexplained [dimensionless]."""

YIELDING_SHARE = 0.015
"""Residual velocity that is always allowed, over that at which the pump's whole flow would move the piston, root mean
square [dimensionless]: a piston that hardly moves yields on its seals, which no circuit describes exactly."""

HALF_POWER = math.sqrt(0.5)
"""Share of velocity, root mean square, beyond which a circuit explains less than half of its power [dimensionless]: if
it does not follow pressure either, it says nothing about the log."""


def yielding_velocity(blocks: Blocks, actuator: Actuator) -> float:
    """Return the allowed residual velocity of a piston that yields on its seals.

    Returns
    -------
    float
        `YIELDING_SHARE` of the velocity at which the pump's whole flow would move the piston, root mean square [m/s];
        without pressure at most `HALF_POWER` of the piston's own.
    """
    pump = actuator.circuit.pump_displacement / actuator.circuit.piston_area
    yielding = YIELDING_SHARE * pump * float(np.sqrt(np.mean(blocks.speed**2)))
    return yielding if blocks.pressure is not None else min(yielding, HALF_POWER * float(blocks.rms[0]))


def yields_on_seals(blocks: Blocks, fit: PointFit, actuator: Actuator) -> bool:
    """Return whether a piston hardly moves, and a circuit follows it within what seals yield.

    Parameters
    ----------
    fit : PointFit
        The circuit.

    Returns
    -------
    bool
        Whether the residual velocity is within what seals may yield, and within `UNEXPLAINED` of velocity too.
    """
    yielding = yielding_velocity(blocks, actuator)
    return float(fit.scales[0]) <= yielding and UNEXPLAINED[0] * float(blocks.rms[0]) <= yielding


def follows_velocity(blocks: Blocks, fit: PointFit, actuator: Actuator) -> bool:
    """Return whether a circuit follows the velocity of a log closely enough.

    Parameters
    ----------
    fit : PointFit
        The circuit.

    Returns
    -------
    bool
        Whether its residual is at most `UNEXPLAINED` of velocity, twice the noise, or what seals yield.
    """
    least = max(2.0 * float(blocks.noise[0]), yielding_velocity(blocks, actuator))
    return float(fit.scales[0]) <= max(UNEXPLAINED[0] * float(blocks.rms[0]), least)
