"""Kernels that predict a log by a grey-box model under several parameter sets side by side.

A search by finite differences asks for a dozen nearby predictions of one log: as many as fit into the processor's
vectors take little longer than one.
"""

from collections.abc import Callable
from functools import cache
from typing import TypeAlias

from estimation.arrays import Array, IntArray
from estimation.fits.greybox.kernel import model_step
from estimation.fits.greybox.loops import RUNAWAY
from estimation.fits.greybox.side_by_side_loops import absorb, residuals_side_by_side
from estimation.models.greybox import GreyBoxModel
from plant.compiled.expression import as_expression, symbol
from plant.compiled.hoist import hoisted
from plant.compiled.native.load import load_native
from plant.compiled.native.machine import native_width
from plant.compiled.native.signature import signature_of
from plant.compiled.pack import packed_source
from plant.compiled.paste import kernel_text, pasted
from plant.compiled.simplify import fused, simplified
from plant.compiled.source import lines_source, operations_source
from plant.solvers.fixed_step_loops import lay, share
from plant.solvers.steps import parameter_names, parameter_symbols

LANES = 8
"""Parameter sets side by side, as many as a vector register of 512 bits holds."""

MANY = 2 * LANES
"""The same where there are more: two vectors a step, of which one is worked on while the other waits, take from 1.3
to 1.6 times as long as one."""

ResidualsRun: TypeAlias = Callable[[Array, Array, Array, float, IntArray, int, Array, Array, Array, Array], None]
"""``run(parameters, drives, measured, sample_time, substeps, block, variance, walk, open_at, errors)`` fills errors."""


@cache
def compile_side_by_side(model: GreyBoxModel, lanes: int) -> ResidualsRun:
    """Generate the kernel that gives a model's normalised residuals under several parameter sets.

    Parameters
    ----------
    model : GreyBoxModel
        The model; it is stepped by ROS2, second order and L-stable.
    lanes : int
        Parameter sets side by side: `LANES` or `MANY`.

    Returns
    -------
    callable
        Takes what `estimation.fits.greybox.side_by_side_loops.residuals_side_by_side` does, so many parameter rows.
    """
    takes = signature_of(residuals_side_by_side, lanes=lanes, outputs=len(model.outputs), drives=len(model.drives))
    entries, made_of = {residuals_side_by_side.__name__: takes}, (model, lanes, native_width())
    kernel = load_native(f"residuals_{model.name}_{lanes}", lambda: _source(model, lanes), entries, made_of)
    return kernel.residuals_side_by_side


@cache
def _written(model: GreyBoxModel) -> tuple[dict[str, str], list[str], int]:
    """Return the lines of a model, all that stands in memory, and the count of states; the same for any lanes."""
    names, drives = parameter_names(model.parameters), range(len(model.drives))
    p = parameter_symbols(model.parameters)
    begun = {f"x{i}": as_expression(value) for i, value in enumerate(model.initial(p))}
    states = [symbol(name) for name in begun]
    starts = [symbol(f"base{i}") + symbol("j") * symbol(f"rise{i}") for i in drives]
    ends = [start + symbol(f"rise{i}") for i, start in zip(drives, starts, strict=True)]
    moved = model_step(model, states, p, list(zip(starts, ends, strict=True)))
    shown = {f"y{i}": as_expression(value) for i, value in enumerate(model.observe(tuple(states)))}
    moving = [*begun, *(f"base{i}" for i in drives), *(f"rise{i}" for i in drives)]
    settled, stepped = hoisted(
        simplified(dict(zip(begun, moved, strict=True)), {*names, "h", "share"}), {*moving, "j"}, "c"
    )
    every = [*moving, *shown, "h", *names, *settled, "share"]
    lines = {
        "begin": lines_source("begin", begun),
        "settle": lines_source("settle", settled),
        "step": packed_source("step", fused(stepped)),
        "show": lines_source("show", shown),
    }
    return lines, every, len(begun)


def _source(model: GreyBoxModel, lanes: int) -> str:
    """Write the kernel."""
    lines, every, width = _written(model)
    vector = min(lanes, native_width())
    sizes = {
        "LANES": lanes,
        "VECTOR": vector,
        "WIDTH": width,
        "DRIVES": len(model.drives),
        "OUTPUTS": len(model.outputs),
        "COLUMNS": len(parameter_names(model.parameters)),
        "NUMBERS": lanes * len(every),
        "RUNAWAY": RUNAWAY,
    }
    return kernel_text(
        f"residuals of the {model.name} model, {lanes} parameter sets side by side",
        operations_source(lines, {each: lanes * i for i, each in enumerate(every)}, vector),
        pasted(lay, share, absorb, constants=sizes, inlined=True),
        pasted(residuals_side_by_side),
    )
