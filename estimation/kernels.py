"""Compiled filters: a rule on a model for a set of channels, for one filter or for 32 side by side.

What a filter carries, and what it computes from, stands in one flat buffer: all filters' values of one symbol, then
all of the next. A step loads vectors from there, works through the rule's lines and stores the results. Both kernels
compute in plain IEEE arithmetic, fused where the lines say so: a filter gives the same bits alone and in a batch.
"""

from functools import cache
from types import ModuleType

from estimation.algebra import Rule
from estimation.layout import Halves, halves_of, layout
from estimation.model import ProcessModel
from plant.compiled.expression import ordered
from plant.compiled.intrinsics import ROWS, native_width
from plant.compiled.kernel_file import load_kernel
from plant.compiled.source import INTRINSICS, lines_source

LANES = 32
"""Filters side by side: as many as keep a vector unit busy; fewer leave it waiting, more do not help."""

AHEAD = 512
"""Bytes of each log that are fetched ahead of their use: the memory answers within a few samples of all lanes."""

FLUSH = 8
"""Samples between looks at the running product of innovation variances: it cannot overflow that fast."""

LARGE = 1e60
"""A product beyond this goes into the logarithm, and starts again at 1."""

_STEPS = """# Generated: {title}.

import math

{intrinsics}

{prepare}


{predict}


{update}


SLOTS = {slots}

prepare_at = stepping(SLOTS, {width}, prepare)
predict_at = stepping(SLOTS, {width}, predict)
update_at = stepping(SLOTS, {width}, update)
both_at = stepping(SLOTS, {width}, predict, update)
move = moving({width})


@numba.njit(cache=True, nogil=True, error_model="numpy")
def steps(
    work, drives, measured, begin, first, end, substeps, every, track, track_variance, logs, residuals, variances
):
    means, spreads, slots = track.ctypes.data, track_variance.ctypes.data, work.ctypes.data
    row = (begin + first + every - 1) // every
    for i in range(first, end):
        k = begin + i
        kept = k == row * every
        for lane in range(0, 8 * {lanes}, 8 * {width}):
            here = slots + lane
{copies}
            if k == 0:
                prepare_at(here, 0.0)
                update_at(here, 0.0)
            else:
                for j in range(substeps - 1):
                    predict_at(here, float(j))
                both_at(here, float(substeps - 1))
            if kept:
{kept}
        if kept:
            row += 1
        if k < residuals.shape[0]:
{seen}
        if k % {flush} == {flush} - 1:
            for lane in range({lanes}):
{flushed}
"""

_RUN = """

@numba.njit(forceinline=True, error_model="numpy")
def lay_side_by_side(places, begin, width, rows):
    for lane in range(0, 8 * {lanes}, 64):
        for i in range(0, {rows} * width, 8):
            transpose(
                places.ctypes.data + lane, 8 * (begin * width + i), {ahead}, rows + 8 * {lanes} * i + lane, 8 * {lanes}
            )


@numba.njit(cache=True, nogil=True, error_model="numpy")
def run(work, drives, measured, rows, samples, substeps, every, track, track_variance, logs, residuals, variances):
    drive, sample = rows.ctypes.data, rows.ctypes.data + 8 * {lanes} * {rows} * {drives}
    for begin in range(0, samples, {rows}):
        start = min(begin, samples - {rows})
        lay_side_by_side(drives, start, {drives}, drive)
        lay_side_by_side(measured, start, {channels}, sample)
        steps(
            work, drive, sample, start, begin - start, {rows}, substeps, every,
            track, track_variance, logs, residuals, variances
        )
"""


def _block(lines: list[str], indent: int) -> str:
    return "\n".join(" " * indent + line for line in lines or ["pass"])


def _width(halves: Halves, lanes: int) -> int:
    """Return how many filters a step takes: a vector of them, or two where roots would leave the processor waiting."""
    waits = any(item.operation == "sqrt" for item in ordered(halves.predict.values()))
    return min(lanes, (2 if waits else 1) * native_width())


def kernel_source(rule: Rule, model: ProcessModel, channels: tuple[str, ...], lanes: int) -> str:
    """Write the kernel that runs so many filters side by side.

    Parameters
    ----------
    rule : Rule
        The filter.
    model : ProcessModel
        The model.
    channels : tuple of str
        Measured channels.
    lanes : int
        One, or `LANES`.

    Returns
    -------
    str
        Source of a module with ``steps``, which filters logs that lie side by side, and for several lanes ``run``,
        which lays separate logs side by side, `ROWS` samples at a time.
    """
    halves, places = halves_of(rule, model, channels), layout(rule, model, channels)
    n, m, d = range(model.width), range(len(channels)), range(len(model.drives))
    seen = [f"{x}{c}" for c in m for x in "es"] if lanes == 1 else []
    data = [*(f"a{i}" for i in d), *(f"b{i}" for i in d), *(f"y{c}" for c in m)]
    names = (*places.carried, *places.rows, *halves.constants, *data, *seen)
    slots = {name: lanes * i for i, name in enumerate(names)}

    def at(name: str) -> str:
        return f"here + {8 * slots[name]}"

    copies = [f"move({at(f'b{i}')}, {at(f'a{i}')})" for i in d]
    copies += [f"move(drives + 8 * {lanes} * ({len(d)} * i + {c}) + lane, {at(f'b{c}')})" for c in d]
    copies += [f"move(measured + 8 * {lanes} * ({len(m)} * i + {c}) + lane, {at(f'y{c}')})" for c in m]
    kept = [f"move({at(f'z{i}')}, means + 8 * {lanes} * ({len(n)} * row + {i}) + lane)" for i in n]
    kept += [f"move({at(f'P{i}_{i}')}, spreads + 8 * {lanes} * ({len(n)} * row + {i}) + lane)" for i in n]
    flushed: list[str] = []
    for c in m:
        product = f"work[{slots[f'product{c}']} + lane]"
        flushed += [f"if {product} > {LARGE}:", f"    logs[{c}, lane] += math.log({product})", f"    {product} = 1.0"]
    found = {f"e{c}": f"residuals[k, {c}]" for c in m} | {f"s{c}": f"variances[k, {c}]" for c in m}
    return (_STEPS + (_RUN if lanes > 1 else "")).format(
        title=f"{rule.name} on the {model.name} form, {lanes} side by side",
        intrinsics=INTRINSICS,
        prepare=lines_source("prepare", halves.constants),
        predict=lines_source("predict", halves.predict),
        update=lines_source("update", halves.update),
        slots=slots,
        lanes=lanes,
        width=_width(halves, lanes),
        rows=ROWS,
        ahead=AHEAD,
        flush=FLUSH,
        drives=len(d),
        channels=len(m),
        copies=_block(copies, 12),
        kept=_block(kept, 16),
        seen=_block([f"{found[name]} = work[{slots[name]}]" for name in seen], 12),
        flushed=_block(flushed, 16),
    )


@cache
def compile_kernel(rule: Rule, model: ProcessModel, channels: tuple[str, ...], lanes: int = 1) -> ModuleType:
    """Generate and load the kernel that runs so many filters side by side.

    Parameters
    ----------
    rule : Rule
        The filter.
    model : ProcessModel
        The model.
    channels : tuple of str
        Measured channels.
    lanes : int
        One, or `LANES`.

    Returns
    -------
    ModuleType
        The kernel; `estimation.compiled` and `estimation.batch` call it.
    """
    return load_kernel(f"{rule.name}_{model.name}_{lanes}", kernel_source(rule, model, channels, lanes))
