"""How a filter's innovations move with what was assumed: exact derivatives, carried along by the filter itself.

Predict and update are functions of belief, parameters, process noise and sensor noise. Moving all of these along a
direction by a symbol and differentiating by it gives the belief's own derivative one step later, covariance included;
signs and choices are held constant. One kernel does so for any number of directions side by side.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from estimation.algebra import EKF, Outputs, Rule, belief_names
from estimation.compiled import constant_row
from estimation.filter import FilterProblem
from estimation.layout import layout
from estimation.model import ProcessModel
from plant.compiled.expression import ZERO, Expression, jacobian, node, ordered, select, symbol
from plant.compiled.hoist import hoisted
from plant.compiled.kernel_file import load_kernel
from plant.compiled.source import statements, symbols_in

Array = NDArray[np.float64]


def rewritten(outputs: Outputs, replacement: Mapping[str, Expression]) -> Outputs:
    """Return expressions with other expressions in the place of some symbols.

    Parameters
    ----------
    outputs : dict[str, Expression]
        The expressions.
    replacement : Mapping[str, Expression]
        What stands for a symbol, by its name.

    Returns
    -------
    dict[str, Expression]
        The same names.

    Examples
    --------
    >>> x = symbol("x")
    >>> rewritten({"y": x * x + symbol("b")}, {"x": ZERO})["y"] is symbol("b")
    True
    """
    made: dict[int, Expression] = {}
    for item in ordered(outputs.values()):
        arguments = [made[id(argument)] for argument in item.arguments]
        match item.operation:
            case "symbol":
                made[id(item)] = replacement.get(str(item.value), item)
            case "+":
                made[id(item)] = arguments[0] + arguments[1]
            case "-":
                made[id(item)] = arguments[0] - arguments[1]
            case "*":
                made[id(item)] = arguments[0] * arguments[1]
            case "/":
                made[id(item)] = arguments[0] / arguments[1]
            case "where":
                made[id(item)] = select(arguments[0], arguments[1], arguments[2])
            case _:
                made[id(item)] = node(item.operation, *arguments, value=item.value)
    return {name: made[id(value)] for name, value in outputs.items()}


def directional(outputs: Outputs, moving: Mapping[str, Expression]) -> Outputs:
    """Return the derivative of expressions along a direction.

    Parameters
    ----------
    outputs : dict[str, Expression]
        The expressions.
    moving : Mapping[str, Expression]
        By how much each symbol moves, by its name.

    Returns
    -------
    dict[str, Expression]
        Derivatives, under the same names.

    Examples
    --------
    >>> x, dx = symbol("x"), symbol("dx")
    >>> directional({"y": 3.0 * x}, {"x": dx})["y"].operation
    '*'
    """
    along = symbol("along")
    moved = rewritten(outputs, {name: symbol(name) + along * rate for name, rate in moving.items()})
    slopes = {name: row[0] for name, row in zip(moved, jacobian(list(moved.values()), [along]), strict=True)}
    return rewritten(slopes, {"along": ZERO})


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Innovations, and their derivatives along directions.

    Parameters
    ----------
    residuals, variances : ndarray, shape (samples, channels)
        Innovations and the variances predicted for them [SI].
    residual_slopes, variance_slopes : ndarray, shape (samples, channels, directions)
        Their derivatives [SI over the direction's unit].
    """

    residuals: Array
    variances: Array
    residual_slopes: Array
    variance_slopes: Array

    @property
    def log_likelihood(self) -> float:
        """Sum of the innovations' Gaussian log densities [dimensionless]; missing samples do not count."""
        present = np.isfinite(self.residuals)
        e, s = self.residuals[present], self.variances[present]
        return -0.5 * float(np.sum(e * e / s + np.log(2.0 * math.pi * s)))

    @property
    def scores(self) -> Array:
        """Derivative of each sample's log density, shape (samples, directions) [dimensionless]."""
        present = np.isfinite(self.residuals)
        with np.errstate(invalid="ignore"):
            scaled = np.where(present, self.residuals / self.variances, 0.0)
            surprise = np.where(present, 0.5 * (self.residuals * scaled - 1.0) / self.variances, 0.0)
        moved = np.where(present[..., None], self.residual_slopes, 0.0)
        spread = np.where(present[..., None], self.variance_slopes, 0.0)
        return np.einsum("kc,kcp->kp", surprise, spread) - np.einsum("kc,kcp->kp", scaled, moved)

    @property
    def information(self) -> Array:
        """Fisher information of the log, shape (directions, directions) (Gupta and Mehra 1974, equation 37)."""
        present = np.isfinite(self.residuals)
        weight = np.where(present, 1.0 / self.variances, 0.0)
        moved = (np.where(present[..., None], self.residual_slopes, 0.0) * np.sqrt(weight)[..., None]).reshape(
            -1, self.residual_slopes.shape[2]
        )
        spread = (np.where(present[..., None], self.variance_slopes, 0.0) * weight[..., None]).reshape(moved.shape)
        return moved.T @ moved + 0.5 * spread.T @ spread


