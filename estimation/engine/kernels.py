"""Compiled filters: a rule on a model for a set of channels, for one filter or for 32 side by side.

The values that a filter carries and uses are in one flat buffer: all filters' values of one symbol, then all of the
next. A step loads vectors from there, computes the rule's lines and stores the results. Both kernels compute in plain
IEEE arithmetic, fused only as the lines state: a filter gives the same bits alone and in a batch.
"""

from functools import cache

from estimation.engine import lanes as lanes_loop
from estimation.engine.lanes import flush, hold, keep, lay_side_by_side, run, steps, tally
from estimation.engine.layout import Halves, full_sample_update, halves_of, layout, step_at_sample, with_missing_counted
from estimation.engine.rule import Rule
from estimation.models.model import ProcessModel
from plant.compiled.expression import ordered
from plant.compiled.native.load import NativeKernel, load_native
from plant.compiled.native.machine import native_width
from plant.compiled.native.signature import signature
from plant.compiled.paste import functions_text, kernel_text
from plant.compiled.source import ROWS, Slot, lines_source, operations_source

LANES = 32
"""Filters side by side: enough to keep a vector unit busy; fewer leave it waiting, more do not help."""


def _width(halves: Halves, lanes: int) -> int:
    """Return the number of filters in a step: one processor vector, or two if square roots would stall it."""
    waits = any(item.operation == "sqrt" for item in ordered(halves.predict.values()))
    return min(lanes, (2 if waits else 1) * native_width())


def kernel_source(rule: Rule, model: ProcessModel, channels: tuple[str, ...], lanes: int) -> str:
    """Write the kernel that runs a number of filters side by side.

    Parameters
    ----------
    lanes : int
        One, or several vectors of the processor: `LANES`, or fewer for a small batch.

    Returns
    -------
    str
        Source of a module with ``steps``, which filters logs that lie side by side, and for several lanes ``run``,
        which lays separate logs side by side, `ROWS` samples at a time.
    """
    halves, places = halves_of(rule, model, channels), layout(rule, model, channels)
    d, m, width = len(model.drives), len(channels), _width(halves, lanes)
    seen = [f"{x}{c}" for c in range(m) for x in "es"] if lanes == 1 else []
    names = (*places.carried, *places.rows, *halves.constants, *(f"last{i}" for i in range(d)), *seen)
    slots: dict[str, Slot] = {name: lanes * i for i, name in enumerate(names)}
    data = [f"a{i}" for i in range(d)], [f"b{i}" for i in range(d)], [f"y{c}" for c in range(m)]
    slots |= {name: (k, lanes * i) for k, group in enumerate(data) for i, name in enumerate(group)}
    line = 8 * lanes
    sizes = {"LANES": lanes, "LINE": line, "LINES": len(names), "WIDTH": width}
    sizes |= {"STATES": model.width, "DRIVES": d, "CHANNELS": m, "LAST": line * names.index("last0")}
    sizes |= {x.upper(): lanes * names.index(f"{x}0") for x in ("count", "product")} | {"SEEN": len(names) - len(seen)}
    settings = {"FLUSH": lanes_loop.FLUSH, "LARGE": lanes_loop.LARGE, "AHEAD": lanes_loop.AHEAD, "ROWS": ROWS}
    update = with_missing_counted(halves.update)
    written = {"prepare": halves.constants, "predict": halves.predict, "update": update}
    written |= {"onward": step_at_sample(halves.predict), "whole": full_sample_update(update)}
    lines = {name: lines_source(name, outputs) for name, outputs in written.items()}
    parts = (
        operations_source(lines, slots, width),
        f"both_at = stepping(SLOTS, {width}, onward, whole)\nmove = moving({width})\n"
        f"complete_at = complete({width}, {m}, {line})",
        functions_text(hold, keep, flush, tally, constants={**sizes, **settings}, inlined=True),
        functions_text(steps),
        *([functions_text(lay_side_by_side, inlined=True), functions_text(run)] if lanes > 1 else []),
    )
    return kernel_text(f"{rule.name} on the {model.name} form, {lanes} side by side", *parts)


@cache
def compile_kernel(
    rule: Rule, model: ProcessModel, channels: tuple[str, ...], lanes: int = 1, *, separate: bool = True
) -> NativeKernel:
    """Generate and load the kernel that runs a number of filters side by side.

    Parameters
    ----------
    lanes : int
        One, or several vectors of the processor: `LANES`, or fewer for a small batch.
    separate : bool
        Whether several lanes filter separate logs, by ``run``; otherwise logs that already lie side by side, by
        ``steps``.

    Returns
    -------
    NativeKernel
        The kernel; `estimation.engine.runner` and `estimation.filters.batch` call it.
    """
    track = f"ndarray, shape (rows, {model.width}{f', {lanes}' if lanes > 1 else ''})"
    logs, seen = f"ndarray, shape ({len(channels)}, {lanes})", "ndarray, shape (samples, seen)"
    results = f"results : tuple ({'; '.join((track, track, logs, seen, seen))})"
    takes = {"steps": _STEPS, "run": _RUN.format(lanes=lanes)}
    entry = "run" if lanes > 1 and separate else "steps"  # code with two entry points would be compiled twice
    entries = {entry: signature(f"{takes[entry]}\n{results}")}
    made_of = rule, model, channels, lanes
    return load_native(f"{rule.name}_{model.name}_{lanes}", lambda: kernel_source(*made_of), entries, made_of)


_STEPS = """
work : ndarray, shape (numbers,)
drives, measured, begin, first, end, substeps, every : int
"""
"""Arguments of `estimation.engine.lanes.steps`, without its results."""

_RUN = """
work : ndarray, shape (numbers,)
drives, measured : ndarray of int, shape ({lanes},)
rows : ndarray, shape (channels, samples a time, {lanes})
samples, substeps, every : int
"""
"""Arguments of `estimation.engine.lanes.run`, without its results."""
