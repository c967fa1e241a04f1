"""Kernels that predict a log by a grey-box model and sum up the normal equations of its misfit, in one pass.

The model's step is traced once; its derivatives by state and unknown parameters are written beside it. Nothing as long
as the log is stored unless asked for: a log of ten million samples takes no more memory to fit than one of a thousand.
"""

from collections.abc import Callable, Iterable, Sequence
from functools import cache
from types import SimpleNamespace
from typing import Any, TypeAlias

from estimation.models.greybox import GreyBoxModel
from plant.arrays import Array
from plant.compiled.expression import ONE, ZERO, Expression, as_expression, jacobian, symbol, unary
from plant.compiled.functions import Scalar
from plant.compiled.native.load import load_native
from plant.compiled.native.signature import signature
from plant.compiled.source import statements
from plant.solvers.steps import parameter_names, parameter_symbols, ros2_step

Kernel: TypeAlias = Callable[..., tuple[float, Array, Array]]
"""``run(theta, drives, measured, parameters, sample_time, substeps, block, variance, walk, gaps, outlier, errors,
slopes)``, see `compile_kernel`."""

RUNAWAY = 1e6
"""Largest normalised residual that counts [dimensionless]: a try that runs away keeps a finite cost."""

_KERNEL = '''"""Generated: misfit of the {name} model, with its sensitivities."""

import math

import numpy as np

RUNAWAY = {runaway!r}
SETTLED = 1e-4
STRAIGHT = 1e-3


def absorb(row, level, gain, scale, outlier, gradient, gram):
    for j in range(row.size):
        innovation = row[j] - level[j]
        level[j] += gain * innovation
        value = scale * innovation
        row[j] = min(max(value, -RUNAWAY), RUNAWAY) if value == value else RUNAWAY
    error = row[0]
    weight = outlier / abs(error) if abs(error) > outlier else 1.0
    bend = 1.0 if weight == 1.0 else STRAIGHT
    for i in range(gradient.size):
        gradient[i] += weight * row[i + 1] * error
        for j in range(i + 1):
            gram[i, j] += bend * row[i + 1] * row[j + 1]
    return (1.0 - 0.5 * weight) * weight * error * error


def run(
    theta, drives, measured, parameters, sample_time, substeps, block, variance, walk, gaps, outlier, errors, slopes
):
    n = drives.shape[0]
    gradient, gram = np.zeros({unknowns}), np.zeros(({unknowns}, {unknowns}))
    rows, levels = np.zeros(({outputs}, {columns})), np.zeros(({outputs}, {columns}))
    present, spread = np.zeros({outputs}), np.zeros({outputs})
    cost, share, gap, loose = 0.0, 0.0, 0, False
{load}
{begin}
    for k in range(n):
        if k > 0:
            h = sample_time / substeps[k]
            for j in range(substeps[k]):
                f_start = j / substeps[k]
                f_end = (j + 1.0) / substeps[k]
{between}
{step}
{carry}
{observe}
        if (k + 1) % block == 0 or k == n - 1:
            for i in range({outputs}):
                if present[i] > 0.0:
                    rows[i] /= present[i]
                    total = spread[i] + variance[i] / present[i]
                    gain = spread[i] / total
                    cost += absorb(rows[i], levels[i], gain, 1.0 / math.sqrt(total), outlier, gradient, gram)
                    spread[i] -= gain * spread[i]
                    if errors.size > 0:
                        errors[i, k // block] = rows[i, 0]
                    if slopes.size > 0:
                        slopes[i, k // block] = rows[i, 1:]
                    rows[i] = 0.0
                    present[i] = 0.0
                spread[i] += walk[i]
    return cost, gradient, gram
'''

_TAKES = """
theta : ndarray, shape ({unknowns},)
drives : ndarray, shape (n, {channels})
measured : ndarray, shape (n, {outputs})
parameters : ndarray, shape (parameters,)
sample_time : float
substeps : ndarray of int, shape (n,)
block : int
variance, walk : ndarray, shape ({outputs},)
gaps : ndarray, shape (gaps, 3)
outlier : float
errors : ndarray, shape (errors, blocks)
slopes : ndarray, shape (slopes, slope blocks, slope unknowns)
"""
"""What the kernel takes."""


