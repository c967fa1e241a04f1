"""Runs in fixed steps: `trajectory` for any plant and its parameters, and the kernel that it compiles."""

from collections.abc import Callable
from functools import cache
from typing import TypeAlias

from plant.arrays import Array
from plant.compiled.expression import as_expression, symbol
from plant.compiled.hoist import hoisted
from plant.compiled.native.load import load_native
from plant.compiled.native.signature import signature_of
from plant.compiled.paste import functions_text, kernel_text
from plant.compiled.source import lines_source, operations_source
from plant.runs import require_finite, steps_a_sample
from plant.solvers.fixed_step_loops import run_alone
from plant.solvers.steps import Parameters, StepFunction, parameter_names, parameter_row, parameter_symbols

Trajectory: TypeAlias = Callable[[Array, Array, Array, float, int], Array]
"""``run(initial state, drive, parameter rows, sample time, substeps) -> states, shape (n, states)``."""


def trajectory(
    name: str,
    step: StepFunction,
    start: Array,
    drive: Array,
    parameters: Parameters,
    sample_time: float,
    *,
    longest_step: float,
) -> Array:
    """Run any plant along a drive in fixed steps.

    Parameters
    ----------
    step : callable
        ``step(state, drives, parameters, h)``, written for symbols. For a plant's ``derivative(state, drive,
        parameters)`` use `plant.solvers.steps.ros2_step`, which is L-stable, or `plant.solvers.steps.rk4_step`.
    start : ndarray, shape (states,)
        Initial state in SI.
    drive : ndarray, shape (n,)
        Drive at the samples [its SI unit], linear between.
    sample_time : float
        Seconds between samples [s].
    longest_step : float
        Longest step [s].

    Returns
    -------
    ndarray, shape (n, states)
        States at the samples.

    Raises
    ------
    HydrostateError
        If the state stops being finite.

    Examples
    --------
    >>> import numpy as np
    >>> from dataclasses import dataclass
    >>> from plant.solvers.steps import ros2_step
    >>> @dataclass(frozen=True)
    ... class Lag:
    ...     time_constant: float = 0.5
    >>> def rates(state, drive, p):
    ...     return ((drive - state[0]) / p.time_constant,)
    >>> states = trajectory("lag", ros2_step(rates), np.zeros(1), np.ones(101), Lag(), 0.01, longest_step=0.001)
    >>> states[[0, 50, 100], 0].round(4).tolist()
    [0.0, 0.6321, 0.8647]
    """
    run = compile_trajectory(name, step, len(start), type(parameters))
    row = parameter_row(parameters)[None]
    states = run(start, drive, row, sample_time, steps_a_sample(sample_time, longest_step))
    require_finite(states, sample_time, name)
    return states


@cache
def compile_trajectory(name: str, step: StepFunction, width: int, parameter_class: type[Parameters]) -> Trajectory:
    """Generate the kernel that runs a step function along a drive.

    Parameters
    ----------
    name : str
        Name of the kernel, for its file's name.
    step : callable
        ``step(state, speeds, parameters, h)``, written for symbols.
    width : int
        Number of states.
    parameter_class : type
        Class of the parameter rows, field by field.

    Returns
    -------
    callable
        ``run(initial (states,), speed (n,), parameter rows (1 or n, parameters), sample time [s], substeps)``, which
        returns the states at the samples, shape (n, states).
    """
    given = [*(f"x{i}" for i in range(width)), "u_start", "u_end"]
    *state, start, end = map(symbol, given)
    result = step(tuple(state), (start, end), parameter_symbols(parameter_class), symbol("h"))
    outputs = {x: as_expression(value) for x, value in zip(given, result, strict=False)}
    fixed, stepped = hoisted(outputs, {*given}, "c")
    names = parameter_names(parameter_class)
    every = [*given[:width], "h", *names, *fixed]
    slots = {name: i for i, name in enumerate(every)}
    parts = (
        operations_source({"settle": lines_source("settle", fixed)}, slots, 1),
        lines_source("step", stepped),
        f"load = loading({width})\nadvance = advancing({given}, SLOTS, step, {width})",
        functions_text(run_alone, constants={"WIDTH": width, "COLUMNS": len(names), "NUMBERS": len(every)}),
    )
    text = kernel_text(f"trajectory of the {name} plant", *parts)
    return load_native(name, text, {"run_alone": signature_of(run_alone, states=width)}).run_alone
