"""Whitening of residuals that carry white noise and a random walk: the steady shape of both, sample by sample.

The innovations of a scalar Kalman filter are white and hold all that the residual holds. Its gains do not depend on the
residual, so the same linear filter serves residual and sensitivities alike.
"""

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from plant.compiled.kernel_file import load_kernel

Array = NDArray[np.float64]


class Weights(NamedTuple):
    """The whitening filter of one output.

    Parameters
    ----------
    gain : ndarray, shape (blocks,)
        Share of an innovation that the random walk takes up [dimensionless].
    scale : ndarray, shape (blocks,)
        One over the innovation's standard deviation [1/SI]; zero where the block is missing.
    """

    gain: Array
    scale: Array


_KERNEL = '''"""Generated: the innovations filter of a random walk under white noise, and its gains."""

import numba
import numpy as np


@numba.njit(cache=True, nogil=True, error_model="numpy")
def weights(counts, variance, walk):
    n = counts.shape[0]
    gain, scale = np.zeros(n), np.zeros(n)
    spread = 0.0
    for k in range(n):
        if counts[k] > 0.0:
            total = spread + variance / counts[k]
            gain[k] = spread / total
            scale[k] = 1.0 / np.sqrt(total)
            spread -= gain[k] * spread
        spread += walk
    return gain, scale


@numba.njit(cache=True, nogil=True, error_model="numpy")
def innovations(values, gain, scale):
    n, width = values.shape
    out = np.empty((n, width))
    level = np.zeros(width)
    for k in range(n):
        for j in range(width):
            innovation = values[k, j] - level[j]
            out[k, j] = scale[k] * innovation
            level[j] += gain[k] * innovation
    return out
'''


@cache
def _kernel() -> Any:
    return load_kernel("whitening", _KERNEL)


def block_weights(counts: Array, variance: float, walk: float) -> Weights:
    """Return the whitening filter for means over blocks of samples.

    Parameters
    ----------
    counts : ndarray, shape (blocks,)
        Samples present in each block.
    variance : float
        Variance of the white noise, a sample [SI squared].
    walk : float
        Variance that the random walk gathers from block to block [SI squared].

    Returns
    -------
    Weights
        The filter; without a random walk it only divides by the standard deviation.

    Examples
    --------
    >>> block_weights(np.array([4.0, 0.0]), 1.0, 0.0).scale.tolist()
    [2.0, 0.0]
    """
    return Weights(*_kernel().weights(np.ascontiguousarray(counts, dtype=np.float64), float(variance), float(walk)))


def whitened(values: Array, weights: Weights) -> Array:
    """Return the innovations of each column, over their standard deviation.

    Parameters
    ----------
    values : ndarray, shape (blocks, columns)
        Block means [SI]; what stands where a block is missing does not count.
    weights : Weights
        From `block_weights`.

    Returns
    -------
    ndarray, shape (blocks, columns)
        White, of unit variance; zero where the block is missing [dimensionless].
    """
    return _kernel().innovations(np.ascontiguousarray(values), weights.gain, weights.scale)
