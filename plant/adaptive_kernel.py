"""The kernel of error-controlled steps, compiled from a plant's readable rates.

The scheme is RODAS3: four stages on three evaluations of the rates, third order, L-stable, with an embedded second
order (Sandu et al. 1997, Atmospheric Environment 31, 3459). Samples within a step lie on the cubic through states and
rates at both ends. A drive is linear between samples; a step spans several of them where they stand on one line.
"""

from collections.abc import Callable, Sequence
from dataclasses import fields
from functools import cache
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from plant.compiled.elimination import eliminated_jacobian
from plant.compiled.expression import ONE, ZERO, Expression, as_expression, symbol
from plant.compiled.functions import Scalar
from plant.compiled.hoist import hoisted
from plant.compiled.intrinsics import native_width
from plant.compiled.kernel_file import load_kernel
from plant.compiled.simplify import fused, share_ratios, simplified
from plant.compiled.source import INTRINSICS, lines_source
from plant.eha import EhaParameters
from plant.integrate import Derivative, State, parameter_symbols, solve_linear

Array: TypeAlias = NDArray[np.float64]

Kernel: TypeAlias = Callable[[Array, Array, Array, float, Array, float, float, float, Array], None]
"""``run(starts, speed, parameter rows, sample time, weights, bend, longest, shortest, states)``, which fills states."""


def rodas3_stages(
    derivative: Derivative, state: State, speeds: tuple[Scalar, Scalar, Scalar], p: object, h: Scalar
) -> list[list[Expression]]:
    """Return the four stages of a RODAS3 step, in the variables of Hairer and Wanner (Stiff ODEs, equation IV.7.25).

    Parameters
    ----------
    derivative : callable
        ``derivative(state, speed, parameters)``.
    state : tuple of Expression
        State at the start [any unit].
    speeds : tuple of Expression
        Motor speed at the start and at the end of the step, and what it would gain at its first rate [rad/s].
    p : namespace of Expression
        The parameters.
    h : Expression
        Step size [s].

    Returns
    -------
    list of list of Expression
        Stages u_1 to u_4, each in the units of the states. The new state is ``x + 2 u_1 + u_3 + u_4``, its error u_4.
    """
    start, end, rise = speeds
    rates = derivative(state, start, p)
    slopes = eliminated_jacobian([as_expression(rate) for rate in rates], [*state, start])
    drift = [row[-1] * rise for row in slopes]
    scale = ONE / as_expression(h)
    n = len(state)
    matrix = [[(2.0 * scale if i == j else ZERO) - slopes[i][j] for j in range(n)] for i in range(n)]
    u1 = solve_linear(matrix, [f + 0.5 * d for f, d in zip(rates, drift, strict=True)])
    u2 = solve_linear(matrix, [f + 4.0 * scale * a + 1.5 * d for f, a, d in zip(rates, u1, drift, strict=True)])
    ahead = tuple(x + 2.0 * a for x, a in zip(state, u1, strict=True))
    u3 = solve_linear(matrix, [f + scale * (a - b) for f, a, b in zip(derivative(ahead, end, p), u1, u2, strict=True)])
    nearly = tuple(x + c for x, c in zip(ahead, u3, strict=True))
    u4 = solve_linear(
        matrix,
        [
            f + scale * (a - b - 8.0 / 3.0 * c)
            for f, a, b, c in zip(derivative(nearly, end, p), u1, u2, u3, strict=True)
        ],
    )
    return [[as_expression(u) for u in stage] for stage in (u1, u2, u3, u4)]


