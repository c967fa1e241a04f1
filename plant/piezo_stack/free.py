"""The free, unloaded stack, as in the displacement experiment of the piezo-stack paper (equation 2)."""

from math import ceil, pi, sqrt
from typing import Any

import numpy as np

from plant.arrays import Array
from plant.compiled.functions import Scalar
from plant.components.piezo_stack import lagged_force_rate, stack_force
from plant.piezo_stack.hysteresis import hysteresis_rate
from plant.piezo_stack.parameters import PiezoStackParameters
from plant.piezo_stack.run import sine_drive
from plant.piezo_stack.trajectory import stack_row
from plant.solvers.steps import State, rate_driven_step
from plant.solvers.trajectory import compile_trajectory

FREE_STATES = ("stack_displacement_m", "stack_velocity_m_s", "linear_force_n", "hysteresis_m")
"""States of the free stack."""

_STEPS_A_PERIOD = 30.0
"""Steps in one period of the stack's natural vibration."""


def free_stack_derivative(state: State, voltage: Scalar, rate: Scalar, p: Any) -> State:
    """Return the rates of a stack without load, equations 1 and 2 with errata P1 and P2.

    Parameters
    ----------
    state : tuple of float or Expression
        As named in `FREE_STATES`, in SI.
    voltage, rate : float or Expression
        Drive [V] and its rate [V/s].

    Returns
    -------
    tuple of float or Expression
        Rates per second.
    """
    x, v, driven, h = state
    return (
        v,
        stack_force(driven, h, x, v, p.stack_stiffness, p.stack_damping) / p.stack_mass,
        lagged_force_rate(driven, voltage, p.free_stroke_a_volt * p.stack_stiffness, p.stack_lag),
        hysteresis_rate(rate, h, p),
    )


_free_step = rate_driven_step(free_stack_derivative)


def run_free_stack(parameters: PiezoStackParameters, voltage: Array, sample_time: float) -> Array:
    """Return the displacement of a stack without load, from rest without hysteresis (equations 1 and 2).

    Parameters
    ----------
    voltage : ndarray, shape (n,)
        Drive at the samples [V], linearly interpolated.
    sample_time : float
        Seconds between samples [s].

    Returns
    -------
    ndarray, shape (n,)
        Displacement [m].

    Examples
    --------
    >>> x = run_free_stack(PiezoStackParameters(), np.full(200, 50.0), 1e-5)
    >>> round(1e6 * float(x[-1]), 3)
    16.635
    """
    p = parameters
    run = compile_trajectory("free_stack", _free_step, len(FREE_STATES), PiezoStackParameters)
    period = 2.0 * pi * sqrt(p.stack_mass / p.stack_stiffness)
    substeps = ceil(_STEPS_A_PERIOD * sample_time / period)
    driven = p.free_stroke_a_volt * p.stack_stiffness * float(voltage[0])
    start = np.array([driven / p.stack_stiffness, 0.0, driven, 0.0])
    return run(start, voltage, stack_row(p)[None], sample_time, substeps)[:, 0]


def stack_loop(
    parameters: PiezoStackParameters, frequency: float, peak_to_peak: float, samples: int = 400
) -> tuple[Array, Array]:
    """Return a closed loop of voltage and displacement, the third cycle from rest (equation 2).

    Parameters
    ----------
    frequency : float
        Drive frequency [Hz].
    peak_to_peak : float
        Peak-to-peak drive voltage [V]; its bias is half of that.
    samples : int
        Samples in a cycle.

    Returns
    -------
    tuple of ndarray, shape (samples + 1,)
        Voltage [V], displacement [m].
    """
    cycles = 3
    sample_time = 1.0 / (frequency * samples)
    voltage = sine_drive(frequency, peak_to_peak, cycles / frequency, sample_time)
    displacement = run_free_stack(parameters, voltage, sample_time)
    return voltage[-samples - 1 :], displacement[-samples - 1 :]


def loop_width(voltage: Array, displacement: Array) -> float:
    """Return the width of a loop at its middle voltage as a fraction of its stroke (equation 2).

    Parameters
    ----------
    voltage : ndarray, shape (n,)
        One cycle from trough to trough [V].
    displacement : ndarray, shape (n,)
        Displacement over that cycle [m].

    Returns
    -------
    float
        Width over stroke [dimensionless].

    Examples
    --------
    >>> round(loop_width(*stack_loop(PiezoStackParameters(), 1.0, 100.0)), 3)
    0.078
    """
    top = int(np.argmax(voltage))
    middle = 0.5 * (float(voltage[0]) + float(voltage[top]))
    rising = float(np.interp(middle, voltage[: top + 1], displacement[: top + 1]))
    falling = float(np.interp(middle, voltage[top:][::-1], displacement[top:][::-1]))
    return (falling - rising) / float(np.ptp(displacement))
