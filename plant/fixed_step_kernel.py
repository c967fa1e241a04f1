"""Kernels of fixed steps written as straight lines of instructions: one run, or several runs side by side.

`plant.integrate.compile_trajectory` lets Numba compile the same step. Here factors are gathered, products are fused
with sums, choices are instructions instead of branches, and a lone run divides several numbers at a time
(`plant.compiled.pack`). As many runs as fit into the processor's vectors take little longer than one, and give the
same bits as one.
"""

from collections.abc import Callable
from dataclasses import fields
from functools import cache
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from plant.compiled.expression import as_expression, symbol
from plant.compiled.hoist import hoisted
from plant.compiled.intrinsics import native_width
from plant.compiled.kernel_file import load_kernel
from plant.compiled.pack import packed_source
from plant.compiled.simplify import fused, simplified
from plant.compiled.source import INTRINSICS, lines_source
from plant.integrate import StepFunction, parameter_symbols

Array: TypeAlias = NDArray[np.float64]

FixedStepRun: TypeAlias = Callable[[Array, Array, Array, float, int, Array], None]
"""``run(starts, drives, parameter rows, sample time, substeps, states)``, which fills states."""

_KERNEL = """# Generated: trajectories of the {name} plant in fixed steps, {lanes} side by side.

import math

import numpy as np

{intrinsics}

{settle}


{step}


SLOTS = {slots}

settle_at = stepping(SLOTS, {vector}, settle)
step_at = stepping(SLOTS, {vector}, step)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def run(initial, drive, parameters, sample_time, substeps, states):
    room = np.zeros({total} + 8)
    work = room[-room.ctypes.data % 64 // 8 :]  # a vector across two cache lines takes twice as long
    slots = work.ctypes.data
    work[:{block}] = initial.reshape({block})
    for l in range({lanes}):
        work[{pace} + l] = sample_time / substeps
        for i in range(parameters.shape[1]):
            work[{known} + i * {lanes} + l] = parameters[l, i]
    for first in range(0, 8 * {lanes}, 8 * {vector}):
        settle_at(slots + first, 0.0)
    n, _, count = states.shape
    for k in range(n):
        for i in range({width}):
            for l in range(count):
                states[k, i, l] = work[{lanes} * i + l]
        if k == n - 1:
            break
        for l in range({lanes}):
            work[{drive} + l] = drive[k, l]
            work[{rise} + l] = (drive[k + 1, l] - drive[k, l]) / substeps
        for j in range(substeps):
            for first in range(0, 8 * {lanes}, 8 * {vector}):
                step_at(slots + first, float(j))
"""


@cache
def compile_fixed_step(
    name: str, step: StepFunction, width: int, parameter_class: type[Any], lanes: int
) -> FixedStepRun:
    """Generate the kernel that runs a step function along drives, side by side.

    Parameters
    ----------
    name : str
        What the kernel is, for its file's name.
    step : callable
        ``step(state, drives, parameters, h)``, written for symbols.
    width : int
        Count of states.
    parameter_class : type
        What the parameter rows hold, field by field.
    lanes : int
        Runs side by side: 1 or 8.

    Returns
    -------
    callable
        ``run(starts (states, lanes), drives (n, lanes), parameters (lanes, parameters), sample time [s], substeps,
        states (n, states, up to lanes))``.
    """
    names = [field.name for field in fields(parameter_class)]
    state = tuple(symbol(f"x{i}") for i in range(width))
    start = symbol("drive") + symbol("j") * symbol("rise")
    result = step(state, (start, start + symbol("rise")), parameter_symbols(parameter_class), symbol("pace"))
    outputs = simplified({f"x{i}": as_expression(value) for i, value in enumerate(result)}, {*names, "pace"})
    fixed, lines = hoisted(outputs, {*(f"x{i}" for i in range(width)), "drive", "rise", "j"}, "c")
    every = [*(f"x{i}" for i in range(width)), "drive", "rise", "pace", *names, *fixed]
    slots = {each: lanes * i for i, each in enumerate(every)}
    source = _KERNEL.format(
        name=name,
        intrinsics=INTRINSICS,
        settle=lines_source("settle", fixed),
        step=packed_source("step", fused(lines)),
        slots=slots,
        vector=min(lanes, native_width()),
        width=width,
        lanes=lanes,
        block=width * lanes,
        drive=slots["drive"],
        rise=slots["rise"],
        pace=slots["pace"],
        known=slots[names[0]],
        total=lanes * len(every),
    )
    return load_kernel(f"{name}_fixed_step_{lanes}", source).run