_KERNEL = """# Generated: trajectories of the {name} plant in steps of controlled error, {lanes} side by side.

import math

import numpy as np

{intrinsics}

{settle}


{stages}


{between}


SLOTS = {slots}

settle_at = stepping(SLOTS, {vector}, settle)
stages_at = stepping(SLOTS, {vector}, stages)
between_at = stepping(SLOTS, {vector}, between)
move = moving({lanes})


@numba.njit(forceinline=True, error_model="numpy")
def keep(work, place, states, sample):
    count = states.shape[2]
    for i in range({width}):
        if count == {lanes}:
            move(work.ctypes.data + 8 * (place + {lanes} * i), states[sample, i].ctypes.data)
        else:
            for l in range(count):
                states[sample, i, l] = work[place + {lanes} * i + l]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def smooth(speed, parameters, begin, bend):
    n = speed.shape[0]
    end = begin + 1
    low, high = np.inf, -np.inf
    while end < n - 1:
        if parameters.shape[0] > 1 and not np.array_equal(parameters[end], parameters[begin]):
            break
        curvature = speed[end + 1] - 2.0 * speed[end] + speed[end - 1]
        lower, upper = min(low, curvature), max(high, curvature)
        length = end + 1 - begin
        if (upper - lower) * length * length > 16.0 * bend or max(-lower, upper) > {roundest} * bend:
            break
        low, high = lower, upper
        end += 1
    return end, (0.5 * (low + high) if end > begin + 1 else 0.0)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def run(initial, speed, parameters, sample_time, weights, bend, longest, shortest, states):
    n = states.shape[0]
    room = np.zeros({total} + 8)
    work = room[-room.ctypes.data % 64 // 8 :]  # a vector across two cache lines takes twice as long
    slots = work.ctypes.data
    work[:{block}] = initial.reshape({block})
    keep(work, 0, states, 0)
    for i in range({width}):
        work[{weights} + i * {lanes} : {weights} + (i + 1) * {lanes}] = weights[i]
    begin = end = 0
    start = reach = place = 0.0
    size, taken = longest, 1.0
    row = -1
    sample = 1
    while True:
        if place >= reach and end < n - 1:
            begin = end
            end, curvature = smooth(speed, parameters, begin, bend)
            place, reach = 0.0, float(end - begin)
            ramp = (speed[end] - speed[begin]) / reach
            lift = speed[begin] + curvature / 12.0
            if row < 0 or parameters.shape[0] > 1:
                row = min(begin, parameters.shape[0] - 1)
                for i in range(parameters.shape[2]):
                    for l in range({lanes}):
                        work[{known} + i * {lanes} + l] = parameters[row, l, i]
                for first in range(0, 8 * {lanes}, 8 * {vector}):
                    settle_at(slots + first, 0.0)
        left = reach - place
        size = min(size, longest)
        if size > 0.999999 * left:
            size = left if left > 0.0 else shortest
        elif size > 0.5 * left:
            size = 0.5 * left
        u_start = lift + place * (ramp - 0.5 * curvature * left)
        slope = ramp + curvature * (place - 0.5 * reach)
        u_rise = size * slope
        u_end = u_start + size * (slope + 0.5 * curvature * size)
        h = size * sample_time
        for l in range({lanes}):
            work[{shared} + l] = u_start
            work[{shared} + {lanes} + l] = u_end
            work[{shared} + 2 * {lanes} + l] = u_rise
            work[{shared} + 3 * {lanes} + l] = h
        for first in range(0, 8 * {lanes}, 8 * {vector}):
            stages_at(slots + first, 0.0)
        here = begin + place
        if sample < here - {tiny}:
            for l in range({lanes}):
                work[{shared} + 4 * {lanes} + l] = taken * sample_time
            while sample < here - {tiny}:
                for first in range(0, 8 * {lanes}, 8 * {vector}):
                    between_at(slots + first, (sample - start) / taken)
                keep(work, {seen}, states, sample)
                sample += 1
        if left <= 0.0:
            break
        error = 0.0
        for l in range({lanes}):
            error = error if error >= work[{errors} + l] else work[{errors} + l]
        if not error <= 1.0 and size > shortest:
            size = max(size * (0.5 if error < 64.0 else 0.25), shortest)
            continue
        start, taken = here, size
        place = reach if size == left else place + size
        for i in range({block}):
            work[{old} + i] = work[i]
            work[{old_rates} + i] = work[{rates} + i]
            work[i] = work[{new} + i]
        near = begin + int(place + 0.5)
        if abs(begin + place - near) < {tiny}:
            keep(work, 0, states, near)
            if sample == near:
                sample += 1
        if error < 1.2e-4:
            size *= 4.0
        elif error < 8e-3:
            size *= 2.0
        elif error < 0.03:
            size *= 1.6
        elif error < 0.13:
            size *= 1.25
        elif error > 0.5:
            size *= 0.9
        size = max(size, shortest)
"""


