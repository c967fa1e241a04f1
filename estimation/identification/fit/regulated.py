"""Tests whether an input is an exact function of the output, as a controller at a constant set-point makes it."""

from itertools import combinations_with_replacement

import numpy as np
from numpy.typing import ArrayLike

from estimation.arrays import Array
from estimation.identification.fit.residual_tests import DEFAULT_LAGS
from estimation.identification.model.lags import lagged
from estimation.identification.notes import IdentificationCode
from estimation.log_checks.order import median
from plant.notes import Note

CONTROLLER_POLES = (0.0, 0.5, 0.8, 0.9, 0.95, 1.0)
"""Poles of controllers and their actuators, two of which are tried at a time: 1 integrates [dimensionless]."""

CONTROLLER_LAGS = 16
"""Outputs, the present one included, that a controller may use [count]."""

TOLD = 0.1
"""Share of an input's unforeseen part below which the output tells it [dimensionless]."""

LEAST_UNFORESEEN = 1e-5
"""Share of an input's deviation that its own past must leave: below is rounding [dimensionless]."""

PASSES = 15
"""Passes towards least absolute errors."""

SETTLED = 0.01
"""Share of the median error below whose fall no further pass is made [fraction]."""

ASKED_SAMPLES = 4_000
"""Samples that are asked, from the beginning."""

LEAST_MOVING = 0.5
"""Share of samples in which a controller's input moves; a test signal that is held does not [dimensionless]."""


def told_by_output(u: ArrayLike, y: ArrayLike) -> float:
    """Return how much of an input's unforeseen part a controller of the output leaves, as a ratio of medians.

    The unforeseen part is what the input's own past leaves. Controllers are sums of present and past outputs behind
    two poles of `CONTROLLER_POLES`. Fits have least absolute errors, which pass over the samples in which a
    set-point changes.

    Parameters
    ----------
    u : array_like, shape (n,)
        Input, no gaps.
    y : array_like, shape (n,)
        Output, NaN where missing: only samples behind a full past count.

    Returns
    -------
    float
        Near 0 for a controller, or a plant without noise that answers at once and can be inverted; near 1 for others
        [dimensionless]. NaN if the samples do not tell.
    """
    inputs, outputs = np.asarray(u, dtype=np.float64), np.asarray(y, dtype=np.float64)
    before, answered = lagged(inputs, 1, DEFAULT_LAGS), lagged(outputs, 0, CONTROLLER_LAGS)
    known = np.flatnonzero(np.isfinite(answered).all(axis=1))
    known = known[known >= DEFAULT_LAGS]
    if known.size < 4 * DEFAULT_LAGS or np.mean(np.diff(inputs) != 0.0) < LEAST_MOVING:
        return float("nan")
    past, moved = _basis(before[known]), inputs[known]
    if not np.std(moved - past @ (past.T @ moved)) > LEAST_UNFORESEEN * np.std(moved):
        return float("nan")
    told = _basis(answered[known])
    laws = (np.poly(poles) for poles in combinations_with_replacement(CONTROLLER_POLES, 2))
    acts = [moved + before[known, :2] @ law[1:] for law in laws]
    # a law alone foretells a test signal behind a lag
    unforeseen = min(_typical_error(past, moved), *(_typical_error(told[:, :1], act) for act in acts))
    return min(_typical_error(told, act) for act in acts) / unforeseen if unforeseen else float("nan")


def regulated_note(u: Array, y: Array, names: tuple[str, str]) -> Note | None:
    """Return a note if an input is a function of the output; None otherwise, and for short records.

    Parameters
    ----------
    u : ndarray, shape (n,)
        Input, no gaps.
    y : ndarray, shape (n,)
        Output; NaN where missing.
    names : tuple of str
        Of input and output.
    """
    part = slice(0, ASKED_SAMPLES)
    left = told_by_output(u[part], y[part])
    return IdentificationCode.REGULATED.note(input=names[0], output=names[1], left=left) if left < TOLD else None


def _basis(columns: Array) -> Array:
    """Return an orthonormal basis of a constant and columns; the constant is the first."""
    centred = columns - columns.mean(axis=0)
    size = np.linalg.norm(centred, axis=0)
    left, strength, _ = np.linalg.svd(centred / np.where(size > 0.0, size, 1.0), full_matrices=False)
    constant = np.full((columns.shape[0], 1), columns.shape[0] ** -0.5)
    return np.concatenate([constant, left[:, strength > 1e-7 * strength[0]]], axis=1)


def _typical_error(basis: Array, values: Array) -> float:
    """Return the median error of the fit with least absolute errors, which passes over a minority of rows."""
    error = np.abs(values - basis @ (basis.T @ values))
    before, usual = np.inf, median(error)
    for _ in range(PASSES):
        if not 0.0 < usual < (1.0 - SETTLED) * before:
            break
        weighted = basis / np.maximum(error, 1e-2 * usual)[:, None]
        error = np.abs(values - basis @ np.linalg.solve(weighted.T @ basis, weighted.T @ values))
        before, usual = usual, median(error)
    return min(before, usual)
