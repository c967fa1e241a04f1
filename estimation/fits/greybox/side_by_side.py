"""Kernels that predict a log by a grey-box model under several parameter sets side by side.

A search by finite differences needs a dozen similar predictions of one log. As many as fit into the processor's vector
registers take little longer than one.
"""

from collections.abc import Callable
from functools import cache
from typing import TypeAlias

from estimation.fits.greybox.gap_loops import carry_each, correct_each, residuals_across_gaps
from estimation.fits.greybox.kernel import model_step
from estimation.fits.greybox.loops import RUNAWAY, SETTLED
from estimation.fits.greybox.side_by_side_loops import (
    absorb,
    close,
    drive,
    place_beginning,
    residuals_side_by_side,
    set_pace,
)
from estimation.models.greybox import GreyBoxModel
from plant.compiled.expression import Expression, as_expression, jacobian, symbol
from plant.compiled.hoist import hoisted
from plant.compiled.native.load import load_native
from plant.compiled.native.machine import native_width
from plant.compiled.native.signature import signature_of
from plant.compiled.pack import packed_source
from plant.compiled.paste import functions_text, kernel_text
from plant.compiled.simplify import fused, simplified
from plant.compiled.source import lines_source, operations_source
from plant.solvers.fixed_step_loops import place_rows, place_shared
from plant.solvers.steps import parameter_names, parameter_symbols

LANES = 8
"""Parameter sets side by side, as many as a vector register of 512 bits holds."""

MOST_LANES = 2 * LANES
"""The same for more sets: two vectors per step, one computed while the other waits, take 1.3 to 1.6 times as long as
one."""

ResidualsRun: TypeAlias = Callable[..., None]
"""``run(parameters, drives, measured, sample_time, substeps, block, variance, walk, open_at, kept, errors)`` fills
errors; of a model that bears gaps, these come before the errors."""


def lanes_for(runs: int) -> int:
    """Return the number of lanes of the kernel for so many runs, `MOST_LANES` at most [count]."""
    return LANES if runs <= LANES else MOST_LANES


@cache
def compile_side_by_side(model: GreyBoxModel, lanes: int) -> ResidualsRun:
    """Generate the kernel that gives a model's normalised residuals under several parameter sets.

    Parameters
    ----------
    model : GreyBoxModel
        The model; stepped as in `model_step`.
    lanes : int
        Parameter sets side by side: `LANES` or `MOST_LANES`.

    Returns
    -------
    callable
        With the arguments of `estimation.fits.greybox.side_by_side_loops.residuals_side_by_side` and so many parameter
        rows; for a model that allows gaps, those of `estimation.fits.greybox.gap_loops.residuals_across_gaps`.
    """
    loop = residuals_across_gaps if model.jump else residuals_side_by_side
    takes = signature_of(loop, lanes=lanes, outputs=len(model.outputs), drives=len(model.drives))
    entries, made_of = {loop.__name__: takes}, (model, lanes, native_width())
    name = f"{'gaps' if model.jump else 'residuals'}_{model.name}_{lanes}"
    return getattr(load_native(name, lambda: _source(model, lanes), entries, made_of), loop.__name__)


@cache
def _model_source(model: GreyBoxModel) -> tuple[dict[str, str], list[str], int]:
    """Return the lines of a model, the names of its numbers in memory, and the count of states; alike for any lanes."""
    names, drives = parameter_names(model.parameters), range(len(model.drives))
    p = parameter_symbols(model.parameters)
    begun = {f"x{i}": as_expression(value) for i, value in enumerate(model.initial(p))}
    states = [symbol(name) for name in begun]
    starts = [symbol(f"base{i}") + symbol("j") * symbol(f"rise{i}") for i in drives]
    ends = [start + symbol(f"rise{i}") for i, start in zip(drives, starts, strict=True)]
    moved = model_step(model, states, p, list(zip(starts, ends, strict=True)))
    shown = {f"y{i}": as_expression(value) for i, value in enumerate(model.observe(tuple(states)))}
    jumps = states[: len(model.jump)]
    opened = _named_slopes("f", jacobian(moved[: len(jumps)], jumps))
    seen = _named_slopes("g", jacobian([*shown.values()], jumps))
    moving = [*begun, *(f"base{i}" for i in drives), *(f"rise{i}" for i in drives)]
    settled, stepped = hoisted(
        simplified({**dict(zip(begun, moved, strict=True)), **opened}, {*names, "h", "share"}), {*moving, "j"}, "c"
    )
    every = [*moving, *shown, "h", *names, *settled, "share", *opened, *seen]
    lines = {
        "begin": lines_source("begin", begun),
        "settle": lines_source("settle", settled),
        "step": packed_source("step", fused({name: stepped[name] for name in begun})),
        "show": lines_source("show", {**shown, **seen}),
    }
    if jumps:
        lines["open_step"] = packed_source("open_step", fused(stepped))
    return lines, every, len(begun)


def _named_slopes(letter: str, slopes: list[list[Expression]]) -> dict[str, Expression]:
    """Return slopes by the names of their places in memory, row by row."""
    return {f"{letter}{i}_{m}": slope for i, row in enumerate(slopes) for m, slope in enumerate(row)}


def _source(model: GreyBoxModel, lanes: int) -> str:
    """Write the kernel."""
    lines, every, width = _model_source(model)
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
    parts, loop = [place_rows, place_shared, place_beginning, set_pace, drive, absorb, close], residuals_side_by_side
    if model.jump:
        sizes |= {
            "JUMP": model.jump,
            "JUMPS": len(model.jump),
            "SETTLED": SETTLED,
            "SLOPES": lanes * every.index("f0_0"),
        }
        parts, loop = [*parts, carry_each, correct_each], residuals_across_gaps
    return kernel_text(
        f"residuals of the {model.name} model, {lanes} parameter sets side by side",
        operations_source(lines, {each: lanes * i for i, each in enumerate(every)}, vector),
        functions_text(*parts, constants=sizes, inlined=True),
        functions_text(loop),
    )
