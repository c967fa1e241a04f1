"""Sensitivity of a filter's innovations to its assumptions: exact derivatives, propagated by the filter itself.

Predict and update are functions of belief, parameters, process noise and sensor noise. All of these are moved along a
direction by a symbol; differentiating by it gives the belief's derivative one step later, including the covariance's.
Signs and choices are held constant. One kernel does so for any number of directions side by side.
"""

import math
from collections.abc import Callable, Mapping
from functools import cache
from typing import NamedTuple, TypeAlias

import numpy as np

from estimation.arrays import Array
from estimation.engine.contract import FilterProblem
from estimation.engine.kalman import Outputs, belief_names
from estimation.engine.layout import layout
from estimation.engine.parts import data_places, function_source
from estimation.engine.runner import constant_row
from estimation.filters.ekf import EKF
from estimation.models.model import ProcessModel
from plant.compiled.expression import ZERO, Expression, jacobian, node, ordered, select, symbol
from plant.compiled.hoist import hoisted
from plant.compiled.native.load import NativeKernel, load_native
from plant.compiled.native.signature import signature_of
from plant.compiled.paste import functions_text, kernel_text


def rewritten(outputs: Outputs, replacement: Mapping[str, Expression]) -> Outputs:
    """Return expressions in which other expressions replace some symbols.

    Parameters
    ----------
    outputs : dict[str, Expression]
        The expressions.
    replacement : Mapping[str, Expression]
        Replacement of each symbol, by its name.

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
        Derivative of each symbol along the direction, by its name.

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


class Sensitivity(NamedTuple):
    """Innovations, and their derivatives along directions.

    Parameters
    ----------
    residuals, variances : ndarray, shape (samples, channels)
        Innovations and their predicted variances [SI].
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
    def nis(self) -> Array:
        """Mean normalised innovation squared of each channel [dimensionless]."""
        return np.nanmean(self.residuals**2 / self.variances, axis=0)

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


def innovation_sensitivity(problem: FilterProblem, directions: Array, belief: Array | None = None) -> Sensitivity:
    """Filter a log by an EKF, together with the derivatives of the innovations by the filter's assumptions.

    Parameters
    ----------
    directions : ndarray, shape (rows, directions)
        Derivative of the kernel's constant row (`estimation.engine.runner.constant_row`: parameters, process noise,
        sensor variances, ...) along each direction [their units over the direction's].
    belief : ndarray, shape (n + n (n + 1) / 2, directions), optional
        Derivative of the prior's mean and upper triangle [dimensionless over the direction's unit]; 0 by default.
    """
    model, channels = problem.model, problem.channels
    start = layout(EKF, model, channels).start(problem.mean, problem.covariance)[: len(belief_names(model.width))]
    samples, width = problem.measured.shape
    count = directions.shape[1]
    slopes = np.zeros((len(start), count)) if belief is None else np.array(belief, dtype=np.float64)
    shapes = [(samples, width)] * 2 + [(samples, width, count)] * 2
    result = Sensitivity(*(np.empty(shape) for shape in shapes))
    rows, log = constant_row(problem, {}), (problem.drives, problem.measured, problem.substeps)
    along = np.ascontiguousarray(directions, dtype=np.float64)
    _compile(model, channels).run(start, slopes, rows, along, *log, result)
    return result


Fix: TypeAlias = Callable[[Array, Array, Array, Array, Array, float], tuple[float, ...]]
"""``fix(belief, rows, before, after, sample, j)``: the part of the next step's derivatives that all directions
share."""

Vary: TypeAlias = Callable[
    [Array, Array, Array, Array, Array, float, tuple[float, ...], int, Array, Array, Array, Array], None
]
"""``vary(belief, ..., j, fixed, i, directions, slopes, moved, spread)``: the next step's derivatives along direction
i."""

