"""Compiled loops over a whole trajectory: the model's run with corrections, and the best linear correction of it.

A trajectory is ``s_0 = prior + P_0 u_0`` and ``s_k = f(s_{k-1}) + Q_k u_k``. In this form, with an adjoint ``u`` in
place of the noise, a state without noise and an exactly known start need no inverse of a zero variance.
`estimation.filters.iterated_smoother` explains how it is used.
"""

import math
from collections.abc import Callable
from functools import cache
from typing import Any, TypeAlias

import numpy as np

from estimation.arrays import Array
from estimation.engine.kalman import belief_symbols, next_state, predicted_outputs, scaled_step
from estimation.engine.layout import layout
from estimation.engine.parts import data_places, function_source
from estimation.engine.robust import inflation
from estimation.filters.ekf import EKF
from estimation.filters.linearised_log import Lines, Log
from estimation.models.model import ProcessModel
from plant.compiled.expression import ONE, ZERO, jacobian, symbol
from plant.compiled.native.load import NativeKernel, load_native
from plant.compiled.native.signature import signature_of
from plant.compiled.paste import functions_text, kernel_text

Advance: TypeAlias = Callable[[Array, Array, Array, Array, float], None]
"""``advance(state, rows, before, after, j)``: take sub-step j between samples of the drives."""

Differentiate: TypeAlias = Callable[[Array, Array, Array, Array, float, Array], None]
"""``differentiate(state, rows, before, after, j, jacobian)``: the same, with the step's Jacobian."""

See: TypeAlias = Callable[[Array, Array, Array, Array], None]
"""``see(state, rows, seen, slope)``: the model's prediction of each channel, and its derivative by the state."""


def roll(
    start: Array,
    adjoint: Array,
    opened: Array,
    bounds: Array,
    log: Log,
    trajectory: Array,
    *,
    WIDTH: int,
    CHANNELS: int,
    advance: Advance,
    see: See,
) -> float:
    """Run the model with its corrections, held to the states' bounds, and return the sum of squares.

    It is infinite if the run diverges, or begins out of bounds.

    Parameters
    ----------
    start : ndarray, shape (n,)
        First state [scaled].
    adjoint, opened : ndarray, shape (samples, n)
        Adjoint, and the variance that it is multiplied by at each sample [scaled].
    bounds : ndarray, shape (n, 2)
        Bounds of the states [scaled].
    trajectory : ndarray, shape (samples, n)
        Output for the states [scaled].
    """
    rows, drives, measured, spread, substeps = log
    state, seen, slope = start.copy(), np.empty(CHANNELS), np.empty((CHANNELS, WIDTH))
    cost = 0.0
    for i in range(WIDTH):
        if not (bounds[i, 0] <= state[i] <= bounds[i, 1]):
            return np.inf
    for k in range(measured.shape[0]):
        if k > 0:
            for j in range(substeps):
                advance(state, rows, drives[k - 1], drives[k], float(j))
            for i in range(WIDTH):
                state[i] += opened[k, i] * adjoint[k, i]
                cost += opened[k, i] * adjoint[k, i] * adjoint[k, i]
        for i in range(WIDTH):
            if math.isnan(state[i]):
                return np.inf
            state[i] = min(max(state[i], bounds[i, 0]), bounds[i, 1])
            trajectory[k, i] = state[i]
        see(state, rows, seen, slope)
        for c in range(CHANNELS):
            if not math.isnan(measured[k, c]):
                cost += (measured[k, c] - seen[c]) ** 2 / spread[k, c]
    return cost


