"""The smoother's algebra backwards, and its compiled loops; `estimation.smoother` says what it computes."""

from collections.abc import Sequence
from functools import cache
from types import ModuleType

from estimation.algebra import (
    Covariance,
    Outputs,
    belief_names,
    belief_symbols,
    bounded,
    entry,
    inflation,
    observed,
    scaled_step,
    total,
)
from estimation.ekf import ekf_rule
from estimation.layout import layout
from estimation.model import ProcessModel
from estimation.parts import HEADER, data_places, function_source, rule_functions
from estimation.sigma_points import root
from plant.compiled.expression import ONE, ZERO, Expression, jacobian, select, symbol, unary
from plant.compiled.kernel_file import load_kernel

_LOOPS = """

@numba.njit(cache=True, nogil=True, error_model="numpy")
def forward(state, rows, drives, measured, substeps, first, stop, starts, priors, posteriors):
    keep = starts.shape[0] > 0
    constants = np.empty({constants})
    seen = np.empty((2, measured.shape[1]))
    prepare_0(rows, constants)
    for k in range(first, stop):
        if k > 0:
            for j in range(substeps):
                if keep:
                    starts[k - first, j] = state[:{width}]
                predict_0(state, constants, drives[k - 1], drives[k], float(j))
        if keep:
            priors[k - first] = state
        update_0(state, constants, measured[k], seen)
        if keep:
            posteriors[k - first] = state


@numba.njit(cache=True, nogil=True, error_model="numpy")
def backward(adjoint, rows, drives, measured, substeps, first, stop, starts, priors, posteriors, smoothed):
    shift = np.zeros({width})
    for k in range(stop - 1, first - 1, -1):
        smooth(posteriors[k - first], adjoint, smoothed[k - first])
        hold(priors[k - first], rows, measured[k], shift)
        if np.any(shift != 0.0):
            lift(posteriors[k - first], shift, adjoint)
        back_update(priors[k - first], adjoint, rows, measured[k])
        if k > 0:
            for j in range(substeps - 1, -1, -1):
                back_predict(starts[k - first, j], adjoint, rows, drives[k - 1], drives[k], float(j))
"""


def _adjoint(n: int) -> tuple[list[Expression], Covariance]:
    return [symbol(f"u{i}") for i in range(n)], {(i, j): symbol(f"U{i}_{j}") for i in range(n) for j in range(i, n)}


def _adjoint_outputs(u: Sequence[Expression], U: Covariance) -> Outputs:
    return {f"u{i}": value for i, value in enumerate(u)} | {f"U{i}_{j}": value for (i, j), value in U.items()}


def back_predict_expressions(model: ProcessModel) -> Outputs:
    """Return the adjoint before a step of the model from the one after it (Bierman 1973).

    Parameters
    ----------
    model : ProcessModel
        The model.

    Returns
    -------
    dict[str, Expression]
        New ``u`` and ``U``, in the symbols of both and of the state before the step.
    """
    n = model.width
    u, U = _adjoint(n)
    _, F = scaled_step(model)
    UF = [[total([entry(U, i, k) * F[k][j] for k in range(n)]) for j in range(n)] for i in range(n)]
    earlier = [total([F[k][i] * u[k] for k in range(n)]) for i in range(n)]
    return _adjoint_outputs(
        earlier, {(i, j): total([F[k][i] * UF[k][j] for k in range(n)]) for i in range(n) for j in range(i, n)}
    )


def back_update_expressions(model: ProcessModel, channels: Sequence[str], robust: str) -> Outputs:
    """Return the adjoint before a sample's update from the one after it, the last channel first (Bierman 1973).

    Parameters
    ----------
    model : ProcessModel
        The model.
    channels : sequence of str
        Measured channels, in the order of processing.
    robust : str
        How innovations that are too large count, see `estimation.algebra.inflation`.

    Returns
    -------
    dict[str, Expression]
        New ``u`` and ``U``, in the symbols of both and of the belief before the update.
    """
    n = model.width
    u, U = _adjoint(n)
    for H, K, weight, residual in reversed(_gains(model, channels, robust)[0]):
        seen = weight * residual - total([K[i] * u[i] for i in range(n)])
        UK = [total([entry(U, i, k) * K[k] for k in range(n)]) for i in range(n)]
        known = weight + total([K[i] * UK[i] for i in range(n)])
        u = [value + H[i] * seen for i, value in enumerate(u)]
        U = {(i, j): old - H[i] * UK[j] - UK[i] * H[j] + H[i] * H[j] * known for (i, j), old in U.items()}  # pyright: ignore[reportConstantRedefinition]
    return _adjoint_outputs(u, U)


Gain = tuple[list[Expression], list[Expression], Expression, Expression]
"""Row, gain, inverse variance and innovation of a channel."""