@cache
def compile_kernel(model: GreyBoxModel) -> Kernel:
    """Generate the kernel that sums up a model's misfit over a log.

    Parameters
    ----------
    model : GreyBoxModel
        The model; it is stepped by ROS2, second order and L-stable.

    Returns
    -------
    callable
        Takes theta (unknowns,), drives (n, channels), measured (n, outputs), parameter row, sample time [s], model
        steps up to each sample (n,), samples a block, each output's white noise [SI squared] and random walk [SI
        squared a block], gaps (g, 3) with first and last sample that a gap in the drives acts on and the variance of
        `GreyBoxModel.jump` over each, and the residual beyond which a block counts linearly.
        Returns half the sum of squares, its gradient (unknowns,) and ``J'J`` (unknowns, unknowns), lower triangle, in
        which blocks that count linearly hardly count.
        Fills errors (outputs, blocks) and slopes (outputs, blocks, unknowns), each unless it is empty.
    """
    takes = _TAKES.format(unknowns=len(model.unknowns), outputs=len(model.outputs), channels=len(model.drives))
    return load_native(f"fit_{model.name}", lambda: _source(model), {"run": signature(takes)}, model).run


def _source(model: GreyBoxModel) -> str:
    """Write the kernel."""
    theta = [symbol(f"theta{i}") for i in range(len(model.unknowns))]
    sizes = dict(model.linear)
    fitted = {
        name: t * sizes[name] if name in sizes else unary("exp", t)
        for name, t in zip(model.unknowns, theta, strict=True)
    }
    p = SimpleNamespace(**{**vars(parameter_symbols(model.parameters)), **fitted})
    start = [as_expression(value) for value in model.initial(p)]
    state = [symbol(f"x{i}") for i in range(len(start))]
    drives = [(symbol(f"a{i}"), symbol(f"b{i}")) for i in range(len(model.drives))]
    moved = model_step(model, state, p, drives)
    outputs = [as_expression(value) for value in model.observe(tuple(state))]
    return _KERNEL.format(
        name=model.name,
        runaway=RUNAWAY,
        outputs=len(outputs),
        unknowns=len(theta),
        columns=len(theta) + 1,
        load="\n".join(
            [f"    {name} = parameters[{i}]" for i, name in enumerate(parameter_names(model.parameters))]
            + [f"    theta{i} = theta[{i}]" for i in range(len(theta))]
            + [f"    {name} = 0.0" for name in _covariance(len(state)) if model.jump]
        ),
        begin=statements(_named(start) | _sensitivities(start, [], theta), "    "),
        between="\n".join(
            f"                {end}{i} = drives[k - 1, {i}] + f_{when} * (drives[k, {i}] - drives[k - 1, {i}])"
            for i in range(len(model.drives))
            for end, when in (("a", "start"), ("b", "end"))
        ),
        step=_stepping(model, moved, state, theta),
        carry=_loosened(model) if model.jump else "",
        observe=_observation(model, outputs, state, theta),
    )


def model_step(
    model: GreyBoxModel,
    state: Sequence[Expression],
    p: SimpleNamespace,
    drives: Sequence[tuple[Expression, Expression]],
) -> list[Expression]:
    """Return the state after one step of length ``h``, with the share of it that has passed as the scheme's input.

    Parameters
    ----------
    model : GreyBoxModel
        The model.
    state : sequence of Expression
        The state before [SI].
    p : SimpleNamespace
        The parameters by name [SI].
    drives : sequence of tuple
        Each drive at the step's start and end [SI].

    Returns
    -------
    list of Expression
        In SI.
    """
    h = symbol("h")

    def rates(now: Any, share: Scalar, parameters: Any) -> tuple[Scalar, ...]:
        return tuple(as_expression(rate) for rate in model.rates(now, (*drives, h), parameters, share))

    return [as_expression(value) for value in ros2_step(rates)(tuple(state), (symbol("share"), ONE), p, h)]


def _named(values: Sequence[Expression]) -> dict[str, Expression]:
    return {f"x{i}": value for i, value in enumerate(values)}


def _sensitivities(
    values: Sequence[Expression], state: Sequence[Expression], theta: Sequence[Expression]
) -> dict[str, Expression]:
    """Return the chain rule ``S' = F S + G`` for every value and unknown."""
    by_state, by_theta = jacobian(values, state), jacobian(values, theta)
    outputs: dict[str, Expression] = {}
    for i in range(len(values)):
        for j in range(len(theta)):
            total = by_theta[i][j]
            for m in range(len(state)):
                total = total + by_state[i][m] * symbol(f"s{m}_{j}")
            outputs[f"s{i}_{j}"] = total
    return outputs


