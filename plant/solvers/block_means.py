"""Block means of a channel of a plant, for several runs side by side, in one pass over their states."""

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any, TypeAlias

import numpy as np

from plant.arrays import Array
from plant.compiled.expression import as_expression, symbol
from plant.compiled.functions import Scalar
from plant.compiled.hoist import hoisted
from plant.compiled.native.load import load_native
from plant.compiled.native.machine import native_width
from plant.compiled.native.signature import signature_of
from plant.compiled.paste import functions_text, kernel_text
from plant.compiled.simplify import fused, simplified
from plant.compiled.source import lines_source, operations_source
from plant.solvers.block_means_loop import average_blocks
from plant.solvers.fixed_step_loops import place_rows
from plant.solvers.steps import Parameters, parameter_names, parameter_symbols

LANES = 8
"""Number of runs side by side, as many as fit in a 512-bit vector register."""

Observe: TypeAlias = Callable[[Any, Any], Mapping[str, Scalar]]
"""``observe(state, parameters)``: the channels that a bench could measure."""


def block_means(
    observe: Observe, channel: str, states: Array, parameters: Array, block: int, parameter_class: type[Parameters]
) -> Array:
    """Return the means of a channel of runs over whole blocks.

    Parameters
    ----------
    observe : callable
        ``observe(state, parameters)``, written for symbols.
    channel : str
        One of the channels of `observe`.
    states : ndarray, shape (n, states, runs)
        States at the samples [SI].
    parameters : ndarray, shape (1 or n, runs, parameters)
        Parameter rows, each valid at its sample.
    block : int
        Samples per block.
    parameter_class : type
        Class of the parameter rows, field by field.

    Returns
    -------
    ndarray, shape (n // block, runs)
        The means [the channel's unit]; an incomplete block at the end is dropped.
    """
    runs = states.shape[2]
    means = np.empty((len(states) // block, runs))
    run = _compile(observe, channel, states.shape[1], parameter_class)
    for first in range(0, runs, LANES):
        some = range(first, min(first + LANES, runs))
        filled = [*some, *[first] * (LANES - len(some))]
        rows = np.ascontiguousarray(parameters) if runs == LANES else np.take(parameters, filled, axis=1)
        run(states[..., some.start : some.stop], rows, block, means[:, some.start : some.stop])
    return means


@cache
def _compile(observe: Observe, channel: str, width: int, parameter_class: type[Parameters]) -> Callable[..., None]:
    made_of = observe, channel, width, parameter_class, native_width()
    takes = signature_of(average_blocks, lanes=LANES, states=width)
    name = f"{channel}_means_{LANES}"
    return load_native(name, lambda: _text(*made_of[:4]), {"average_blocks": takes}, made_of).average_blocks


def _text(observe: Observe, channel: str, width: int, parameter_class: type[Parameters]) -> str:
    """Write the kernel."""
    names, states = parameter_names(parameter_class), [f"x{i}" for i in range(width)]
    seen = observe(tuple(symbol(one) for one in states), parameter_symbols(parameter_class))[channel]
    fixed, shown = hoisted(simplified({"y0": as_expression(seen)}, set(names)), set(states), "c")
    every = [*states, "y0", *names, *fixed]
    vector = min(LANES, native_width())
    lines = {"settle": lines_source("settle", fixed), "show": lines_source("show", fused(shown))}
    sizes = {"LANES": LANES, "VECTOR": vector, "WIDTH": width, "COLUMNS": len(names), "NUMBERS": LANES * len(every)}
    return kernel_text(
        f"means over blocks of {channel}, {LANES} runs side by side",
        operations_source(lines, {one: LANES * i for i, one in enumerate(every)}, vector),
        functions_text(place_rows, constants=sizes, inlined=True),
        functions_text(average_blocks),
    )
