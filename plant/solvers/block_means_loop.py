"""The loop that averages the channel of runs side by side, as a plain function for `plant.solvers.block_means`."""

from typing import Protocol

import numpy as np

from plant.arrays import Array
from plant.solvers.fixed_step_loops import Operation, SideBySide, place_rows


class BlockMeansKernel(SideBySide, Protocol):
    """Interface of the kernel of block means.

    The memory holds, `LANES` numbers each, the states, the channel computed from them, the parameters, and the results
    of `settle_at`.

    Attributes
    ----------
    show_at : callable
        Computes the channel from the states.
    """

    show_at: Operation


def average_blocks(kernel: BlockMeansKernel, states: Array, parameters: Array, block: int, means: Array) -> None:
    """Fill in the block means of the channel of runs side by side.

    Parameters
    ----------
    states : ndarray, shape (n, states, up to lanes)
        States at the samples [SI].
    parameters : ndarray, shape (1 or n, lanes, parameters)
        Parameter rows, each valid at its sample.
    block : int
        Samples per block.
    means : ndarray, shape (blocks, up to lanes)
        Output array for the means.
    """
    room = np.zeros(kernel.NUMBERS + 8)
    work = room[-room.ctypes.data % 64 // 8 :]  # a vector that spans two cache lines takes twice as long
    slots, shown, row = work.ctypes.data, kernel.WIDTH * kernel.LANES, -1
    for b in range(means.shape[0]):
        for lane in range(means.shape[1]):
            means[b, lane] = 0.0
        for k in range(b * block, (b + 1) * block):
            if row < 0 or parameters.shape[0] > 1:
                row = min(k, parameters.shape[0] - 1)
                place_rows(kernel, work, shown + kernel.LANES, parameters[row].T, kernel.COLUMNS)
                for first in range(0, 8 * kernel.LANES, 8 * kernel.VECTOR):
                    kernel.settle_at(slots + first, 0.0)
            for i in range(kernel.WIDTH):
                for lane in range(means.shape[1]):
                    work[i * kernel.LANES + lane] = states[k, i, lane]
            for first in range(0, 8 * kernel.LANES, 8 * kernel.VECTOR):
                kernel.show_at(slots + first, 0.0)
            for lane in range(means.shape[1]):
                means[b, lane] += work[shown + lane] / block
