"""The loop that predicts a log by a grey-box model and sums up the normal equations of its misfit, in one pass.

No array as long as the log is stored unless requested. `estimation.fits.greybox.kernel` pastes the loop to a model.
"""

import math
from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

from estimation.arrays import Array, IntArray

RUNAWAY = 1e6
"""Largest normalised residual that counts [dimensionless]: a diverging run keeps a finite cost."""

SETTLED = 1e-4
"""Variance left by a gap below which the gap is closed [fraction of the sensor's]."""

STRAIGHT = 1e-3
"""Weight in ``J'J`` of a block that counts linearly [fraction]."""


class MisfitKernel(Protocol):
    """Interface of a model's compiled kernel.

    A point is a tuple with a row for each state: the state, its derivatives by the unknowns, and in a model that allows
    gaps those by the states before the last step. Each output has such a row of its own.

    Attributes
    ----------
    WIDTH, UNKNOWNS, OUTPUTS : int
        Counts of states, unknowns and outputs.
    JUMP, JUMPS : tuple of float, int
        `GreyBoxModel.jump`, and its length.
    settle, begin : callable
        From fitted coordinates and parameters: what is constant over all steps, and the point before the first sample.
    step : callable
        ``step(point, fixed, before, after, start, end, h)``: the point ``h`` [s] later, while the drives move between
        two shares of the way from sample to sample [fraction].
    observe : callable
        ``observe(point, shown)``: fill in the outputs.
    load, store : callable
        ``load(address)`` and ``store(point, address)``: read a point from memory, and write it.
    """

    WIDTH: int
    UNKNOWNS: int
    OUTPUTS: int
    JUMP: tuple[float, ...]
    JUMPS: int
    settle: Callable[[Array, Array], Any]
    begin: Callable[[Array, Array], Any]
    step: Callable[[Any, Any, Array, Array, float, float, float], Any]
    observe: Callable[[Any, Array], None]
    load: Callable[[int], Any]
    store: Callable[[Any, int], None]