def _covariance(size: int) -> list[str]:
    """Return the names of the covariance's upper triangle."""
    return [f"p{i}_{j}" for i in range(size) for j in range(i, size)]


def _matrix(size: int) -> list[list[Expression]]:
    return [[symbol(f"p{min(i, j)}_{max(i, j)}") for j in range(size)] for i in range(size)]


def _sum(terms: Iterable[Expression]) -> Expression:
    return sum(terms, start=ZERO)


def _stepping(
    model: GreyBoxModel, moved: Sequence[Expression], state: Sequence[Expression], theta: Sequence[Expression]
) -> str:
    """Return the lines of a step; where a gap has left the state open, its covariance goes along: ``P' = F P F'``."""
    indent, size = " " * 16, len(state)
    outputs = _named(moved) | _sensitivities(moved, state, theta)
    if not model.jump:
        return statements(outputs, indent)
    by_state = jacobian(moved, state)
    outputs |= {f"f{i}_{m}": by_state[i][m] for i in range(size) for m in range(size)}
    F, P = [[symbol(f"f{i}_{m}") for m in range(size)] for i in range(size)], _matrix(size)
    carried = {
        f"p{i}_{j}": _sum(F[i][m] * P[m][n] * F[j][n] for m in range(size) for n in range(size))
        for i in range(size)
        for j in range(i, size)
    }
    return "\n".join([statements(outputs, indent), f"{indent}if loose:", statements(carried, indent + "    ", "c")])


def _loosened(model: GreyBoxModel) -> str:
    """Return the lines that add what a gap leaves open to the covariance of the state."""
    jump, size = model.jump, len(model.jump)
    lines = [
        "            while gap < gaps.shape[0] and gaps[gap, 1] < k:",
        "                gap += 1",
        "            if gap < gaps.shape[0] and gaps[gap, 0] <= k:",
        "                loose = True",
    ]
    for i in range(size):
        lines += [f"                p{i}_{j} += {jump[i] * jump[j]!r} * gaps[gap, 2]" for j in range(i, size)]
    return "\n".join(lines)


def _observation(
    model: GreyBoxModel, outputs: Sequence[Expression], state: Sequence[Expression], theta: Sequence[Expression]
) -> str:
    slopes = _sensitivities(outputs, state, theta)
    named = {f"y{i}": output for i, output in enumerate(outputs)} | {f"d{name}": s for name, s in slopes.items()}
    lines = [statements(named, " " * 8)]
    for i in range(len(outputs)):
        lines += [
            f"        if measured[k, {i}] == measured[k, {i}]:",
            f"            present[{i}] += 1.0",
            f"            excess = y{i} - measured[k, {i}]",
            "            weight = 1.0",
            *(_corrected(outputs[i], i, state, len(theta)) if model.jump else []),
            f"            rows[{i}, 0] += weight * excess",
            *(f"            rows[{i}, {j + 1}] += weight * ds{i}_{j}" for j in range(len(theta))),
        ]
    return "\n".join(lines)


def _corrected(output: Expression, i: int, state: Sequence[Expression], unknowns: int) -> list[str]:
    """Return the lines of a Kalman update of a state that a gap has left open; its gain is taken as a constant.

    With any gain that does not depend on the data the innovations are zero on average at the true parameters; with the
    Kalman gain they are white, and hold all that the log says beside the state in the gap (Kalman 1960, equation 28).
    """
    size, excess, variance = len(state), symbol("excess"), symbol(f"variance[{i}]")
    C, P = jacobian([output], state)[0], _matrix(size)
    reach = [_sum(P[m][n] * C[n] for n in range(size)) for m in range(size)]
    opened = _sum(C[m] * reach[m] for m in range(size))
    total = opened + variance
    gain = [r / total for r in reach]
    outputs = {"opened": opened, "weight": unary("sqrt", variance / total)}
    outputs |= {f"x{m}": state[m] - gain[m] * excess for m in range(size)}
    outputs |= {
        f"s{m}_{j}": symbol(f"s{m}_{j}") - gain[m] * symbol(f"ds{i}_{j}") for m in range(size) for j in range(unknowns)
    }
    outputs |= {f"p{m}_{n}": P[m][n] - gain[m] * reach[n] for m in range(size) for n in range(m, size)}
    return [
        "            if loose:",
        statements(outputs, " " * 16, f"u{i}"),
        f"                loose = opened > SETTLED * variance[{i}]",
        "                if not loose:",
        "                    " + " = ".join(_covariance(size)) + " = 0.0",
    ]
