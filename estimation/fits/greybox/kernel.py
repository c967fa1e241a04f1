"""Kernels that predict a log by a grey-box model: the model's step and its slopes, pasted to the loop along the log.

The model's step is traced once, and its derivatives by state and unknown parameters are written beside it.
"""

from collections.abc import Callable, Sequence
from functools import cache
from itertools import chain
from types import SimpleNamespace
from typing import Any, TypeAlias

from estimation.arrays import Array
from estimation.engine.parts import function_source, places
from estimation.fits.greybox.loops import RUNAWAY, SETTLED, STRAIGHT, absorb, carry, correct, run
from estimation.models.greybox import GreyBoxModel
from plant.compiled.expression import ONE, ZERO, Expression, as_expression, jacobian, symbol, unary
from plant.compiled.functions import Scalar
from plant.compiled.hoist import hoisted
from plant.compiled.native.load import load_native
from plant.compiled.native.signature import signature_of
from plant.compiled.paste import functions_text, kernel_text
from plant.solvers.steps import parameter_names, parameter_symbols, ros2_step, sdirk2_step

Kernel: TypeAlias = Callable[..., tuple[float, Array, Array]]
"""See `estimation.fits.greybox.loops.run`, without its kernel."""


@cache
def compile_kernel(model: GreyBoxModel) -> Kernel:
    """Generate the kernel that sums up a model's misfit over a log.

    Returns
    -------
    callable
        With the arguments of `estimation.fits.greybox.loops.run`. Its steps are ROS2, for a stiff model SDIRK2: second
        order and L-stable.
    """
    takes = signature_of(run, unknowns=len(model.unknowns), outputs=len(model.outputs), channels=len(model.drives))
    return load_native(f"fit_{model.name}", lambda: _source(model), {"run": takes}, model).run


def _source(model: GreyBoxModel) -> str:
    """Write the kernel."""
    sizes, unknowns, jumps = dict(model.linear), range(len(model.unknowns)), range(len(model.jump))
    theta = [symbol(f"theta{j}") for j in unknowns]
    fitted = {
        name: t * sizes[name] if name in sizes else unary("exp", t)
        for name, t in zip(model.unknowns, theta, strict=True)
    }
    p = SimpleNamespace(**{**vars(parameter_symbols(model.parameters)), **fitted})
    begun = [as_expression(value) for value in model.initial(p)]
    states = range(len(begun))
    state = [symbol(f"x{i}") for i in states]
    names = [(f"x{i}", *(f"s{i}_{j}" for j in unknowns), *(f"f{i}_{m}" for m in jumps)) for i in states]
    point = places("point", chain.from_iterable(names))
    data = {f"{when}{i}": f"{when}[{i}]" for when in ("before", "after") for i in range(len(model.drives))}
    moved = _rows(
        model_step(model, state, p, [_drive_over_step(i) for i in range(len(model.drives))]), state, theta, len(jumps)
    )
    varying = {*point, *data, "start", "end", "h", "share"}
    settled, stepped = hoisted(dict(zip(point, moved, strict=True)), varying, "c")
    shown = _rows([as_expression(value) for value in model.observe(tuple(state))], state, theta, len(jumps))
    columns = len(names[0])
    seen = {f"shown[{k // columns}, {k % columns}]": value for k, value in enumerate(shown)}
    rows = places("parameters", parameter_names(model.parameters)) | places("theta", [f"theta{j}" for j in unknowns])
    reads = point | data | places("fixed", settled) | {"share": "0.0"}
    begin = dict(zip(point, _rows(begun, [], theta, len(jumps)), strict=True))
    counts = {"WIDTH": len(states), "UNKNOWNS": len(unknowns), "OUTPUTS": len(model.outputs), "JUMPS": len(jumps)}
    settings = {"JUMP": model.jump, "RUNAWAY": RUNAWAY, "SETTLED": SETTLED, "STRAIGHT": STRAIGHT}
    return kernel_text(
        f"misfit of the {model.name} model, with its sensitivities",
        function_source("settle", "theta, parameters", rows, settled),
        function_source("begin", "theta, parameters", rows, begin),
        function_source("step", "point, fixed, before, after, start, end, h", reads, stepped),
        function_source("observe", "point, shown", point, seen, {place: place for place in seen}),
        f"load = loading({len(point)})",
        functions_text(absorb, constants=counts | settings, inlined=True),
        functions_text(carry, correct, run),
    )


def model_step(
    model: GreyBoxModel,
    state: Sequence[Expression],
    p: SimpleNamespace,
    drives: Sequence[tuple[Expression, Expression]],
) -> list[Expression]:
    """Return the state after one step of length ``h`` [SI]; the scheme's input is the elapsed share of the step.

    Parameters
    ----------
    drives : sequence of tuple
        Each drive at the step's start and end [SI].
    """
    h = symbol("h")

    def rates(now: Any, share: Scalar, parameters: Any) -> tuple[Scalar, ...]:
        return tuple(as_expression(rate) for rate in model.rates(now, (*drives, h), parameters, share))

    stepped = (sdirk2_step if model.stiff else ros2_step)(rates)
    return [as_expression(value) for value in stepped(tuple(state), (symbol("share"), ONE), p, h)]


def _drive_over_step(drive: int) -> tuple[Expression, Expression]:
    """Return a drive at the start and the end of a step."""
    before = symbol(f"before{drive}")
    rise = symbol(f"after{drive}") - before
    return before + symbol("start") * rise, before + symbol("end") * rise


def _rows(
    values: Sequence[Expression], state: Sequence[Expression], theta: Sequence[Expression], jumps: int
) -> list[Expression]:
    """Return each value, its derivatives by the unknowns (chain rule, ``S' = F S + G``), and those by the state."""
    by_state, by_theta = jacobian(values, state), jacobian(values, theta)
    outputs: list[Expression] = []
    for value, through, slopes in zip(values, by_state, by_theta, strict=True):
        outputs.append(value)
        for j, slope in enumerate(slopes):
            outputs.append(sum((by * symbol(f"s{m}_{j}") for m, by in enumerate(through)), start=slope))
        outputs += (through or [ZERO] * jumps)[:jumps]
    return outputs
