"""A plant's step as C99: the fixed step that Python runs, with its parameters and measurable channels."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil

import numpy as np

from plant.arrays import Array
from plant.compiled.c99.files import c_files, checked_name
from plant.compiled.c99.lines import c_lines, operations_of
from plant.compiled.c99.precision import precision_of
from plant.compiled.expression import Expression, as_expression, symbol
from plant.compiled.hoist import hoisted
from plant.eha.model import EhaParameters
from plant.eha.simulate import Plant
from plant.runs import require_positive
from plant.solvers.steps import parameter_names, parameter_row, parameter_symbols
from plant.units import notes

ABOUT: Mapping[str, str] = {
    "prepare": "Compute what stays the same from step to step.",
    "advance": "Take one step of the scheme, the drive linear from begin to end.",
    "observe": "Compute what a bench could measure.",
}

ARGUMENTS: Mapping[str, str] = {
    "prepare": "const {real} *rows, {real} *constants",
    "advance": "{real} *state, const {real} *constants, {real} begin, {real} end",
    "observe": "const {real} *state, const {real} *rows, {real} *outputs",
}


@dataclass(frozen=True)
class PlantGraphs:
    """Expression graphs of a plant in C.

    Parameters
    ----------
    constants : dict[str, Expression]
        Quantities that are the same at every step.
    stepped, outputs : dict[str, Expression]
        The state after one step, and the channels that a bench could measure.
    """

    constants: dict[str, Expression]
    stepped: dict[str, Expression]
    outputs: dict[str, Expression]


def substeps_of(plant: Plant, sample_time: float, row: Array) -> int:
    """Return the number of fixed steps per sample.

    Parameters
    ----------
    sample_time : float
        Seconds between samples [s].
    row : ndarray, shape (parameters,)
        The plant's parameters [SI].
    """
    return max(1, round(plant.substeps * sample_time / 1e-4), ceil(plant.step_rate(row[None, None]) * sample_time))


def plant_graphs(plant: Plant) -> PlantGraphs:
    """Trace a plant's step and its measurable channels."""
    given = [*(f"x{i}" for i in range(len(plant.states))), "u_start", "u_end"]
    *state, start, end = map(symbol, given)
    known = parameter_symbols(plant.parameter_class)
    result = plant.step(tuple(state), (start, end), known, symbol("h"))
    after = {x: as_expression(value) for x, value in zip(given, result, strict=False)}
    fixed, stepped = hoisted(after, {*given}, "c")
    seen = {name: as_expression(value) for name, value in plant.observe(tuple(state), known).items()}
    return PlantGraphs(fixed, stepped, seen)


def plant_in_c(
    plant: Plant, parameters: EhaParameters, sample_time: float, *, name: str, precision: str = "double"
) -> dict[str, str]:
    """Write a plant's step as C99.

    Parameters
    ----------
    plant : Plant
        One of `plant.eha.simulate.PLANTS`.
    sample_time : float
        Seconds between samples [s].
    name : str
        Name of its files, types and functions: a valid name in C.
    precision : str
        ``double`` or ``float``.

    Returns
    -------
    dict[str, str]
        Texts of ``NAME.h``, ``NAME.c``, ``example.c`` and ``Makefile``, by file name.

    Raises
    ------
    HydrostateError
        If the name is not valid in C, or the precision is not known.
    """
    real, name = precision_of(precision), checked_name(name)
    require_positive("sample_time", sample_time, "s")
    complete, graphs = plant.complete(parameters), plant_graphs(plant)
    row, names = parameter_row(complete), parameter_names(plant.parameter_class)
    substeps = substeps_of(plant, sample_time, row)
    rows = {one: f"rows[{i}]" for i, one in enumerate((*names, "h"))}
    state = {f"x{i}": f"state[{i}]" for i in range(len(plant.states))}
    kept = {one: f"constants[{i}]" for i, one in enumerate(graphs.constants)}
    told = {f"{one}": f"constants[{len(kept) + i}]" for i, one in enumerate(rows)}
    outputs = {one: f"outputs[{i}]" for i, one in enumerate(graphs.outputs)}
    bodies = {
        "prepare": c_lines(graphs.constants, rows, kept, real),
        "advance": c_lines(graphs.stepped, {**state, **kept, **told, "u_start": "begin", "u_end": "end"}, state, real),
        "observe": c_lines(graphs.outputs, {**state, **rows}, outputs, real),
    }
    each = operations_of(graphs.stepped)
    values = [*row.tolist(), sample_time / substeps]
    known = notes(plant.parameter_class)
    about = [(one, f"{known[one].unit}, {known[one].meaning}") for one in names] + [("step", "s, step of the scheme")]
    facts = {
        "plant": plant.name,
        "sample_time": sample_time,
        "substeps": substeps,
        "operations": sorted((kind, substeps * count) for kind, count in each.items()),
        "state_names": plant.states,
        "output_names": list(graphs.outputs),
        "row_names": about,
        "row_values": [real.literal(value) for value in values],
        "start_values": [real.literal(value) for value in np.asarray(plant.start(row), dtype=float).tolist()],
        "constants": len(kept),
        "functions": "\n\n".join(_function(name, part, lines, real.name) for part, lines in bodies.items()),
    }
    return c_files("plant", "plant", name, real, facts)


def _function(name: str, part: str, lines: list[str], real: str) -> str:
    body = "\n".join(f"    {line}" for line in lines)
    silent = "" if part != "observe" or "rows[" in body else "    (void)rows;\n"
    return (
        f"/* {ABOUT[part]} */\nstatic void {name}_{part}({ARGUMENTS[part].format(real=real)})\n{{\n{silent}{body}\n}}"
    )
