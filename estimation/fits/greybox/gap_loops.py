"""The loop that runs a grey-box model side by side along a log with gaps in its drives, as a plain function.

`estimation.fits.greybox.side_by_side` pastes it into a kernel file, beside `side_by_side_loops`. Each parameter set has
its own covariance of what a gap leaves unknown, as in `estimation.fits.greybox.loops.run`.
"""

import math
from typing import Protocol

import numpy as np

from estimation.arrays import Array, IntArray
from estimation.fits.greybox.side_by_side_loops import SideBySideKernel, close, drive, place_beginning, set_pace
from plant.solvers.fixed_step_loops import Operation, place_shared


class GapKernel(SideBySideKernel, Protocol):
    """Kernel interface of a model that allows gaps, beyond that of one without.

    The other numbers are followed by derivatives, `LANES` each: those of the first `JUMPS` states by their values
    before the last step, and those of each output by them.

    Attributes
    ----------
    JUMP, JUMPS : tuple of float, int
        `GreyBoxModel.jump`, and its length.
    SLOPES : int
        Index of the first of these derivatives.
    SETTLED : float
        Variance left by a gap below which the gap is closed [fraction of the sensor's].
    open_step_at : callable
        The step with these derivatives.
    """

    JUMP: tuple[float, ...]
    JUMPS: int
    SLOPES: int
    SETTLED: float
    open_step_at: Operation


