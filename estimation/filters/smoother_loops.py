"""The smoother's backward algebra, and its compiled loops; `estimation.filters.smoother` explains what it computes."""

from collections.abc import Callable, Sequence
from functools import cache
from typing import NamedTuple, TypeAlias

import numpy as np

from estimation.arrays import Array
from estimation.engine.kalman import (
    Covariance,
    Outputs,
    belief_names,
    belief_symbols,
    bounded_mean,
    entry,
    scaled_step,
    total,
)
from estimation.engine.layout import layout
from estimation.engine.parts import Predict, Prepare, data_places, function_source, rule_functions
from estimation.engine.parts import Update as RuleUpdate
from estimation.engine.rule import weighing
from estimation.filters.ekf import EKF, Update, linearised_update, noise_symbols
from estimation.filters.sigma_points import cholesky_root
from estimation.models.model import ProcessModel
from plant.compiled.expression import ONE, ZERO, Expression, select, symbol
from plant.compiled.native.load import NativeKernel, load_native
from plant.compiled.native.signature import signature_of
from plant.compiled.paste import functions_text, kernel_text

BackPredict: TypeAlias = Callable[[Array, Array, Array, Array, Array, float], None]
"""``back_predict(state, adjoint, rows, before, after, j)``: take the adjoint back over a sub-step from a state."""

BackUpdate: TypeAlias = Callable[[Array, Array, Array, Array], None]
"""``back_update(state, adjoint, rows, sample)``: take the adjoint back over a sample's update of a belief."""

Hold: TypeAlias = Callable[[Array, Array, Array, Array], None]
"""``hold(state, rows, sample, shift)``: by how much the update of a belief was shifted to keep it within its bounds."""

OnBelief: TypeAlias = Callable[[Array, Array, Array], None]
"""``smooth(state, adjoint, smoothed)`` smooths a belief; ``lift(state, shift, adjoint)`` adds the effect of a shift."""


class Log(NamedTuple):
    """A log and a filter's constants, which the loops read and never change.

    Parameters
    ----------
    rows : ndarray, shape (constants,)
        The filter's constants.
    drives, measured : ndarray, shapes (samples, drives) and (samples, channels)
        The log [SI].
    substeps : int
        Steps for each sample.
    """

    rows: Array
    drives: Array
    measured: Array
    substeps: int


class Beliefs(NamedTuple):
    """Workspace for a chunk of the log, or empty.

    Parameters
    ----------
    starts : ndarray, shape (length, substeps, n)
        States before sub-steps [scaled].
    priors, posteriors : ndarray, shape (length, belief)
        Beliefs before and after each sample's update [scaled].
    """

    starts: Array
    priors: Array
    posteriors: Array


def forward(
    state: Array,
    log: Log,
    first: int,
    stop: int,
    beliefs: Beliefs,
    *,
    CONSTANTS: int,
    prepare: Prepare,
    predict: Predict,
    update: RuleUpdate,
) -> None:
    """Filter a chunk; keep the states before sub-steps and the beliefs at each sample, unless the workspace is empty.

    Parameters
    ----------
    state : ndarray, shape (belief,)
        Belief before the chunk; on return, after it [scaled].
    """
    rows, drives, measured, substeps = log
    starts, priors, posteriors = beliefs
    keep = starts.shape[0] > 0
    constants = np.empty(CONSTANTS)
    seen = np.empty((2, measured.shape[1]))
    prepare(rows, constants)
    for k in range(first, stop):
        if k > 0:
            for j in range(substeps):
                if keep:
                    for i in range(starts.shape[2]):
                        starts[k - first, j, i] = state[i]
                predict(state, constants, drives[k - 1], drives[k], float(j))
        if keep:
            for i in range(state.shape[0]):
                priors[k - first, i] = state[i]
        update(state, constants, measured[k], seen)
        if keep:
            for i in range(state.shape[0]):
                posteriors[k - first, i] = state[i]


def backward(
    adjoint: Array,
    log: Log,
    first: int,
    stop: int,
    beliefs: Beliefs,
    smoothed: Array,
    *,
    smooth: OnBelief,
    hold: Hold,
    lift: OnBelief,
    back_update: BackUpdate,
    back_predict: BackPredict,
) -> None:
    """Smooth a chunk from its end, and carry the adjoint back to its beginning.

    Parameters
    ----------
    adjoint : ndarray, shape (belief,)
        Adjoint after the chunk; on return, before it [1/scaled].
    smoothed : ndarray, shape (length, belief)
        Output for the smoothed beliefs [scaled].
    """
    rows, drives, measured, substeps = log
    starts, priors, posteriors = beliefs
    shift = np.zeros(starts.shape[2])
    for k in range(stop - 1, first - 1, -1):
        smooth(posteriors[k - first], adjoint, smoothed[k - first])
        hold(priors[k - first], rows, measured[k], shift)
        if is_moved(shift):
            lift(posteriors[k - first], shift, adjoint)
        back_update(priors[k - first], adjoint, rows, measured[k])
        if k > 0:
            for j in range(substeps - 1, -1, -1):
                back_predict(starts[k - first, j], adjoint, rows, drives[k - 1], drives[k], float(j))


def is_moved(shift: Array) -> bool:
    """Return whether a belief was shifted to stay within its bounds."""
    moved = False
    for i in range(shift.shape[0]):
        moved = moved or shift[i] != 0.0
    return moved


