"""Compiles a user's equations with their exact sensitivities."""

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any, TypeAlias

from estimation.arrays import Array
from estimation.engine.parts import function_source, places
from estimation.equations.definition import Equations
from estimation.equations.loops import run
from estimation.equations.trace import Named, grouped, traced
from plant.compiled.expression import Expression, jacobian, symbol
from plant.compiled.functions import Scalar
from plant.compiled.hoist import hoisted
from plant.compiled.native.load import load_native
from plant.compiled.native.signature import signature_of
from plant.compiled.paste import functions_text, kernel_text
from plant.solvers.steps import rk4_step, ros2_step

Run: TypeAlias = Callable[[Array, Array, Array, float, int, Array, Array], None]
"""``run(values, known, inputs, sample_time, substeps, predicted, slopes)``, see `estimation.equations.loops.run`."""

SCHEMES = {"rk4": rk4_step, "ros2": ros2_step}
"""One explicit and of fourth order; one L-stable and of second order, for stiff equations."""


@lru_cache(maxsize=32)
def compile_equations(equations: Equations, scheme: str) -> Run:
    """Generate the kernel that predicts the outputs, with their derivatives by all unknowns.

    Parameters
    ----------
    scheme : str
        One of `SCHEMES`.

    Returns
    -------
    callable
        A function with the arguments of `estimation.equations.loops.run`.

    Raises
    ------
    HydrostateError
        If the user's functions cannot be traced, or return what does not fit.
    """
    takes = signature_of(
        run,
        unknowns=len(equations.parameters) + len(equations.free),
        inputs=max(len(equations.inputs), 1),
        outputs=len(equations.outputs),
    )
    return load_native("equations", _source(equations, scheme), {"run": takes}).run


def traceable(equations: Equations) -> None:
    """Call a user's functions with symbols once, to check them before there is a log.

    Raises
    ------
    HydrostateError
        If they cannot be traced, or return what does not fit.
    """
    own = _Symbols(equations)
    _next_states(equations, "rk4", own)
    _output_expressions(equations, own)


class _Symbols:
    """Symbols of a model's numbers, with the array elements from which a kernel reads them."""

    def __init__(self, model: Equations) -> None:
        unknown = [f"v{j}" for j in range(len(model.parameters) + len(model.free))]
        begun = [name for name in model.states if name not in model.free]
        held = [f"k{j}" for j in range(len(model.known) + len(begun))]
        self.places = places("values", unknown) | places("known", held)
        self.unknowns, known = [symbol(one) for one in unknown], [symbol(one) for one in held]
        fitted, given = len(model.parameters), len(model.known)
        self.parameters = Named(
            dict(zip(model.parameters, self.unknowns, strict=False)) | dict(zip(model.known, known, strict=False))
        )
        first = dict(zip(model.free, self.unknowns[fitted:], strict=True)) | dict(
            zip(begun, known[given:], strict=True)
        )
        self.first = [first[name] for name in model.states]
        self.states = [symbol(f"x{i}") for i in range(len(model.states))]


def _source(model: Equations, scheme: str) -> str:
    """Write the kernel."""
    own = _Symbols(model)
    columns = range(len(own.unknowns))
    point = places("point", [f"{s}{i}" for i in range(len(own.states)) for s in ("x", *(f"s{j}_" for j in columns))])
    data = {f"{when}{i}": f"{when}[{i}]" for when in ("before", "after") for i in range(len(model.inputs))}
    moved = _values_and_slopes(_next_states(model, scheme, own), own.states, own.unknowns)
    shown = _values_and_slopes(_output_expressions(model, own), own.states, own.unknowns)
    width = 1 + len(own.unknowns)
    seen = {f"shown[{k // width}, {k % width}]": value for k, value in enumerate(shown)}
    every = dict(zip(point, moved, strict=True)) | seen
    settled, rest = hoisted(every, {*point, *data, "start", "end", "h"}, "c")
    reads = point | data | places("fixed", settled)
    begin = dict(zip(point, _values_and_slopes(own.first, [], own.unknowns), strict=True))
    return kernel_text(
        "a user's equations, with their sensitivities",
        function_source("settle", "values, known", own.places, settled),
        function_source("begin", "values, known", own.places, begin),
        function_source("step", "point, fixed, before, after, start, end, h", reads, {one: rest[one] for one in point}),
        function_source(
            "observe", "point, fixed, after, shown", reads, {one: rest[one] for one in seen}, {one: one for one in seen}
        ),
        functions_text(run, constants={"UNKNOWNS": len(own.unknowns), "OUTPUTS": len(model.outputs)}),
    )


def _next_states(model: Equations, scheme: str, own: _Symbols) -> list[Expression]:
    """Return the states after a step."""
    ends = [_start_and_rise(i, held=name in model.held) for i, name in enumerate(model.inputs)]

    def rates(now: Any, share: Scalar, parameters: Named) -> tuple[Scalar, ...]:
        inputs = grouped("Inputs", tuple(model.inputs), [low + share * rise for low, rise in ends])
        state = grouped("State", tuple(model.states), now)
        return tuple(traced("derivative", model.derivative, tuple(model.states), state, inputs, parameters))

    return list(
        SCHEMES[scheme](rates)(tuple(own.states), (symbol("start"), symbol("end")), own.parameters, symbol("h"))
    )


def _start_and_rise(place: int, *, held: bool) -> tuple[Expression, Expression | float]:
    """Return an input at the earlier sample, and its increase up to the later one."""
    before = symbol(f"before{place}")
    return before, 0.0 if held else symbol(f"after{place}") - before


def _output_expressions(model: Equations, own: _Symbols) -> list[Expression]:
    if model.observe is None:
        return [own.states[list(model.states).index(name)] for name in model.outputs]
    inputs = grouped("Inputs", tuple(model.inputs), [symbol(f"after{i}") for i in range(len(model.inputs))])
    state = grouped("State", tuple(model.states), own.states)
    return traced("observe", model.observe, tuple(model.outputs), state, inputs, own.parameters)


def _values_and_slopes(
    values: Sequence[Expression], state: Sequence[Expression], unknowns: Sequence[Expression]
) -> list[Expression]:
    """Return each value and its derivatives by the unknowns (chain rule, ``S' = F S + G``)."""
    by_state, by_unknown = jacobian(values, state), jacobian(values, unknowns)
    outputs: list[Expression] = []
    for value, through, slopes in zip(values, by_state, by_unknown, strict=True):
        outputs.append(value)
        for j, slope in enumerate(slopes):
            outputs.append(sum((by * symbol(f"s{j}_{m}") for m, by in enumerate(through)), start=slope))
    return outputs