def residuals_across_gaps(
    kernel: GapKernel,
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
    gaps: Array,
    errors: Array,
) -> None:
    """Fill in the normalised residuals of a model under several parameter sets, of a log whose drives have gaps.

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
        As of `side_by_side_loops.residuals_side_by_side` [SI squared].
    kept : float
        What remains of a random walk's level after a block [fraction].
    gaps : ndarray, shape (gaps, 3)
        First and last sample that a gap in the drives affects, and the variance of `GreyBoxModel.jump` over each.
    errors : ndarray, shape (outputs, blocks, lanes)
        Output array for the residuals; those of missing blocks are not changed.
    """
    room = np.zeros(kernel.NUMBERS + 8)  # the share of a step at its start is never set, and must be zero
    work = room[-room.ctypes.data % 64 // 8 :]  # aligned: a vector across two cache lines takes twice as long
    slots, lanes = work.ctypes.data, kernel.LANES
    shown = (kernel.WIDTH + 2 * kernel.DRIVES) * lanes
    jump, covariance = np.zeros(kernel.JUMPS * lanes), np.zeros((kernel.JUMPS * kernel.JUMPS, lanes))
    place_shared(kernel, jump, 0, kernel.JUMP)
    reach, weight = np.zeros((kernel.JUMPS * kernel.JUMPS, lanes)), np.zeros(lanes)
    excess, level = np.zeros((kernel.OUTPUTS, lanes)), np.zeros((kernel.OUTPUTS, lanes))
    present, spread = np.zeros(kernel.OUTPUTS), np.zeros(kernel.OUTPUTS)
    n, steps, gap, loose = drives.shape[0], 0, 0, False
    place_beginning(kernel, work, parameters)
    for k in range(n):
        if k > 0:
            if substeps[k] != steps:
                steps = substeps[k]
                set_pace(kernel, work, sample_time / steps)
            drive(kernel, work, drives, k, steps)
            for j in range(steps):
                if loose:
                    for first in range(0, 8 * lanes, 8 * kernel.VECTOR):
                        kernel.open_step_at(slots + first, float(j))
                    carry_each(kernel, work, covariance, reach)
                else:
                    for first in range(0, 8 * lanes, 8 * kernel.VECTOR):
                        kernel.step_at(slots + first, float(j))
        while gap < gaps.shape[0] and gaps[gap, 1] < k:
            gap += 1
        if gap < gaps.shape[0] and gaps[gap, 0] <= k:
            loose = True
            for i in range(kernel.JUMPS):
                for j in range(kernel.JUMPS):
                    for lane in range(lanes):
                        more = jump[i * lanes + lane] * jump[j * lanes + lane] * gaps[gap, 2]
                        covariance[i * kernel.JUMPS + j, lane] += more
        for first in range(0, 8 * lanes, 8 * kernel.VECTOR):
            kernel.show_at(slots + first, 0.0)
        for i in range(kernel.OUTPUTS):
            if measured[k, i] == measured[k, i]:
                present[i] += 1.0
                for lane in range(lanes):
                    work[shown + i * lanes + lane] -= measured[k, i]
                if loose:
                    loose = correct_each(kernel, work, i, covariance, reach, weight, variance[i])
                    for lane in range(lanes):
                        work[shown + i * lanes + lane] *= weight[lane]
                for lane in range(lanes):
                    excess[i, lane] += work[shown + i * lanes + lane]
        if (k + 1) % block == 0 or k == n - 1:
            close(kernel, k // block, excess, level, present, spread, variance, walk, open_at, kept, errors)


def carry_each(kernel: GapKernel, work: Array, covariance: Array, reach: Array) -> None:
    """Propagate the covariance that a gap has left over the last step, for each set: ``P' = F P F'``.

    Parameters
    ----------
    work : ndarray, shape (numbers,)
        All numbers.
    covariance : ndarray, shape (jumps * jumps, lanes)
        The covariances, row by row [1].
    reach : ndarray, shape (jumps * jumps, lanes)
        Working array for ``F P``.
    """
    size, lanes, slopes = kernel.JUMPS, kernel.LANES, kernel.SLOPES
    for i in range(size):
        for j in range(size):
            for lane in range(lanes):
                reach[i * size + j, lane] = 0.0
            for m in range(size):
                for lane in range(lanes):
                    slope = work[slopes + (i * size + m) * lanes + lane]
                    reach[i * size + j, lane] += slope * covariance[m * size + j, lane]
    for i in range(size):
        for j in range(size):
            for lane in range(lanes):
                covariance[i * size + j, lane] = 0.0
            for m in range(size):
                for lane in range(lanes):
                    slope = work[slopes + (j * size + m) * lanes + lane]
                    covariance[i * size + j, lane] += reach[i * size + m, lane] * slope


def correct_each(
    kernel: GapKernel, work: Array, output: int, covariance: Array, reach: Array, weight: Array, variance: float
) -> bool:
    """Correct each set's state, left unknown by a gap, by a sample; see `estimation.fits.greybox.loops.correct`.

    Parameters
    ----------
    work : ndarray, shape (numbers,)
        All numbers; the output's place holds prediction minus measurement [SI].
    output : int
        Index of the output.
    covariance : ndarray, shape (jumps * jumps, lanes)
        The covariances, row by row; that of a closed gap becomes zero [1].
    reach : ndarray, shape (jumps * jumps, lanes)
        Working array for the gains.
    weight : ndarray, shape (lanes,)
        Output array for the weight of the sample in each set [fraction].
    variance : float
        Variance of the sensor's noise [SI squared].

    Returns
    -------
    bool
        Whether a gap is still open in any set.
    """
    size, lanes, loose = kernel.JUMPS, kernel.LANES, False
    shown = (kernel.WIDTH + 2 * kernel.DRIVES + output) * lanes
    seen = kernel.SLOPES + (size + output) * size * lanes
    for lane in range(lanes):
        opened = 0.0
        for m in range(size):
            reach[m, lane] = 0.0
            for j in range(size):
                reach[m, lane] += covariance[m * size + j, lane] * work[seen + j * lanes + lane]
            opened += work[seen + m * lanes + lane] * reach[m, lane]
        weight[lane] = math.sqrt(variance / (opened + variance))
        still = opened > kernel.SETTLED * variance
        for m in range(size):
            gain = reach[m, lane] / (opened + variance)
            work[m * lanes + lane] -= gain * work[shown + lane]
            for j in range(size):
                covariance[m * size + j, lane] -= gain * reach[j, lane]
        if still:
            loose = True
        else:
            for m in range(size * size):
                covariance[m, lane] = 0.0
    return loose
