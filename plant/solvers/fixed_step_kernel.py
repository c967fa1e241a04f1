"""Fixed-step kernels written as straight lines of instructions: one run, or several runs side by side.

`plant.solvers.trajectory.compile_trajectory` takes the same step as written. Here factors are gathered, products are
fused with sums, and a single run performs several divisions at a time (`plant.compiled.pack`). As many runs as fit into
the processor's vectors take little longer than one, and give the same bits as one.
"""

from collections.abc import Callable
from functools import cache
from typing import TypeAlias

from plant.arrays import Array
from plant.compiled.expression import as_expression, symbol
from plant.compiled.hoist import hoisted
from plant.compiled.native.load import load_native
from plant.compiled.native.machine import native_width
from plant.compiled.native.signature import signature_of
from plant.compiled.pack import packed_source
from plant.compiled.paste import functions_text, kernel_text
from plant.compiled.simplify import fused, simplified
from plant.compiled.source import lines_source, operations_source
from plant.solvers.fixed_step_loops import place_rows, place_shared, run_side_by_side
from plant.solvers.steps import Parameters, StepFunction, parameter_names, parameter_symbols

FixedStepRun: TypeAlias = Callable[[Array, Array, Array, float, int, Array], None]
"""``run(starts, drives, parameter rows, sample time, substeps, states)``, which fills states."""


@cache
def compile_fixed_step(
    name: str, step: StepFunction, width: int, parameter_class: type[Parameters], lanes: int
) -> FixedStepRun:
    """Generate the kernel that runs a step function along drives, side by side.

    Parameters
    ----------
    name : str
        Name of the kernel, for its file's name.
    step : callable
        ``step(state, drives, parameters, h)``, written for symbols.
    width : int
        Number of states.
    parameter_class : type
        Class of the parameter rows, field by field.
    lanes : int
        Number of runs side by side: 1 or 8.

    Returns
    -------
    callable
        ``run(starts (states, lanes), drives (n, lanes), parameters (lanes, parameters), sample time [s], substeps,
        states (n, states, up to lanes))``.
    """
    takes = signature_of(run_side_by_side, lanes=lanes, states=width)
    made_of = (name, step, width, parameter_class, lanes, native_width())
    return load_native(
        f"{name}_fixed_step_{lanes}",
        lambda: _source(name, step, width, parameter_class, lanes),
        {"run_side_by_side": takes},
        made_of,
    ).run_side_by_side


def _source(name: str, step: StepFunction, width: int, parameter_class: type[Parameters], lanes: int) -> str:
    """Write the kernel."""
    names = parameter_names(parameter_class)
    state = tuple(symbol(f"x{i}") for i in range(width))
    start = symbol("drive") + symbol("j") * symbol("rise")
    result = step(state, (start, start + symbol("rise")), parameter_symbols(parameter_class), symbol("pace"))
    outputs = simplified({f"x{i}": as_expression(value) for i, value in enumerate(result)}, {*names, "pace"})
    fixed, stepped = hoisted(outputs, {*(f"x{i}" for i in range(width)), "drive", "rise", "j"}, "c")
    every = [*(f"x{i}" for i in range(width)), "drive", "rise", "pace", *names, *fixed]
    slots = {each: lanes * i for i, each in enumerate(every)}
    vector = min(lanes, native_width())
    lines = {"settle": lines_source("settle", fixed), "step": packed_source("step", fused(stepped))}
    sizes = {"LANES": lanes, "VECTOR": vector, "WIDTH": width, "COLUMNS": len(names), "NUMBERS": lanes * len(every)}
    title = f"trajectories of the {name} plant in fixed steps, {lanes} side by side"
    parts = (
        operations_source(lines, slots, vector),
        functions_text(place_rows, place_shared, constants=sizes, inlined=True),
        functions_text(run_side_by_side),
    )
    return kernel_text(title, *parts)
