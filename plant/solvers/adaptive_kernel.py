"""The kernel of error-controlled steps, compiled from a plant's readable rates.

The scheme is RODAS3: four stages on three evaluations of the rates, third order, L-stable, with an embedded second
order (Sandu et al. 1997, Atmospheric Environment 31, 3459). Samples within a step lie on the cubic through states and
rates at both ends. A drive is linear between samples; a step spans several samples if they lie on one line.
"""

from collections.abc import Callable, Sequence
from functools import cache
from typing import TypeAlias

from plant.arrays import Array
from plant.compiled.elimination import eliminated_jacobian
from plant.compiled.expression import ONE, ZERO, Expression, as_expression, symbol
from plant.compiled.functions import Scalar
from plant.compiled.hoist import hoisted
from plant.compiled.native.load import load_native
from plant.compiled.native.machine import native_width
from plant.compiled.native.signature import signature_of
from plant.compiled.paste import functions_text, kernel_text
from plant.compiled.simplify import fused, share_ratios, simplified
from plant.compiled.source import lines_source, operations_source
from plant.solvers.adaptive_loop import INLINED_LOOPS, NEARLY, TINY, run_controlled
from plant.solvers.drive_pieces import ROUNDEST, parabolic_piece
from plant.solvers.steps import Derivative, Parameters, State, parameter_names, parameter_symbols, solve_linear

Kernel: TypeAlias = Callable[[Array, Array, Array, float, Array, float, float, float, float, Array], None]
"""``run(starts, speed, parameter rows, sample time, weights, bend, bulge, longest, shortest, states)`` fills states."""


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
        Motor speed at the start and at the end of the step, and its increase over the step at its initial rate [rad/s].
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
    last = derivative(nearly, end, p)
    u4 = solve_linear(
        matrix, [f + scale * (a - b - 8.0 / 3.0 * c) for f, a, b, c in zip(last, u1, u2, u3, strict=True)]
    )
    return [[as_expression(u) for u in stage] for stage in (u1, u2, u3, u4)]


_SHARED = ("u_start", "u_end", "u_rise", "h", "pace")
"""Motor speed at a step's start and end and its rise at the initial rate [rad/s]; this step and the previous one
[s]."""


def _named(letter: str, values: Sequence[Expression]) -> dict[str, Expression]:
    return {f"{letter}{i}": value for i, value in enumerate(values)}


def _outputs(derivative: Derivative, width: int, p: object) -> dict[str, Expression]:
    """Return the new states ``n``, the rates at the start ``r`` and the mean squared error of a step."""
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


def _interpolated_state(width: int) -> dict[str, Expression]:
    """Return the state ``y`` at a fraction ``j`` of the previous step: the cubic through states and rates at both."""
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
    name: str, derivative: Derivative, width: int, parameter_class: type[Parameters], lanes: int
) -> Kernel:
    """Generate the kernel that runs a plant along a drive in error-controlled steps.

    Parameters
    ----------
    name : str
        Name of the kernel, for its file's name.
    derivative : callable
        ``derivative(state, speed, parameters)``, written for symbols.
    width : int
        Number of states.
    parameter_class : type
        Class of the parameter rows, field by field.
    lanes : int
        Number of trajectories side by side.

    Returns
    -------
    callable
        ``run(starts (states, lanes), speed (n,) [rad/s], parameters (1 or n, lanes, parameters), sample time [s],
        weights (states,), bend [rad/s], bulge, longest and shortest step [samples], states (n, states, up to lanes))``.
    """
    made_of = name, derivative, width, parameter_class, lanes
    takes = signature_of(run_controlled, lanes=lanes, states=width)
    entries = {"run_controlled": takes}
    return load_native(f"{name}_adaptive_{lanes}", lambda: _text(*made_of), entries, made_of).run_controlled


@cache
def _lines(derivative: Derivative, width: int, parameter_class: type[Parameters]) -> tuple[dict[str, str], list[str]]:
    """Return the plant's straight-line source, and the constants that its functions share; the same for any lanes."""
    names = parameter_names(parameter_class)
    outputs = _outputs(derivative, width, parameter_symbols(parameter_class))
    outputs = simplified(share_ratios(outputs), set(names))
    moving = {f"{letter}{i}" for letter in "xw" for i in range(width)} | {*_SHARED}
    fixed, stages = hoisted(outputs, moving, "c")
    lines = {
        "settle": lines_source("settle", fixed),
        "stages": lines_source("stages", fused(stages)),
        "between": lines_source("between", fused(_interpolated_state(width))),
    }
    return lines, [*fixed]


def _text(name: str, derivative: Derivative, width: int, parameter_class: type[Parameters], lanes: int) -> str:
    """Write the kernel."""
    lines, fixed = _lines(derivative, width, parameter_class)
    names, span = parameter_names(parameter_class), range(width)
    parts = [[f"{letter}{i}" for i in span] for letter in "xnrosyw"]
    parts += [["error"], [*_SHARED], [*names], fixed]
    every = [name for part in parts for name in part]
    slots = {name: lanes * i for i, name in enumerate(every)}
    vector = min(lanes, native_width())
    sizes = {"LANES": lanes, "VECTOR": vector, "WIDTH": width, "COLUMNS": len(names), "NUMBERS": lanes * len(every)}
    parts = (
        operations_source(lines, slots, vector) + f"\nmove = moving({lanes})",
        functions_text(
            *INLINED_LOOPS,
            constants={
                **sizes,
                "TINY": TINY,
                "NEARLY": NEARLY,
                "ROUNDEST": ROUNDEST,
            },
            inlined=True,
        ),
        functions_text(parabolic_piece, run_controlled),
    )
    title = f"trajectories of the {name} plant in steps of controlled error, {lanes} side by side"
    return kernel_text(title, *parts)
