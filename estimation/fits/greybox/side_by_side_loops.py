"""The loop that runs a grey-box model along a log under several parameter sets side by side, as a plain function.

`estimation.fits.greybox.side_by_side` pastes it into a kernel file, where its parameter ``kernel`` becomes the names of
that file.
"""

import math
from typing import Protocol

import numpy as np

from estimation.arrays import Array, IntArray
from plant.solvers.fixed_step_loops import Operation, SideBySide, place_rows, place_shared


class SideBySideKernel(SideBySide, Protocol):
    """Interface of a model's compiled kernel.

    Memory holds, `LANES` numbers each: states, drives at the last sample, their rises in a step, outputs, the step's
    length, parameters, and what `settle_at` computes from them.

    Attributes
    ----------
    DRIVES, OUTPUTS : int
        Counts of drives and of outputs.
    RUNAWAY : float
        Largest normalised residual [dimensionless].
    begin_at, step_at, show_at : callable
        The states before the first sample, the step with the number ``j`` after the last sample, and the outputs.
    """

    DRIVES: int
    OUTPUTS: int
    RUNAWAY: float
    begin_at: Operation
    step_at: Operation
    show_at: Operation


def residuals_side_by_side(
    kernel: SideBySideKernel,
    parameters: Array,
    drives: Array,
    measured: Array,
    sample_time: float,
    substeps: IntArray,
    block: int,
    variance: Array,
    walk: Array,
    open_at: Array,
    kept: float,
    errors: Array,
) -> None:
    """Fill in the normalised residuals of a model under several parameter sets.

    Parameters
    ----------
    parameters : ndarray, shape (lanes, parameters)
        Parameter rows.
    drives : ndarray, shape (n, drives, one or lanes)
        Drives at the samples [their SI units], linear between; common to all sets, or one each.
    measured : ndarray, shape (n, outputs)
        Outputs; NaN is missing.
    sample_time : float
        Seconds between samples [s].
    substeps : ndarray of int, shape (n,)
        Steps up to each sample.
    block : int
        Samples a block.
    variance, walk, open_at : ndarray, shapes (outputs,), (outputs, walks), (outputs, places)
        White noise of each output, random-walk variance after each block, and other variance of each block's mean; the
        last number holds for all later blocks [SI squared].
    kept : float
        What remains of a random walk's level after a block [fraction].
    errors : ndarray, shape (outputs, blocks, lanes)
        Output array for the residuals; those of missing blocks are not changed.
    """
    room = np.zeros(kernel.NUMBERS + 8)  # the share of a step at its start is never set, and must be zero
    work = room[-room.ctypes.data % 64 // 8 :]  # aligned: a vector across two cache lines takes twice as long
    slots, lanes = work.ctypes.data, kernel.LANES
    shown = (kernel.WIDTH + 2 * kernel.DRIVES) * lanes
    excess, level = np.zeros((kernel.OUTPUTS, lanes)), np.zeros((kernel.OUTPUTS, lanes))
    present, spread = np.zeros(kernel.OUTPUTS), np.zeros(kernel.OUTPUTS)
    n, steps = drives.shape[0], 0
    place_beginning(kernel, work, parameters)
    for k in range(n):
        if k > 0:
            if substeps[k] != steps:
                steps = substeps[k]
                set_pace(kernel, work, sample_time / steps)
            drive(kernel, work, drives, k, steps)
            for j in range(steps):
                for first in range(0, 8 * lanes, 8 * kernel.VECTOR):
                    kernel.step_at(slots + first, float(j))
        for first in range(0, 8 * lanes, 8 * kernel.VECTOR):
            kernel.show_at(slots + first, 0.0)
        for i in range(kernel.OUTPUTS):
            if measured[k, i] == measured[k, i]:
                present[i] += 1.0
                for lane in range(lanes):
                    excess[i, lane] += work[shown + i * lanes + lane] - measured[k, i]
        if (k + 1) % block == 0 or k == n - 1:
            close(kernel, k // block, excess, level, present, spread, variance, walk, open_at, kept, errors)


def place_beginning(kernel: SideBySideKernel, work: Array, parameters: Array) -> None:
    """Store the parameters, and the states before the first sample.

    Parameters
    ----------
    work : ndarray, shape (numbers,)
        All numbers.
    parameters : ndarray, shape (lanes, parameters)
        Parameter rows.
    """
    pace = (kernel.WIDTH + 2 * kernel.DRIVES + kernel.OUTPUTS) * kernel.LANES
    place_rows(kernel, work, pace + kernel.LANES, parameters.T, kernel.COLUMNS)
    for first in range(0, 8 * kernel.LANES, 8 * kernel.VECTOR):
        kernel.begin_at(work.ctypes.data + first, 0.0)


def set_pace(kernel: SideBySideKernel, work: Array, length: float) -> None:
    """Store the step's length, and what follows from it and the parameters.

    Parameters
    ----------
    work : ndarray, shape (numbers,)
        All numbers.
    length : float
        Of a step [s].
    """
    pace = (kernel.WIDTH + 2 * kernel.DRIVES + kernel.OUTPUTS) * kernel.LANES
    place_shared(kernel, work, pace, (length,))
    for first in range(0, 8 * kernel.LANES, 8 * kernel.VECTOR):
        kernel.settle_at(work.ctypes.data + first, 0.0)


def drive(kernel: SideBySideKernel, work: Array, drives: Array, k: int, steps: int) -> None:
    """Store the drives at the last sample, and their rises per step up to sample ``k``.

    Parameters
    ----------
    work : ndarray, shape (numbers,)
        All numbers.
    drives : ndarray, shape (n, drives, one or lanes)
        Drives at the samples [their SI units].
    k : int
        The sample.
    steps : int
        Steps up to it.
    """
    lanes = kernel.LANES
    bases, rises = kernel.WIDTH * lanes, (kernel.WIDTH + kernel.DRIVES) * lanes
    for i in range(kernel.DRIVES):
        if drives.shape[2] > 1:
            for lane in range(lanes):
                work[bases + i * lanes + lane] = drives[k - 1, i, lane]
                work[rises + i * lanes + lane] = (drives[k, i, lane] - drives[k - 1, i, lane]) / steps
        else:
            rise = (drives[k, i, 0] - drives[k - 1, i, 0]) / steps
            for lane in range(lanes):
                work[bases + i * lanes + lane] = drives[k - 1, i, 0]
                work[rises + i * lanes + lane] = rise


def close(
    kernel: SideBySideKernel,
    place: int,
    excess: Array,
    level: Array,
    present: Array,
    spread: Array,
    variance: Array,
    walk: Array,
    open_at: Array,
    kept: float,
    errors: Array,
) -> None:
    """Fill in the residuals of a block, and pass the random walks on to the next one.

    Parameters
    ----------
    place : int
        Index of the block.
    excess, level : ndarray, shape (outputs, lanes)
        Sums over the block of prediction minus measurement, which are reset to zero, and the random walks' levels [SI].
    present, spread : ndarray, shape (outputs,)
        Samples of the block, which are reset to zero, and the variances of the levels [SI squared].
    variance, walk, open_at : ndarray, shapes (outputs,), (outputs, walks), (outputs, places)
        As of `residuals_side_by_side` [SI squared].
    kept : float
        What remains of a random walk's level after a block [fraction].
    errors : ndarray, shape (outputs, blocks, lanes)
        Output array for the residuals; those of missing blocks are not changed.
    """
    for i in range(kernel.OUTPUTS):
        if present[i] > 0.0:
            total = spread[i] + variance[i] / present[i] + open_at[i, min(place, open_at.shape[1] - 1)]
            gain = spread[i] / total
            absorb(kernel, excess[i], level[i], present[i], gain, math.sqrt(total), errors[i, place])
            spread[i] -= gain * spread[i]
            present[i] = 0.0
        for lane in range(kernel.LANES):
            level[i, lane] *= kept
        spread[i] = kept * kept * spread[i] + walk[i, min(place, walk.shape[1] - 1)]


def absorb(
    kernel: SideBySideKernel,
    excess: Array,
    level: Array,
    samples: float,
    gain: float,
    deviation: float,
    errors: Array,
) -> None:
    """Fill in the residuals of a block, less the random walk's level so far, and begin the next block.

    Parameters
    ----------
    excess : ndarray, shape (lanes,)
        Sums over the block of prediction minus measurement [SI].
    level : ndarray, shape (lanes,)
        The random walk's level [SI].
    samples : float
        Samples in the block.
    gain : float
        Share of an innovation that is added to the level [fraction].
    deviation : float
        Standard deviation of an innovation [SI].
    errors : ndarray, shape (lanes,)
        Output array for the normalised residuals.
    """
    for lane in range(kernel.LANES):
        innovation = excess[lane] / samples - level[lane]
        level[lane] += gain * innovation
        value = innovation / deviation
        errors[lane] = min(max(value, -kernel.RUNAWAY), kernel.RUNAWAY) if value == value else kernel.RUNAWAY
        excess[lane] = 0.0
