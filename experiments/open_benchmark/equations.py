"""The equations of motion: motor, piston, two chambers, accumulator."""

import math

from experiments.open_benchmark.flows import oil_flows
from experiments.open_benchmark.friction import friction_force
from experiments.open_benchmark.machine import ATMOSPHERE, Machine
from experiments.open_benchmark.oil import specific_volume, stiffness
from plant.arrays import Array

STATES = ("motor_speed", "shaft_angle", "position", "velocity", "pressure_a", "pressure_b", "made_up")
"""The states: rad/s, rad, m, m/s, stretch pressures of the chambers [Pa], and the oil that left the accumulator
[m^3]."""


def clipped(value: float, low: float, high: float) -> float:
    """Return a value limited to two bounds, in its own unit."""
    return min(max(value, low), high)


def stop_force(x: float, v: float, m: Machine) -> float:
    """Return the force of the end stops [N], which push but never pull.

    Parameters
    ----------
    x, v : float
        Position [m] and velocity [m/s].
    """
    over = abs(x) - 0.5 * m.stroke
    if over <= 0.0:
        return 0.0
    side = math.copysign(1.0, x)
    return -side * max(m.stop_stiffness * over + m.stop_damping * v * side, 0.0)


def rates(y: Array, stretch: Array, now: Array, demand: float, m: Machine, out: Array) -> None:
    """Write the rates of `STATES`: motor, piston, two chambers, accumulator.

    Parameters
    ----------
    y, out : ndarray, shape (7,)
        States and their rates, each rate in its state's unit per second.
    stretch : ndarray, shape (4,)
        Stretch of the friction springs [m].
    now : ndarray, shape (5,)
        One row of the course.
    demand : float
        Demanded motor speed [rad/s].
    """
    speed, angle, x, v, a, b, made_up = y[0], y[1], y[2], y[3], y[4], y[5], y[6]
    viscosity, wear, air, rough = now[1], now[2], now[3], now[4]
    supply = m.supply * m.supply_gas / (m.supply_gas + made_up)
    slowed = m.displacement * (a - b) / m.rotor_inertia
    out[0] = clipped((demand - speed) / m.motor_lag, -m.acceleration - slowed, m.acceleration - slowed)
    out[1] = speed
    out[2] = v
    felt_a, felt_b = max(a, m.vapour) - ATMOSPHERE, max(b, m.vapour) - ATMOSPHERE
    push = m.area_a * felt_a - m.area_b * felt_b - m.load - m.spring * x + stop_force(x, v, m)
    out[3] = (push - friction_force(v, stretch, viscosity, rough, m)) / m.mass
    into_a, into_b, made = oil_flows((speed, angle), (a, b, supply), wear / viscosity, air, m)
    grows_a = into_a * specific_volume(a, air, m) - m.area_a * v
    grows_b = into_b * specific_volume(b, air, m) + m.area_b * v
    out[4] = stiffness(a, air, m) * grows_a / (m.volume_a + m.area_a * x)
    out[5] = stiffness(b, air, m) * grows_b / (m.volume_b - m.area_b * x)
    out[6] = made
