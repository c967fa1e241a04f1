"""Steady state of the actuator under a constant motor speed: equations 5.7, 5.8 and 5.11."""

from typing import Any

import numpy as np

from plant.components.friction import quadratic_friction, velocity_under_friction
from plant.components.valves import pumped_flow
from plant.eha.model import EhaValues


def steady_state(speed: float, p: EhaValues) -> tuple[Any, Any]:
    """Return velocity and differential pressure in the steady state, with dead zone and relief (errata E7, E8).

    If all rates are zero, the flow balance gives the pressure as a linear function of velocity, and the force balance
    becomes the same quadratic that an implicit step solves.

    Parameters
    ----------
    speed : float
        Motor speed [rad/s].
    p : EhaParameters or namespace of float or ndarray
        The actuator, or many actuators that differ in some parameters.

    Returns
    -------
    tuple of float or ndarray
        Velocity [m/s] and differential pressure [Pa].

    Examples
    --------
    >>> from plant.eha.model import EhaParameters
    >>> velocity, pressure = steady_state(125.66, EhaParameters())
    >>> round(velocity, 4), round(pressure / 1e5, 2)
    (0.0431, 4.28)
    """
    pumped = pumped_flow(speed, p.pump_displacement, p.flow_bias)
    closed = _steady_balance(pumped, p.leakage_coefficient, p)
    held = p.relief_conductance * p.relief_pressure * np.where(closed[1] > 0.0, 1.0, -1.0)
    relieved = _steady_balance(pumped + held, p.leakage_coefficient + p.relief_conductance, p)
    below = np.abs(closed[1]) <= p.relief_pressure
    velocity, pressure = (np.where(below, one, other) for one, other in zip(closed, relieved, strict=True))
    return (velocity, pressure) if velocity.ndim else (float(velocity), float(pressure))


def _steady_balance(flow: Any, conductance: Any, p: EhaValues) -> tuple[Any, Any]:
    """Return the velocity and pressure at which this flow passes through piston and leakage paths."""
    area, quadratic, coulomb = p.piston_area, p.friction_quadratic, p.friction_coulomb
    tight = np.asarray(conductance == 0.0)  # all of the flow moves the piston, whatever the pressure
    paths = np.where(tight, 1.0, conductance)
    leaking = velocity_under_friction(area * flow / paths, area**2 / paths + p.friction_linear, quadratic, coulomb)
    velocity = np.where(tight, flow / area, leaking)
    force = quadratic_friction(velocity, np.copysign(1.0, flow), quadratic, p.friction_linear, coulomb)
    return velocity, np.where(tight, force / area, (flow - area * velocity) / paths)
