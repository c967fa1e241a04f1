"""Runs the equations of motion by Heun's method with a small fixed step, compiled."""

import math
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from experiments.open_benchmark.equations import STATES, clipped, rates, stop_force
from experiments.open_benchmark.flows import check_flow, filling, leakage_flow, oil_flows, orifice_flow, pump_flow
from experiments.open_benchmark.friction import MICRO_DAMPING, SLIPS, friction_force, steady_friction, update_stretch
from experiments.open_benchmark.machine import ATMOSPHERE, LIFT, PRELOAD, Machine
from experiments.open_benchmark.oil import (
    LEAST_STIFFNESS,
    air_space,
    liquid_space,
    relative_stiffness,
    specific_volume,
    stiffness,
)
from plant.arrays import Array
from plant.compiled.native.load import load_native
from plant.compiled.native.signature import signature_of
from plant.compiled.paste import functions_text, kernel_text

TICK = 1e-3
"""Time between two rows of a course [s]."""

RECORD = 1e-4
"""Time between two rows of a run [s]."""


def advance(y: Array, stretch: Array, now: Array, demand: float, m: Machine, step: float, work: Array) -> None:
    """Advance states and springs in place by one step of Heun's method.

    Parameters
    ----------
    y : ndarray, shape (7,)
        `STATES`.
    stretch : ndarray, shape (4,)
        Stretch of the friction springs [m].
    now : ndarray, shape (5,)
        One row of the course.
    demand : float
        Demanded motor speed [rad/s].
    step : float
        Step size [s].
    work : ndarray, shape (4, 7)
        Work space for rates and predictions, in the states' units.
    """
    first, second, ahead, pulled = work[0], work[1], work[2], work[3]
    rates(y, stretch, now, demand, m, first)
    for i in range(len(y)):
        ahead[i] = y[i] + step * first[i]
    update_stretch(stretch, step * y[3], m, pulled)
    rates(ahead, pulled, now, demand, m, second)
    update_stretch(stretch, 0.5 * step * (y[3] + ahead[3]), m, stretch)
    for i in range(len(y)):
        y[i] += 0.5 * step * (first[i] + second[i])


def trajectory(m: Machine, course: Array, y: Array, stretch: Array, substeps: int, out: Array) -> None:
    """Write the states at every `RECORD`; the controller runs on the clock of the course.

    Parameters
    ----------
    course : ndarray, shape (n, 5)
        `COURSE` at every `TICK`.
    y : ndarray, shape (7,)
        States at the start, overwritten by those at the end, in their units.
    stretch : ndarray, shape (4,)
        Stretch of the friction springs [m].
    substeps : int
        Steps per record.
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
            for j in range(len(y)):
                out[k * ticks + i, j] = y[j]
            for _ in range(substeps):
                advance(y, stretch, now, demand, m, step, work)


PARTS = (
    *(clipped, air_space, relative_stiffness, liquid_space, specific_volume, stiffness),
    *(orifice_flow, check_flow, pump_flow, filling, leakage_flow, oil_flows),
    *(update_stretch, steady_friction, friction_force, stop_force, rates, advance, trajectory),
)
"""Functions of the compiled run, each after those that it calls."""


@cache
def compiled() -> Callable[..., Any]:
    """Return `trajectory`, compiled."""
    constants = {"ATMOSPHERE": ATMOSPHERE, "LIFT": LIFT, "PRELOAD": PRELOAD, "RECORD": RECORD}
    constants |= {"SLIPS": SLIPS, "MICRO_DAMPING": MICRO_DAMPING, "LEAST_STIFFNESS": LEAST_STIFFNESS}
    text = kernel_text("a run of the open benchmark's actuator", functions_text(*PARTS, constants=constants))
    return load_native("open_benchmark", text, {"trajectory": signature_of(trajectory)}).trajectory


def at_rest(m: Machine) -> Array:
    """Return `STATES` at rest in mid-stroke, both chambers at the accumulator's pressure; shape (7,), SI units."""
    return np.array([0.0, 0.0, 0.0, 0.0, m.supply, m.supply, 0.0])


def run(m: Machine, course: Array, start: Array | None = None, refine: int = 1) -> Array:
    """Return the states over a course.

    Parameters
    ----------
    course : ndarray, shape (n, 5)
        `COURSE` at every `TICK`.
    start : ndarray, shape (7,), optional
        States at the start, in their units; at rest if not given.
    refine : int
        Factor by which the steps are finer than necessary.

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
    """Return the steps per record: at most 20 us each, and stable for the decay of the oil film with a margin of two.

    Parameters
    ----------
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