def _adjoint(n: int) -> tuple[list[Expression], Covariance]:
    return [symbol(f"u{i}") for i in range(n)], {(i, j): symbol(f"U{i}_{j}") for i in range(n) for j in range(i, n)}


def _adjoint_outputs(u: Sequence[Expression], U: Covariance) -> Outputs:
    return {f"u{i}": value for i, value in enumerate(u)} | {f"U{i}_{j}": value for (i, j), value in U.items()}


def _filter_update(model: ProcessModel, channels: Sequence[str], robust: str) -> Update:
    """Return the filter's update."""
    prior, _ = belief_symbols(model)
    return linearised_update(model, channels, prior, noise_symbols(channels), robust)


def back_predict_expressions(model: ProcessModel) -> Outputs:
    """Return the adjoint before a step of the model, from the adjoint after it (Bierman 1973).

    Returns
    -------
    dict[str, Expression]
        New ``u`` and ``U``, in the symbols of the adjoint and of the state before the step.
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
    """Return the adjoint before a sample's update, from the adjoint after it, last channel first (Bierman 1973).

    Parameters
    ----------
    channels : sequence of str
        Measured channels, in the order of processing.
    robust : str
        How too large innovations count, see `estimation.engine.robust.inflation`.

    Returns
    -------
    dict[str, Expression]
        New ``u`` and ``U``, in the symbols of the adjoint and of the belief before the update.
    """
    n = model.width
    u, U = _adjoint(n)
    for H, K, weight, residual in reversed(_filter_update(model, channels, robust).gains):
        seen = weight * residual - total([K[i] * u[i] for i in range(n)])
        UK = [total([entry(U, i, k) * K[k] for k in range(n)]) for i in range(n)]
        known = weight + total([K[i] * UK[i] for i in range(n)])
        u = [value + H[i] * seen for i, value in enumerate(u)]
        U = {(i, j): old - H[i] * UK[j] - UK[i] * H[j] + H[i] * H[j] * known for (i, j), old in U.items()}  # pyright: ignore[reportConstantRedefinition]
    return _adjoint_outputs(u, U)


def hold_expressions(model: ProcessModel, channels: Sequence[str], robust: str) -> Outputs:
    """Return the shift that keeps the filter's update within physical bounds.

    Parameters
    ----------
    channels : sequence of str
        Measured channels, in the order of processing.
    robust : str
        How too large innovations count.

    Returns
    -------
    dict[str, Expression]
        ``w`` of each state that has bounds, in the symbols of the belief before the update.
    """
    found = _filter_update(model, channels, robust).mean
    held = bounded_mean(model, found)
    return {f"w{i}": to - z for i, (to, z) in enumerate(zip(held, found, strict=True)) if to is not z}


def lift_expressions(model: ProcessModel) -> Outputs:
    """Return the adjoint of a mean that was shifted by ``w``: ``u + P^-1 w``.

    Returns
    -------
    dict[str, Expression]
        New ``u``, in the symbols of the belief after the update, of ``u`` and of ``w``.
    """
    n = model.width
    _, covariance = belief_symbols(model)
    u, _ = _adjoint(n)
    L = cholesky_root(covariance, n)
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
    outputs = {f"z{i}": z for i, z in enumerate(bounded_mean(model, moved))}
    return outputs | {
        f"P{i}_{j}": old - total([PU[i][k] * entry(P, k, j) for k in range(n)]) for (i, j), old in P.items()
    }


@cache
def compile_smoother(model: ProcessModel, channels: tuple[str, ...], robust: str) -> NativeKernel:
    """Generate and load the smoother's kernel.

    Parameters
    ----------
    robust : str
        How too large innovations count.

    Returns
    -------
    NativeKernel
        ``forward`` and ``backward`` over a chunk.
    """
    rule = weighing(EKF, robust)
    filtering = rule_functions(rule, model, channels)
    names = belief_names(model.width)
    belief = {name: f"state[{i}]" for i, name in enumerate(names)}
    adjoint = {name.replace("z", "u").replace("P", "U"): f"adjoint[{i}]" for i, name in enumerate(names)}
    rows = {name: f"rows[{i}]" for i, name in enumerate(layout(rule, model, channels).rows)}
    smoothed = {name: f"smoothed[{i}]" for i, name in enumerate(names)}
    moved = {f"w{i}": f"shift[{i}]" for i in range(model.width)}
    reads = {**belief, **adjoint, **rows, **moved, **data_places(model, channels)}
    back_update, held = (act(model, channels, robust) for act in (back_update_expressions, hold_expressions))
    generated = (
        ("back_predict", "state, adjoint, rows, before, after, j", back_predict_expressions(model), adjoint),
        ("back_update", "state, adjoint, rows, sample", back_update, adjoint),
        ("hold", "state, rows, sample, shift", held, moved),
        ("lift", "state, shift, adjoint", lift_expressions(model), adjoint),
        ("smooth", "state, adjoint, smoothed", smooth_expressions(model), smoothed),
    )
    parts = (
        filtering.source,
        *(function_source(name, arguments, reads, outputs, writes) for name, arguments, outputs, writes in generated),
        functions_text(forward, backward, is_moved, constants={"CONSTANTS": max(1, filtering.constants)}),
    )
    entries = {"forward": signature_of(forward), "backward": signature_of(backward)}
    return load_native(f"smoother_{model.name}", kernel_text(f"smoother on the {model.name} form", *parts), entries)
