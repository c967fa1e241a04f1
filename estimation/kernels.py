"""Filters as straight-line kernels: covariance algebra unrolled over the model's structure and compiled.

The predict and the update of an extended Kalman filter are written here once, as loops over expressions. Structural
zeros and ones of the Jacobian vanish, symmetric covariances are stored once, and measurements are processed one
channel at a time, so no matrix is inverted and no absolute jitter is needed.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from types import ModuleType
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from estimation.model import ProcessModel
from plant.compiled.expression import ZERO, Expression, as_expression, jacobian, select, symbol, unary
from plant.compiled.functions import where
from plant.compiled.kernel_file import load_kernel
from plant.compiled.source import statements
from plant.integrate import PARAMETER_NAMES, parameter_symbols

Array: TypeAlias = NDArray[np.float64]

Covariance: TypeAlias = dict[tuple[int, int], Expression]
"""Upper triangle: ``P[i, j]`` with i <= j."""


def _entry(P: Covariance, i: int, j: int) -> Expression:
    return P[min(i, j), max(i, j)]


def _total(terms: Sequence[Expression]) -> Expression:
    result: Expression = ZERO
    for term in terms:
        result = result + term
    return result


def _state_symbols(model: ProcessModel) -> tuple[list[Expression], Covariance]:
    n = model.width
    mean = [symbol(f"z{i}") for i in range(n)]
    return mean, {(i, j): symbol(f"P{i}{j}") for i in range(n) for j in range(i, n)}


def scaled_step(model: ProcessModel) -> tuple[list[Expression], list[list[Expression]]]:
    """Trace the model's step in the filter's scaled units.

    Parameters
    ----------
    model : ProcessModel
        The model.

    Returns
    -------
    tuple of (list of Expression, list of list of Expression)
        The state one step later, and its Jacobian by the state.
    """
    mean, _ = _state_symbols(model)
    physical = tuple(z * state.scale for z, state in zip(mean, model.states, strict=True))
    speeds = (symbol("u_start"), symbol("u_end"))
    moved = model.step(physical, speeds, parameter_symbols(), symbol("h"))
    scaled = [
        z if new is old else as_expression(new) / state.scale
        for z, old, new, state in zip(mean, physical, moved, model.states, strict=True)
    ]
    return scaled, jacobian(scaled, mean)


def _bounded(model: ProcessModel, mean: Sequence[Expression]) -> list[Expression]:
    """Hold the mean to its physical bounds; what is not a number stays so, for a diverged filter must show."""
    held: list[Expression] = []
    for z, state in zip(mean, model.states, strict=True):
        lower, upper = state.lower / state.scale, state.upper / state.scale
        low = z if state.lower == -float("inf") else where(z < lower, lower, z)
        held.append(low if state.upper == float("inf") else where(low > upper, upper, low))
    return held


def predict_expressions(model: ProcessModel) -> dict[str, Expression]:
    """Return the predict step: mean through the model, ``P = F P F' + Q h``.

    Parameters
    ----------
    model : ProcessModel
        The model.

    Returns
    -------
    dict[str, Expression]
        New value of each mean ``z`` and covariance ``P`` symbol.
    """
    n = model.width
    _, P = _state_symbols(model)
    mean, F = scaled_step(model)
    FP = [[_total([F[i][k] * _entry(P, k, j) for k in range(n)]) for j in range(n)] for i in range(n)]
    outputs = {f"z{i}": z for i, z in enumerate(_bounded(model, mean))}
    for i in range(n):
        for j in range(i, n):
            spread = _total([FP[i][k] * F[j][k] for k in range(n)])
            outputs[f"P{i}{j}"] = spread + symbol(f"q{i}") * symbol("h") if i == j else spread
    return outputs


def update_expressions(model: ProcessModel, channels: Sequence[str]) -> dict[str, Expression]:
    """Return the update by each channel in turn; a missing sample (NaN) changes nothing.

    Parameters
    ----------
    model : ProcessModel
        The model.
    channels : sequence of str
        Measured channels, in the order of processing.

    Returns
    -------
    dict[str, Expression]
        New value of each mean and covariance symbol, residuals ``e`` and their variances ``s``.
    """
    n = model.width
    mean, covariance = _state_symbols(model)
    outputs: dict[str, Expression] = {}
    prior = list(mean)
    physical = tuple(z * state.scale for z, state in zip(prior, model.states, strict=True))
    predicted = model.observe(physical, parameter_symbols())
    rows = jacobian([as_expression(predicted[channel]) for channel in channels], prior)
    for c, channel in enumerate(channels):
        y, r, H = symbol(f"y{c}"), symbol(f"r{c}"), rows[c]
        present = unary("present", y)
        moved = _total([H[i] * (mean[i] - prior[i]) for i in range(n)])
        residual = y - (predicted[channel] + moved)
        PH = [_total([_entry(covariance, i, j) * H[j] for j in range(n)]) for i in range(n)]
        variance = _total([H[i] * PH[i] for i in range(n)]) + r
        weight = select(present, 1.0 / variance, ZERO)
        step = weight * select(present, residual, ZERO)
        covariance = {(i, j): entry - PH[i] * PH[j] * weight for (i, j), entry in covariance.items()}
        mean = [z + PH[i] * step for i, z in enumerate(mean)]
        outputs[f"e{c}"], outputs[f"s{c}"] = residual, variance
    outputs |= {f"z{i}": z for i, z in enumerate(_bounded(model, mean))}
    return outputs | {f"P{i}{j}": value for (i, j), value in covariance.items()}


_RUN = '''"""Generated: extended Kalman filter on the {name} form."""

import math

import numba
import numpy as np


@numba.njit(cache=True, nogil=True, error_model="numpy")
def run(
    mean, covariance, speed, measured, parameters, noise, variances, sample_time, substeps, every,
    track, track_variance, residuals, residual_variances,
):
    n = speed.shape[0]
    keep = residuals.shape[0] == n
{load}
    h = sample_time / substeps
    nis = np.zeros({channels})
    count = np.zeros({channels})
    log_likelihood = 0.0
    for k in range(n):
        if k > 0:
            slope = (speed[k] - speed[k - 1]) / substeps
            for j in range(substeps):
                u_start = speed[k - 1] + j * slope
                u_end = u_start + slope
{predict}
{measure}
{update}
{score}
        if k % every == 0:
            row = k // every
{store}
{finish}
    return nis, count, log_likelihood
'''

_SCORE = """        if y{c} == y{c}:
            nis[{c}] += e{c} * e{c} / s{c}
            count[{c}] += 1.0
            log_likelihood -= 0.5 * (e{c} * e{c} / s{c} + math.log(2.0 * math.pi * s{c}))
        if keep:
            residuals[k, {c}] = e{c}
            residual_variances[k, {c}] = s{c}"""


def _lines(template: str, count: int, indent: int) -> str:
    return "\n".join(" " * indent + template.format(i=i) for i in range(count))


def ekf_source(model: ProcessModel, channels: tuple[str, ...]) -> str:
    """Write the scalar kernel of the extended Kalman filter.

    Parameters
    ----------
    model : ProcessModel
        The model.
    channels : tuple of str
        Measured channels.

    Returns
    -------
    str
        Source of a module with ``run``.
    """
    n, m = model.width, len(channels)
    pairs = [(i, j) for i in range(n) for j in range(i, n)]
    load = [f"    z{i} = mean[{i}]" for i in range(n)]
    load += [f"    P{i}{j} = covariance[{i}, {j}]" for i, j in pairs]
    load += [f"    {name} = parameters[{i}]" for i, name in enumerate(PARAMETER_NAMES)]
    load += [f"    q{i} = noise[{i}]" for i in range(n)] + [f"    r{c} = variances[{c}]" for c in range(m)]
    finish = [f"    mean[{i}] = z{i}" for i in range(n)]
    finish += [f"    covariance[{i}, {j}] = covariance[{j}, {i}] = P{i}{j}" for i, j in pairs]
    return _RUN.format(
        name=model.name,
        channels=m,
        load="\n".join(load),
        predict=statements(predict_expressions(model), " " * 16),
        measure=_lines("y{i} = measured[k, {i}]", m, 8),
        update=statements(update_expressions(model, channels), " " * 8),
        score="\n".join(_SCORE.format(c=c) for c in range(m)),
        store=_lines("track[row, {i}] = z{i}", n, 12) + "\n" + _lines("track_variance[row, {i}] = P{i}{i}", n, 12),
        finish="\n".join(finish),
    )


@cache
def compile_ekf(model: ProcessModel, channels: tuple[str, ...]) -> Callable[..., tuple[Array, Array, float]]:
    """Generate and load the extended Kalman filter of a model for a set of channels.

    Parameters
    ----------
    model : ProcessModel
        The model.
    channels : tuple of str
        Measured channels.

    Returns
    -------
    callable
        The kernel's ``run``; see `estimation.ekf` for its arguments.
    """
    return load_kernel(f"ekf_{model.name}", ekf_source(model, channels)).run


_LINEARISED = '''"""Generated: one step of the {name} form, and its Jacobian, in scaled units."""

import math

import numba
import numpy as np


@numba.njit(cache=True, nogil=True, error_model="numpy")
def step(mean, u_start, u_end, parameters, h):
    moved = np.zeros({width})
    slopes = np.zeros(({width}, {width}))
{load}
{body}
{store}
    return moved, slopes
'''


@cache
def compile_step(model: ProcessModel) -> ModuleType:
    """Generate one step of a model with its analytic Jacobian, for filters that work on arrays.

    Parameters
    ----------
    model : ProcessModel
        The model.

    Returns
    -------
    ModuleType
        ``step(mean (n,), speed at start, speed at end, parameter row, h)``, which returns the new mean and the
        Jacobian, both in the filter's scaled units.
    """
    n = model.width
    mean, F = scaled_step(model)
    outputs: Mapping[str, Expression] = {f"m{i}": z for i, z in enumerate(_bounded(model, mean))} | {
        f"f{i}{j}": F[i][j] for i in range(n) for j in range(n) if F[i][j] is not ZERO
    }
    load = [f"    z{i} = mean[{i}]" for i in range(n)]
    load += [f"    {name} = parameters[{i}]" for i, name in enumerate(PARAMETER_NAMES)]
    store = [f"    moved[{name[1]}] = {name}" for name in outputs if name[0] == "m"]
    store += [f"    slopes[{name[1]}, {name[2]}] = {name}" for name in outputs if name[0] == "f"]
    source = _LINEARISED.format(
        name=model.name,
        width=n,
        load="\n".join(load),
        body=statements(outputs, " " * 4),
        store="\n".join(store),
    )
    return load_kernel(f"step_{model.name}", source)