Act: TypeAlias = Callable[[Array, Array, Array, Array, Array, float, Array, Array], None]
"""``act(belief, ..., j, residual, variance)``: belief, innovations and their variances, one step later."""


def run(
    belief: Array,
    slopes: Array,
    rows: Array,
    directions: Array,
    drives: Array,
    measured: Array,
    substeps: int,
    found: Sensitivity,
    *,
    fix_predict: Fix,
    vary_predict: Vary,
    predict: Act,
    fix_update: Fix,
    vary_update: Vary,
    update: Act,
) -> None:
    """Filter; each half of a step first propagates the belief's derivatives, then the belief itself.

    Parameters
    ----------
    belief : ndarray, shape (belief,)
        Mean and upper triangle of the covariance [scaled].
    slopes : ndarray, shape (belief, directions)
        Their derivatives [scaled over the direction's unit].
    rows : ndarray, shape (rows,)
        The filter's constants.
    directions : ndarray, shape (rows, directions)
        Their derivatives.
    drives, measured : ndarray, shapes (samples, drives) and (samples, channels)
        The log [SI].
    substeps : int
        Steps for each sample.
    """
    residuals, variances, moved, spread = found
    for k in range(measured.shape[0]):
        a, b, y = drives[max(k - 1, 0)], drives[k], measured[k]
        if k > 0:
            for j in range(substeps):
                fixed = fix_predict(belief, rows, a, b, y, float(j))
                for i in range(slopes.shape[1]):
                    vary_predict(belief, rows, a, b, y, float(j), fixed, i, directions, slopes, moved[k], spread[k])
                predict(belief, rows, a, b, y, float(j), residuals[k], variances[k])
        same = fix_update(belief, rows, a, b, y, 0.0)
        for i in range(slopes.shape[1]):
            vary_update(belief, rows, a, b, y, 0.0, same, i, directions, slopes, moved[k], spread[k])
        update(belief, rows, a, b, y, 0.0, residuals[k], variances[k])


@cache
def _compile(model: ProcessModel, channels: tuple[str, ...]) -> NativeKernel:
    names = layout(EKF, model, channels).rows
    carried = {name: i for i, name in enumerate(belief_names(model.width))}
    rates = {name: symbol(f"D{name}") for name in (*carried, *names) if name not in ("h", "share")}
    own = {name: f"belief[{i}]" for name, i in carried.items()}
    reads = own | {name: f"rows[{i}]" for i, name in enumerate(names)} | data_places(model, channels)
    along = {f"D{name}": f"directions[{i}, i]" for i, name in enumerate(names)}
    along |= {f"D{name}": f"slopes[{i}, i]" for name, i in carried.items()}
    each = range(len(channels))
    seen = {f"e{c}": f"residual[{c}]" for c in each} | {f"s{c}": f"variance[{c}]" for c in each}
    written = {name: f"slopes[{i}, i]" for name, i in carried.items()}
    written |= {f"e{c}": f"moved[{c}, i]" for c in each} | {f"s{c}": f"spread[{c}, i]" for c in each}
    given = "belief, rows, before, after, sample, j"
    parts = [functions_text(run)]
    for name, outputs in (("predict", EKF.predict(model)), ("update", EKF.update(model, channels))):
        fixed, moving = hoisted(directional(outputs, rates), {f"D{name}" for name in rates}, "c")
        places = {name: f"fixed[{i}]" for i, name in enumerate(fixed)}
        arguments = f"{given}, fixed, i, directions, slopes, moved, spread"
        parts.append(function_source(f"fix_{name}", given, reads, fixed))
        parts.append(function_source(f"vary_{name}", arguments, reads | along | places, moving, written))
        parts.append(function_source(name, f"{given}, residual, variance", reads, outputs, own | seen))
    title = f"{EKF.name} on the {model.name} form, with derivatives along directions"
    name = f"sensitivity_{EKF.name}_{model.name}"
    return load_native(name, kernel_text(title, *parts), {"run": signature_of(run)})
