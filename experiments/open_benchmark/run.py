"""The equations of motion, and their run by Heun's method in small steps of one size."""

import math
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.open_benchmark.flows import check_flow, filling, leakage_flow, oil_flows, orifice_flow, pump_flow
from experiments.open_benchmark.friction import MICRO_DAMPING, SLIPS, friction_force, steady_friction, stretched
from experiments.open_benchmark.machine import ATMOSPHERE, LIFT, PRELOAD, Machine
from experiments.open_benchmark.oil import THINNEST, air_space, liquid_space, specific_volume, stiffened, stiffness
from plant.compiled.kernel_file import load_kernel
from plant.compiled.paste import kernel_text, pasted

STATES = ("motor_speed", "shaft_angle", "position", "velocity", "pressure_a", "pressure_b", "made_up")
"""The states: rad/s, rad, m, m/s, stretch pressures of the chambers [Pa], and oil that left the accumulator [m^3]."""

COURSE = ("demand", "viscosity", "wear", "air", "rough")
"""What changes in time: speed asked for [rad/s] or position [m]; viscosity, leakage and grip over those at the start;
entrained air, a unit of oil [all dimensionless]."""

TICK = 1e-3
"""Time between two rows of a course [s]."""

RECORD = 1e-4
"""Time between two rows of a run [s]."""

Array = NDArray[np.float64]


def clipped(value: float, low: float, high: float) -> float:
    """Return a value between two bounds, in its own unit."""
    return min(max(value, low), high)


def stop_force(x: float, v: float, m: Machine) -> float:
    """Return the force of the end stops [N], which push but never pull.

    Parameters
    ----------
    x, v : float
        Position [m] and velocity [m/s].
    m : Machine
        The actuator.
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
        States and their rates, each in its unit a second.
    stretch : ndarray, shape (4,)
        Of the friction's springs [m].
    now : ndarray, shape (5,)
        A row of the course.
    demand : float
        Motor speed asked for [rad/s].
    m : Machine
        The actuator.
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


def advance(y: Array, stretch: Array, now: Array, demand: float, m: Machine, step: float, work: Array) -> None:
    """Advance states and springs in place by one step of Heun's method.

    Parameters
    ----------
    y : ndarray, shape (7,)
        `STATES`.
    stretch : ndarray, shape (4,)
        Of the friction's springs [m].
    now : ndarray, shape (5,)
        A row of the course.
    demand : float
        Motor speed asked for [rad/s].
    m : Machine
        The actuator.
    step : float
        [s].
    work : ndarray, shape (4, 7)
        Room for rates and predictions, in the states' units.
    """
    first, second, ahead, pulled = work[0], work[1], work[2], work[3]
    rates(y, stretch, now, demand, m, first)
    for i in range(len(y)):
        ahead[i] = y[i] + step * first[i]
    stretched(stretch, step * y[3], m, pulled)
    rates(ahead, pulled, now, demand, m, second)
    stretched(stretch, 0.5 * step * (y[3] + ahead[3]), m, stretch)
    for i in range(len(y)):
        y[i] += 0.5 * step * (first[i] + second[i])


def trajectory(m: Machine, course: Array, y: Array, stretch: Array, substeps: int, out: Array) -> None:
    """Write the states at every `RECORD`; the controller's clock is the course's.

    Parameters
    ----------
    m : Machine
        The actuator.
    course : ndarray, shape (n, 5)
        `COURSE` at every `TICK`.
    y : ndarray, shape (7,)
        States at the start; those at the end afterwards, in their units.
    stretch : ndarray, shape (4,)
        Of the friction's springs [m].
    substeps : int
        Steps a record.
    out : ndarray, shape (10 n, 7)
        The states.
    """
    work = np.zeros((4, len(y)))
    step = RECORD / substeps
    ticks = out.shape[0] // course.shape[0]
    for k in range(course.shape[0]):
        now = course[k]
        demand = now[0] if m.loop_gain == 0.0 else m.loop_gain * (now[0] - y[2])
        demand = clipped(demand, -m.speed_limit, m.speed_limit)
        for i in range(ticks):
            out[k * ticks + i] = y
            for _ in range(substeps):
                advance(y, stretch, now, demand, m, step, work)


PARTS = (
    *(clipped, air_space, stiffened, liquid_space, specific_volume, stiffness),
    *(orifice_flow, check_flow, pump_flow, filling, leakage_flow, oil_flows),
    *(stretched, steady_friction, friction_force, stop_force, rates, advance, trajectory),
)
"""Functions of the compiled run, each behind those that it calls."""


@cache
def compiled() -> Callable[..., Any]:
    """Return `trajectory`, compiled."""
    constants = {"ATMOSPHERE": ATMOSPHERE, "LIFT": LIFT, "PRELOAD": PRELOAD, "RECORD": RECORD}
    constants |= {"SLIPS": SLIPS, "MICRO_DAMPING": MICRO_DAMPING, "THINNEST": THINNEST, "FIELDS": Machine._fields}
    text = kernel_text("a run of the open benchmark's actuator", pasted(*PARTS, constants=constants))
    return load_kernel("open_benchmark", text).trajectory


def at_rest(m: Machine) -> Array:
    """Return `STATES` at rest in mid-stroke, both chambers at the accumulator's pressure; shape (7,), SI units."""
    return np.array([0.0, 0.0, 0.0, 0.0, m.supply, m.supply, 0.0])


def run(m: Machine, course: Array, start: Array | None = None, refine: int = 1) -> Array:
    """Return the states over a course.

    Parameters
    ----------
    m : Machine
        The actuator.
    course : ndarray, shape (n, 5)
        `COURSE` at every `TICK`.
    start : ndarray, shape (7,), optional
        States at the start, in their units; at rest if not given.
    refine : int
        By how many times the steps are finer than they need be.

    Returns
    -------
    ndarray, shape (10 n, 7)
        `STATES` at every `RECORD`.
    """
    y = at_rest(m) if start is None else np.array(start)
    fastest = m.speed_limit if m.loop_gain else min(m.speed_limit, float(np.max(np.abs(course[:, 0]))))
    steps = refine * substeps_for(m, fastest)
    out = np.empty((round(TICK / RECORD) * len(course), len(STATES)))
    compiled()(m, np.ascontiguousarray(course), y, np.zeros(len(SLIPS)), steps, out)
    return out


def substeps_for(m: Machine, speed: float) -> int:
    """Return steps a record of at most 20 us that keep the decay of the oil film stable twice over.

    Parameters
    ----------
    m : Machine
        The actuator.
    speed : float
        Highest motor speed [rad/s].

    Examples
    --------
    >>> substeps_for(Machine(), 125.66)
    5
    """
    velocity = speed * m.displacement / min(m.area_a, m.area_b)
    film = (abs(m.linear) + 2.0 * m.quadratic * velocity) / m.mass
    return max(5, math.ceil(RECORD * film))