def forward(
    prior: Array,
    P: Array,
    trajectory: Array,
    adjoint: Array,
    opened: Array,
    log: Log,
    lines: Lines,
    every: int,
    *,
    WIDTH: int,
    CHANNELS: int,
    differentiate: Differentiate,
    see: See,
) -> None:
    """Filter deviations from the trajectory; leave the last covariance in P, and store some others in kept.

    Parameters
    ----------
    prior : ndarray, shape (n,)
        Prior mean of the first state [scaled].
    P : ndarray, shape (n, n)
        Its covariance [scaled].
    trajectory, adjoint, opened : ndarray, shape (samples, n)
        States, adjoint and the variances it is multiplied by [scaled].
    every : int
        Samples for each row of the track.
    """
    rows, drives, measured, spread, substeps = log
    F, _, slope, residual, variance, kept = lines
    m, state, before = np.empty(WIDTH), np.empty(WIDTH), np.empty(WIDTH)
    J, product = np.zeros((WIDTH, WIDTH)), np.empty((WIDTH, WIDTH))
    seen, PH = np.empty(CHANNELS), np.empty(WIDTH)
    for i in range(WIDTH):
        m[i] = prior[i] - trajectory[0, i]
        J[i, i] = 1.0
    for k in range(measured.shape[0]):
        if k > 0:
            for i in range(WIDTH):
                state[i], before[i] = trajectory[k - 1, i], m[i]
                for j in range(WIDTH):
                    F[k, i, j] = 1.0 if i == j else 0.0
            for j in range(substeps):
                differentiate(state, rows, drives[k - 1], drives[k], float(j), J)
                multiply(J, F[k], product, WIDTH=WIDTH)
                copy(product, F[k], WIDTH=WIDTH)
            for i in range(WIDTH):
                m[i] = -opened[k, i] * adjoint[k, i]
                for j in range(WIDTH):
                    m[i] += F[k, i, j] * before[j]
            multiply(F[k], P, product, WIDTH=WIDTH)
            for i in range(WIDTH):
                for j in range(i, WIDTH):
                    total = opened[k, i] if i == j else 0.0
                    for q in range(WIDTH):
                        total += product[i, q] * F[k, j, q]
                    P[i, j] = P[j, i] = total
        if k % every == 0:
            copy(P, kept[k // every], WIDTH=WIDTH)
        see(trajectory[k], rows, seen, slope[k])
        for c in range(CHANNELS):
            if math.isnan(measured[k, c]):
                residual[k, c] = variance[k, c] = np.nan
                continue
            residual[k, c], variance[k, c] = measured[k, c] - seen[c], spread[k, c]
            update(k, c, m, P, PH, lines, WIDTH=WIDTH)


def update(k: int, c: int, m: Array, P: Array, PH: Array, lines: Lines, *, WIDTH: int) -> None:
    """Update a deviation and its covariance by channel c of sample k, and complete its residual and variance."""
    _, gain, slope, residual, variance, _ = lines
    e, s = residual[k, c], variance[k, c]
    for i in range(WIDTH):
        PH[i] = 0.0
        for j in range(WIDTH):
            PH[i] += P[i, j] * slope[k, c, j]
    for i in range(WIDTH):
        e -= slope[k, c, i] * m[i]
        s += slope[k, c, i] * PH[i]
    residual[k, c], variance[k, c] = e, s
    for i in range(WIDTH):
        gain[k, c, i] = PH[i] / s
        m[i] += gain[k, c, i] * e
        for j in range(i, WIDTH):
            P[i, j] -= PH[i] * PH[j] / s
            P[j, i] = P[i, j]


def multiply(a: Array, b: Array, product: Array, *, WIDTH: int) -> None:
    """Multiply two matrices and store the product in a third."""
    for i in range(WIDTH):
        for j in range(WIDTH):
            total = 0.0
            for q in range(WIDTH):
                total += a[i, q] * b[q, j]
            product[i, j] = total


def copy(a: Array, b: Array, *, WIDTH: int) -> None:
    """Copy a matrix."""
    for i in range(WIDTH):
        for j in range(WIDTH):
            b[i, j] = a[i, j]


def backward(lines: Lines, wanted: Array, *, WIDTH: int, CHANNELS: int) -> None:
    """Carry the adjoint back over the log: it moves the trajectory to its best fit.

    Parameters
    ----------
    wanted : ndarray, shape (samples, n)
        Output for the adjoint.
    """
    F, gain, slope, residual, variance, _ = lines
    u, earlier = np.zeros(WIDTH), np.empty(WIDTH)
    for k in range(residual.shape[0] - 1, -1, -1):
        for c in range(CHANNELS - 1, -1, -1):
            if not math.isnan(residual[k, c]):
                known = residual[k, c] / variance[k, c]
                for i in range(WIDTH):
                    known -= gain[k, c, i] * u[i]
                for i in range(WIDTH):
                    u[i] += slope[k, c, i] * known
        for i in range(WIDTH):
            wanted[k, i] = earlier[i] = u[i]
        if k > 0:
            for i in range(WIDTH):
                u[i] = 0.0
                for j in range(WIDTH):
                    u[i] += F[k, j, i] * earlier[j]


def spread_back(lines: Lines, every: int, *, WIDTH: int, CHANNELS: int) -> None:
    """Convert the stored filter covariances into smoothed ones, which use the whole log.

    Parameters
    ----------
    every : int
        Samples for each row of the track.
    """
    F, gain, slope, residual, variance, kept = lines
    U, half, PU = np.zeros((WIDTH, WIDTH)), np.empty((WIDTH, WIDTH)), np.empty((WIDTH, WIDTH))
    UK = np.empty(WIDTH)
    for k in range(residual.shape[0] - 1, -1, -1):
        for c in range(CHANNELS - 1, -1, -1):
            if not math.isnan(residual[k, c]):
                known = 1.0 / variance[k, c]
                for i in range(WIDTH):
                    UK[i] = 0.0
                    for j in range(WIDTH):
                        UK[i] += U[i, j] * gain[k, c, j]
                for i in range(WIDTH):
                    known += gain[k, c, i] * UK[i]
                for i in range(WIDTH):
                    for j in range(WIDTH):
                        H, G = slope[k, c, i], slope[k, c, j]
                        U[i, j] += H * G * known - H * UK[j] - UK[i] * G
        if k % every == 0:
            multiply(kept[k // every], U, PU, WIDTH=WIDTH)
            multiply(PU, kept[k // every], half, WIDTH=WIDTH)
            for i in range(WIDTH):
                for j in range(WIDTH):
                    kept[k // every, i, j] -= half[i, j]
        if k > 0:
            multiply(U, F[k], half, WIDTH=WIDTH)
            for i in range(WIDTH):
                for j in range(WIDTH):
                    PU[j, i] = F[k, i, j]
            multiply(PU, half, U, WIDTH=WIDTH)


def reweigh(
    trajectory: Array,
    log: Log,
    variances: Array,
    *,
    WIDTH: int,
    CHANNELS: int,
    see: See,
    doubt: Callable[[Array], None],
) -> None:
    """Set the variances of all samples by their distance from the trajectory; ``doubt`` converts a ratio to a factor.

    Parameters
    ----------
    trajectory : ndarray, shape (samples, n)
        States [scaled].
    variances : ndarray, shape (channels,)
        Variances of the sensors [SI squared].
    """
    rows, _, measured, spread, _ = log
    seen, slope, ratio = np.empty(CHANNELS), np.empty((CHANNELS, WIDTH)), np.empty(1)
    for k in range(measured.shape[0]):
        see(trajectory[k], rows, seen, slope)
        for c in range(CHANNELS):
            ratio[0] = (measured[k, c] - seen[c]) ** 2 / variances[c]
            doubt(ratio)
            spread[k, c] = variances[c] * ratio[0] if not math.isnan(measured[k, c]) else variances[c]


@cache
def compile_trajectory(model: ProcessModel, channels: tuple[str, ...], robust: str) -> NativeKernel:
    """Generate and load the loops.

    Parameters
    ----------
    robust : str
        How too large residuals count, see `estimation.engine.robust.inflation`.

    Returns
    -------
    NativeKernel
        ``roll``, ``forward``, ``backward`` and ``spread_back``; also ``reweigh`` if outliers are down-weighted.
    """
    n, names = model.width, layout(EKF, model, channels).rows
    mean, _ = belief_symbols(model)
    place = {f"z{i}": f"state[{i}]" for i in range(n)}
    reads = {**place, **data_places(model, channels), **{name: f"rows[{i}]" for i, name in enumerate(names)}}
    stepped, F = scaled_step(model)
    slopes = {f"F{i}_{j}": F[i][j] for i in range(n) for j in range(n) if F[i][j] is not (ONE if i == j else ZERO)}
    new = {f"z{i}": z for i, z in enumerate(next_state(model, mean))}
    written = {**place, **{f"F{i}_{j}": f"jacobian[{i}, {j}]" for i in range(n) for j in range(n)}}
    seen = predicted_outputs(model, mean, channels)
    H = {f"H{c}_{i}": value for c, row in enumerate(jacobian(seen, mean)) for i, value in enumerate(row)}
    shown = {f"e{c}": value for c, value in enumerate(seen)}
    places = {name: f"seen[{name[1:]}]" for name in shown} | {
        name: f"slope[{name[1:].replace('_', ', ')}]" for name in H
    }
    linear = {f"z{i}": z for i, z in enumerate(stepped)} | slopes
    parts = [
        function_source("advance", "state, rows, before, after, j", reads, new, place),
        function_source("differentiate", "state, rows, before, after, j, jacobian", reads, linear, written),
        function_source("see", "state, rows, seen, slope", reads, {**shown, **H}, places),
        functions_text(roll, forward, backward, spread_back, constants={"WIDTH": n, "CHANNELS": len(channels)}),
        functions_text(update, multiply, copy, inlined=True),
    ]
    entries: list[Callable[..., Any]] = [roll, forward, backward, spread_back]
    if robust != "none":
        doubted = {"factor": inflation(robust, symbol("x"))}
        parts.append(function_source("doubt", "ratio", {"x": "ratio[0]"}, doubted, {"factor": "ratio[0]"}))
        parts.append(functions_text(reweigh))
        entries.append(reweigh)
    text = kernel_text(f"trajectories of the {model.name} form", *parts)
    return load_native(f"trajectory_{model.name}", text, {one.__name__: signature_of(one) for one in entries})