def innovation_sensitivity(
    problem: FilterProblem, directions: Array, belief: Array | None = None, rule: Rule = EKF
) -> Sensitivity:
    """Filter a log, and carry along how the innovations move with what the filter assumes.

    Parameters
    ----------
    problem : FilterProblem
        The task.
    directions : ndarray, shape (rows, directions)
        Derivative of the kernel's constant row (`estimation.compiled.constant_row`: parameters, process noise, sensor
        variances, ...) along each direction [their units over the direction's].
    belief : ndarray, shape (n + n (n + 1) / 2, directions), optional
        Derivative of the prior's mean and upper triangle [dimensionless over the direction's unit]; 0 by default.
    rule : Rule
        The filter; one without settings and memory.

    Returns
    -------
    Sensitivity
        Innovations and derivatives.
    """
    model, channels = problem.model, problem.channels
    start = layout(rule, model, channels).start(problem.mean, problem.covariance)[: len(belief_names(model.width))]
    samples, width = problem.measured.shape
    count = directions.shape[1]
    slopes = np.zeros((len(start), count)) if belief is None else np.array(belief, dtype=np.float64)
    result = Sensitivity(
        np.empty((samples, width)),
        np.empty((samples, width)),
        np.empty((samples, width, count)),
        np.empty((samples, width, count)),
    )
    _compile(rule, model, channels).run(
        start,
        slopes,
        constant_row(problem, {}),
        np.ascontiguousarray(directions, dtype=np.float64),
        problem.drives,
        problem.measured,
        problem.substeps,
        result.residuals,
        result.variances,
        result.residual_slopes,
        result.variance_slopes,
    )
    return result


_KERNEL = '''"""Generated: {name}, with derivatives along directions."""

import math

import numba
import numpy as np


@numba.njit(cache=True, nogil=True, error_model="numpy")
def run(belief, slopes, rows, directions, drives, measured, substeps, residuals, variances, moved, spread):
    samples = measured.shape[0]
    count = slopes.shape[1]
{load}
    for k in range(samples):
        if k > 0:
{drive}
            for j in range(substeps):
{predict_fixed}
                for l in range(count):
{predict_get}
{predict_moving}
{predict_put}
{predict}
{measure}
{update_fixed}
        for l in range(count):
{update_get}
{update_moving}
{update_put}
{update}
{keep}
'''


@cache
def _compile(rule: Rule, model: ProcessModel, channels: tuple[str, ...]) -> ModuleType:
    names = layout(rule, model, channels)
    carried = belief_names(model.width)
    rates = {name: symbol(f"D{name}") for name in (*carried, *names.rows) if name not in ("h", "share")}
    predict, update = rule.predict(model), rule.update(model, channels)
    used = symbols_in([*predict.values(), *update.values()])

    def half(outputs: Outputs, indent: int) -> tuple[str, str, str, str]:
        """Return what is the same for all directions, then reading, moving and writing those of one direction."""
        slopes = directional(outputs, rates)
        fixed, moving = hoisted(slopes, {f"D{name}" for name in rates}, "c")
        wanted = symbols_in(list(moving.values()))
        get = [f"D{name} = slopes[{i}, l]" for i, name in enumerate(carried) if f"D{name}" in wanted]
        get += [f"D{name} = directions[{i}, l]" for i, name in enumerate(names.rows) if f"D{name}" in wanted]
        put = [f"slopes[{carried.index(name)}, l] = N{name}" for name in slopes if name in carried]
        for target, letter in (("moved", "e"), ("spread", "s")):
            put += [f"{target}[k, {c}, l] = N{letter}{c}" for c in range(len(channels)) if f"{letter}{c}" in slopes]
        inner = " " * (indent + 4)
        body = statements({f"N{name}": value for name, value in moving.items()}, inner)
        return (
            statements(fixed, " " * indent),
            "\n".join(inner + line for line in get) or inner + "pass",
            body,
            "\n".join(inner + line for line in put),
        )

    before, after = half(predict, 16), half(update, 8)
    load = [f"    {name} = belief[{i}]" for i, name in enumerate(carried)]
    load += [f"    {name} = rows[{i}]" for i, name in enumerate(names.rows) if name in used]
    drive = [
        f"            {x}{i} = drives[k{shift}, {i}]"
        for i in range(len(model.drives))
        for x, shift in (("a", " - 1"), ("b", ""))
    ]
    keep = [f"        residuals[k, {c}] = e{c}" for c in range(len(channels))]
    keep += [f"        variances[k, {c}] = s{c}" for c in range(len(channels))]
    source = _KERNEL.format(
        name=f"{rule.name} on the {model.name} form",
        load="\n".join(load),
        drive="\n".join(drive),
        predict_fixed=before[0],
        predict_get=before[1],
        predict_moving=before[2],
        predict_put=before[3],
        predict=statements(predict, " " * 16),
        measure="\n".join(f"        y{c} = measured[k, {c}]" for c in range(len(channels))),
        update_fixed=after[0],
        update_get=after[1],
        update_moving=after[2],
        update_put=after[3],
        update=statements(update, " " * 8),
        keep="\n".join(keep),
    )
    return load_kernel(f"sensitivity_{rule.name}_{model.name}", source)