def _gains(model: ProcessModel, channels: Sequence[str], robust: str) -> tuple[list[Gain], list[Expression]]:
    """Return what the filter's update did with each channel, and the mean that it found."""
    n = model.width
    prior, covariance = belief_symbols(model)
    mean = list(prior)
    predicted = observed(model, prior, channels)
    gains: list[Gain] = []
    for c, H in enumerate(jacobian(predicted, prior)):
        y, r = symbol(f"y{c}"), symbol(f"r{c}")
        present = unary("present", y)
        residual = y - (predicted[c] + total([H[i] * (mean[i] - prior[i]) for i in range(n)]))
        PH = [total([entry(covariance, i, j) * H[j] for j in range(n)]) for i in range(n)]
        spread = total([H[i] * PH[i] for i in range(n)])
        variance = spread + r
        if robust != "none":
            variance = spread + r * inflation(robust, residual * residual / variance)
        weight, clean = select(present, ONE / variance, ZERO), select(present, residual, ZERO)
        gains.append((list(H), [value * weight for value in PH], weight, clean))
        mean = [z + PH[i] * weight * clean for i, z in enumerate(mean)]
        covariance = {(i, j): value - PH[i] * PH[j] * weight for (i, j), value in covariance.items()}
    return gains, mean


def hold_expressions(model: ProcessModel, channels: Sequence[str], robust: str) -> Outputs:
    """Return by how much the filter's update was moved to keep within physical bounds.

    Parameters
    ----------
    model : ProcessModel
        The model.
    channels : sequence of str
        Measured channels, in the order of processing.
    robust : str
        How innovations that are too large count.

    Returns
    -------
    dict[str, Expression]
        ``w`` of each state that has bounds, in the symbols of the belief before the update.
    """
    _, found = _gains(model, channels, robust)
    held = bounded(model, found)
    return {f"w{i}": to - z for i, (to, z) in enumerate(zip(held, found, strict=True)) if to is not z}


def lift_expressions(model: ProcessModel) -> Outputs:
    """Return the adjoint of a mean that was moved by ``w``: ``u + P^-1 w``.

    Parameters
    ----------
    model : ProcessModel
        The model.

    Returns
    -------
    dict[str, Expression]
        New ``u``, in the symbols of the belief after the update, of ``u`` and of ``w``.
    """
    n = model.width
    _, covariance = belief_symbols(model)
    u, _ = _adjoint(n)
    L = root(covariance, n)
    inverse = [select(L[i][i] > 0.0, ONE / L[i][i], ZERO) for i in range(n)]
    lower: list[Expression] = []
    for i in range(n):
        lower.append((symbol(f"w{i}") - total([L[i][k] * lower[k] for k in range(i)])) * inverse[i])
    upper: list[Expression] = [ZERO] * n
    for i in reversed(range(n)):
        upper[i] = (lower[i] - total([L[k][i] * upper[k] for k in range(i + 1, n)])) * inverse[i]
    return {f"u{i}": value + upper[i] for i, value in enumerate(u)}


def smooth_expressions(model: ProcessModel) -> Outputs:
    """Return the smoothed belief from the filter's and the adjoint (Bierman 1973).

    Parameters
    ----------
    model : ProcessModel
        The model.

    Returns
    -------
    dict[str, Expression]
        Smoothed ``z``, held to its physical bounds, and ``P``.
    """
    n = model.width
    mean, P = belief_symbols(model)
    u, U = _adjoint(n)
    PU = [[total([entry(P, i, k) * entry(U, k, j) for k in range(n)]) for j in range(n)] for i in range(n)]
    moved = [z + total([entry(P, i, k) * u[k] for k in range(n)]) for i, z in enumerate(mean)]
    outputs = {f"z{i}": z for i, z in enumerate(bounded(model, moved))}
    return outputs | {
        f"P{i}_{j}": old - total([PU[i][k] * entry(P, k, j) for k in range(n)]) for (i, j), old in P.items()
    }


@cache
def compile_smoother(model: ProcessModel, channels: tuple[str, ...], robust: str) -> ModuleType:
    """Generate and load the smoother's kernel.

    Parameters
    ----------
    model : ProcessModel
        The model.
    channels : tuple of str
        Measured channels.
    robust : str
        How innovations that are too large count.

    Returns
    -------
    ModuleType
        ``forward`` and ``backward`` over a chunk.
    """
    rule = ekf_rule(robust)
    filtering = rule_functions(rule, model, channels, "0")
    names = belief_names(model.width)
    belief = {name: f"state[{i}]" for i, name in enumerate(names)}
    adjoint = {name.replace("z", "u").replace("P", "U"): f"adjoint[{i}]" for i, name in enumerate(names)}
    rows = {name: f"rows[{i}]" for i, name in enumerate(layout(rule, model, channels).rows)}
    reads = {**belief, **adjoint, **rows, **data_places(model, channels)}
    source = HEADER.format(title=f"smoother on the {model.name} form") + filtering.source
    source += function_source(
        "back_predict", "state, adjoint, rows, before, after, j", reads, back_predict_expressions(model), adjoint
    )
    source += function_source(
        "back_update",
        "state, adjoint, rows, sample",
        reads,
        back_update_expressions(model, channels, robust),
        adjoint,
    )
    smoothed = {name: f"smoothed[{i}]" for i, name in enumerate(names)}
    moved = {f"w{i}": f"shift[{i}]" for i in range(model.width)}
    source += function_source(
        "hold", "state, rows, sample, shift", reads, hold_expressions(model, channels, robust), moved
    )
    source += function_source("lift", "state, shift, adjoint", {**reads, **moved}, lift_expressions(model), adjoint)
    source += function_source("smooth", "state, adjoint, smoothed", reads, smooth_expressions(model), smoothed)
    source += _LOOPS.format(width=model.width, constants=max(1, filtering.constants))
    return load_kernel(f"smoother_{model.name}", source)