_SHARED = ("u_start", "u_end", "u_rise", "h", "pace")
"""Motor speed at a step's start and end and its rise at the first rate [rad/s], the step and the one before [s]."""


def _named(letter: str, values: Sequence[Expression]) -> dict[str, Expression]:
    return {f"{letter}{i}": value for i, value in enumerate(values)}


def _outputs(derivative: Derivative, width: int, p: object) -> dict[str, Expression]:
    """Return new states ``n``, rates at the start ``r`` and the mean squared error of a step."""
    state = tuple(symbol(f"x{i}") for i in range(width))
    u1, _, u3, u4 = rodas3_stages(
        derivative, state, (symbol("u_start"), symbol("u_end"), symbol("u_rise")), p, symbol("h")
    )
    error: Expression = ZERO
    for i, u in enumerate(u4):
        weighted = u * symbol(f"w{i}")
        error = error + weighted * weighted
    outputs = _named("n", [x + 2.0 * a + c + d for x, a, c, d in zip(state, u1, u3, u4, strict=True)])
    outputs |= _named("r", [as_expression(rate) for rate in derivative(state, symbol("u_start"), p)])
    return outputs | {"error": error * (1.0 / width)}


def _between(width: int) -> dict[str, Expression]:
    """Return the state ``y`` at a share ``j`` of the step before: the cubic through states and rates at both ends."""
    part, pace = symbol("j"), symbol("pace")
    result: dict[str, Expression] = {}
    for i in range(width):
        old = symbol(f"o{i}")
        rise = symbol(f"x{i}") - old
        first, last = symbol(f"s{i}") * pace, symbol(f"r{i}") * pace
        curve = 3.0 * rise - 2.0 * first - last + part * (first + last - 2.0 * rise)
        result[f"y{i}"] = old + part * (first + part * curve)
    return result


@cache
def compile_adaptive(
    name: str, derivative: Derivative, width: int, parameter_class: type[EhaParameters], lanes: int
) -> Kernel:
    """Generate the kernel that runs a plant along a drive in steps of controlled error.

    Parameters
    ----------
    name : str
        What the kernel is, for its file's name.
    derivative : callable
        ``derivative(state, speed, parameters)``, written for symbols.
    width : int
        Count of states.
    parameter_class : type
        What the parameter rows hold, field by field.
    lanes : int
        Trajectories side by side.

    Returns
    -------
    callable
        ``run(starts (states, lanes), speed (n,) [rad/s], parameters (1 or n, lanes, parameters), sample time [s],
        weights (states,), bend [rad/s], longest and shortest step [samples], states (n, states, up to lanes))``.
    """
    names = [field.name for field in fields(parameter_class)]
    outputs = _outputs(derivative, width, parameter_symbols(parameter_class))
    outputs = simplified(share_ratios(outputs), set(names))
    moving = {f"{letter}{i}" for letter in "xw" for i in range(width)} | {*_SHARED}
    fixed, stages = hoisted(outputs, moving, "c")
    span = range(width)
    parts = [[f"{letter}{i}" for i in span] for letter in "xnrosyw"]
    parts += [["error"], [*_SHARED], names, [*fixed]]
    every = [name for part in parts for name in part]
    slots = {name: lanes * i for i, name in enumerate(every)}
    source = _KERNEL.format(
        name=name,
        intrinsics=INTRINSICS,
        settle=lines_source("settle", fixed),
        stages=lines_source("stages", fused(stages)),
        between=lines_source("between", fused(_between(width))),
        slots=slots,
        vector=min(lanes, native_width()),
        width=width,
        lanes=lanes,
        block=width * lanes,
        new=slots["n0"],
        rates=slots["r0"],
        old=slots["o0"],
        old_rates=slots["s0"],
        seen=slots["y0"],
        weights=slots["w0"],
        errors=slots["error"],
        shared=slots[_SHARED[0]],
        known=slots[names[0]],
        total=lanes * len(every),
        tiny="1e-6",
        roundest="100.0",
    )
    return load_kernel(f"{name}_adaptive_{lanes}", source).run
