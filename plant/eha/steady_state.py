"""Where the actuator settles under a constant motor speed: equations 5.7, 5.8 and 5.11."""

from math import copysign

from plant.components.friction import quadratic_friction, velocity_under_friction
from plant.components.valves import pumped_flow
from plant.eha.model import EhaValues


def steady_state(speed: float, p: EhaValues) -> tuple[float, float]:
    """Return velocity and differential pressure in the steady state, with dead zone and relief (errata E7, E8).

    With no rates left, the flow balance gives the pressure as a line in velocity, and the force balance becomes the
    same quadratic that an implicit step solves.

    Parameters
    ----------
    speed : float
        Motor speed [rad/s].
    p : EhaParameters or namespace of float
        The actuator.

    Returns
    -------
    tuple of float
        Velocity [m/s] and differential pressure [Pa].

    Examples
    --------
    >>> from plant.eha.model import EhaParameters
    >>> velocity, pressure = steady_state(125.66, EhaParameters())
    >>> round(velocity, 4), round(pressure / 1e5, 2)
    (0.0431, 4.28)
    """
    pumped = float(pumped_flow(speed, p.pump_displacement, p.flow_bias))
    velocity, pressure = _settled(pumped, p.leakage_coefficient, 0.0, p)
    if abs(pressure) <= p.relief_pressure:
        return velocity, pressure
    held = p.relief_conductance * p.relief_pressure * (1.0 if pressure > 0.0 else -1.0)
    return _settled(pumped + held, p.leakage_coefficient, p.relief_conductance, p)


def _settled(flow: float, leakage: float, relief: float, p: EhaValues) -> tuple[float, float]:
    A, conductance = p.piston_area, leakage + relief
    if conductance == 0.0:
        velocity, direction = flow / A, copysign(1.0, flow)
        force = quadratic_friction(velocity, direction, p.friction_quadratic, p.friction_linear, p.friction_coulomb)
        return velocity, float(force) / A
    resistance = A * A / conductance + p.friction_linear
    push = A * flow / conductance
    velocity = float(velocity_under_friction(push, resistance, p.friction_quadratic, p.friction_coulomb))
    return velocity, (flow - A * velocity) / conductance