def run(
    kernel: MisfitKernel,
    theta: Array,
    drives: Array,
    measured: Array,
    parameters: Array,
    sample_time: float,
    substeps: IntArray,
    block: int,
    variance: Array,
    walk: Array,
    open_at: Array,
    kept: float,
    gaps: Array,
    outlier: float,
    errors: Array,
    slopes: Array,
) -> tuple[float, Array, Array]:
    """Sum up the misfit of a model over a log.

    Parameters
    ----------
    theta : ndarray, shape (unknowns,)
        Fitted coordinates, see `GreyBoxModel.theta`.
    drives : ndarray, shape (n, channels)
        Drives at the samples [their SI units], linear between.
    measured : ndarray, shape (n, outputs)
        Outputs [SI]; NaN is missing.
    parameters : ndarray, shape (parameters,)
        Parameter row.
    sample_time : float
        Seconds between samples [s].
    substeps : ndarray of int, shape (n,)
        Model steps up to each sample.
    block : int
        Samples a block.
    variance, walk, open_at : ndarray, shapes (outputs,), (outputs, walks), (outputs, places)
        White noise of each output, random-walk variance after each block, and other variance of each block's mean; the
        last number holds for all later blocks [SI squared].
    kept : float
        What remains of a random walk's level after a block [fraction].
    gaps : ndarray, shape (gaps, 3)
        First and last sample that a gap in the drives affects, and the variance of `GreyBoxModel.jump` over each.
    outlier : float
        Residual beyond which a block counts linearly [dimensionless].
    errors : ndarray, shape (errors, blocks)
        Output array for the normalised residuals of each output, or empty.
    slopes : ndarray, shape (slopes, slope blocks, slope unknowns)
        Output array for their derivatives, or empty.

    Returns
    -------
    float
        Half the sum of squares.
    ndarray, shape (unknowns,)
        Its gradient.
    ndarray, shape (unknowns, unknowns)
        ``J'J``, lower triangle, in which blocks that count linearly hardly count.
    """
    n, unknowns, outputs, jumps = drives.shape[0], kernel.UNKNOWNS, kernel.OUTPUTS, kernel.JUMPS
    gradient, gram = np.zeros(unknowns), np.zeros((unknowns, unknowns))
    rows, levels = np.zeros((outputs, 1 + unknowns)), np.zeros((outputs, 1 + unknowns))
    present, spread = np.zeros(outputs), np.zeros(outputs)
    moved, shown = np.zeros((kernel.WIDTH, 1 + unknowns + jumps)), np.zeros((outputs, 1 + unknowns + jumps))
    jump, reach, covariance = np.zeros(jumps), np.zeros((jumps, jumps)), np.zeros((jumps, jumps))
    cost, gap, loose = 0.0, 0, False
    kernel.store(kernel.JUMP, jump.ctypes.data)
    fixed, point = kernel.settle(theta, parameters), kernel.begin(theta, parameters)
    for k in range(n):
        if k > 0:
            h = sample_time / substeps[k]
            for j in range(substeps[k]):
                start, end = j / substeps[k], (j + 1.0) / substeps[k]
                point = kernel.step(point, fixed, drives[k - 1], drives[k], start, end, h)
                if loose:
                    kernel.store(point, moved.ctypes.data)
                    carry(kernel, moved, covariance, reach)
        if jumps > 0:
            while gap < gaps.shape[0] and gaps[gap, 1] < k:
                gap += 1
            if gap < gaps.shape[0] and gaps[gap, 0] <= k:
                loose = True
                for i in range(jumps):
                    for j in range(jumps):
                        covariance[i, j] += jump[i] * jump[j] * gaps[gap, 2]
        kernel.observe(point, shown)
        for i in range(outputs):
            if measured[k, i] == measured[k, i]:
                excess, weight = shown[i, 0] - measured[k, i], 1.0
                if loose:
                    kernel.store(point, moved.ctypes.data)
                    opened = correct(kernel, moved, covariance, reach[0], shown[i], excess, variance[i])
                    point = kernel.load(moved.ctypes.data)
                    weight = math.sqrt(variance[i] / (opened + variance[i]))
                    loose = opened > SETTLED * variance[i]
                    if not loose:
                        covariance[:] = 0.0
                present[i] += 1.0
                rows[i, 0] += weight * excess
                for j in range(1, 1 + unknowns):
                    rows[i, j] += weight * shown[i, j]
        if (k + 1) % block == 0 or k == n - 1:
            for i in range(outputs):
                if present[i] > 0.0:
                    rows[i] /= present[i]
                    total = spread[i] + variance[i] / present[i] + open_at[i, min(k // block, open_at.shape[1] - 1)]
                    gain = spread[i] / total
                    cost += absorb(rows[i], levels[i], gain, 1.0 / math.sqrt(total), outlier, gradient, gram)
                    spread[i] -= gain * spread[i]
                    if errors.size > 0:
                        errors[i, k // block] = rows[i, 0]
                    if slopes.size > 0:
                        slopes[i, k // block] = rows[i, 1:]
                    rows[i] = 0.0
                    present[i] = 0.0
                levels[i] *= kept
                spread[i] = kept * kept * spread[i] + walk[i, min(k // block, walk.shape[1] - 1)]
    return cost, gradient, gram


def absorb(row: Array, level: Array, gain: float, scale: float, outlier: float, gradient: Array, gram: Array) -> float:
    """Add a block's mean misfit and slopes, less the random walk's level so far, to the sums; return its cost."""
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


def carry(kernel: MisfitKernel, point: Array, covariance: Array, room: Array) -> None:
    """Propagate the covariance of a state that a gap has left unknown over the last step: ``P' = F P F'``."""
    size, first = kernel.JUMPS, 1 + kernel.UNKNOWNS
    for i in range(size):
        for j in range(i, size):
            room[i, j] = 0.0
            for m in range(size):
                for n in range(size):
                    room[i, j] += point[i, first + m] * covariance[m, n] * point[j, first + n]
    for i in range(size):
        for j in range(i, size):
            covariance[i, j] = covariance[j, i] = room[i, j]


def correct(
    kernel: MisfitKernel, point: Array, covariance: Array, reach: Array, shown: Array, excess: float, variance: float
) -> float:
    """Correct a state that a gap has left unknown by a sample: a Kalman update whose gain is treated as constant.

    With any gain that does not depend on the data the innovations have zero mean at the true parameters. With the
    Kalman gain they are white, and contain all information of the log except on the state in the gap (Kalman 1960,
    equation 28).

    Returns
    -------
    float
        Variance of the output before the correction [SI squared].
    """
    size, unknowns, opened = kernel.JUMPS, kernel.UNKNOWNS, 0.0
    for m in range(size):
        reach[m] = 0.0
        for n in range(size):
            reach[m] += covariance[m, n] * shown[1 + unknowns + n]
        opened += shown[1 + unknowns + m] * reach[m]
    for m in range(size):
        gain = reach[m] / (opened + variance)
        point[m, 0] -= gain * excess
        for j in range(1, 1 + unknowns):
            point[m, j] -= gain * shown[j]
        for n in range(m, size):
            covariance[m, n] -= gain * reach[n]
            covariance[n, m] = covariance[m, n]
    return opened
