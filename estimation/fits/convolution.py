"""Convolution of a long series with a short symmetric kernel, block by block: `scipy.signal.oaconvolve`, to the bit.

Importing scipy.signal also imports scipy.stats, which takes longer than the fit of a log.
"""

from math import ceil, e, log

import numpy as np

from plant.arrays import Array


def convolved(values: Array, kernel: Array) -> Array:
    """Return the convolution with a kernel that is centred on each sample, by overlap and add.

    Parameters
    ----------
    values : ndarray, shape (n,)
        The series [any unit]; zero beyond its ends.
    kernel : ndarray, shape (2 * reach + 1,)
        At most half as long.

    Returns
    -------
    ndarray, shape (n,)
        The sums [the series' unit times the kernel's].

    Examples
    --------
    >>> convolved(np.array([1.0, 0.0, 0.0, 0.0, 2.0, 0.0]), np.array([0.5, 1.0, 0.5])).round(9).tolist()
    [1.0, 0.5, 0.0, 1.0, 2.0, 1.0]
    """
    n, overlap = len(values), len(kernel) - 1
    if overlap == 0:
        return values * kernel
    size, same = smooth_length(_cheapest_block(overlap), (2, 3, 5, 7, 11)), slice(overlap // 2, overlap // 2 + n)
    if size >= n:
        return _row_convolutions(values, kernel, smooth_length(n + overlap, (2, 3, 5)))[same]
    step = size - overlap
    cut = np.zeros((ceil((n + overlap) / step), step))
    cut.flat[:n] = values
    blocks = _row_convolutions(cut, kernel, size)
    sums = blocks[:, :step]
    sums[1:, :overlap] += blocks[:-1, step:]
    return sums.reshape(-1)[same]


def _row_convolutions(values: Array, kernel: Array, size: int) -> Array:
    """Return the convolution of each row by transforms of a length that holds it whole."""
    return np.fft.irfft(np.fft.rfft(values, size) * np.fft.rfft(kernel, size), size)


def _cheapest_block(overlap: int) -> int:
    """Return the length N of blocks with the fewest operations a sample, where ``N = overlap log(2 e N)``."""
    length = float(overlap)
    for _ in range(60):
        length = overlap * log(2.0 * e * length)
    return ceil(length)


def smooth_length(least: int, primes: tuple[int, ...]) -> int:
    """Return the smallest length, at least that given, whose prime factors are all allowed: it is quick to transform.

    Parameters
    ----------
    least : int
        Shortest length that will do [samples].
    primes : tuple of int
        The allowed factors.

    Returns
    -------
    int
        The length [samples].

    Examples
    --------
    >>> smooth_length(1001, (2, 3, 5))
    1024
    """
    length = least
    while True:
        rest = length
        for prime in primes:
            while rest % prime == 0:
                rest //= prime
        if rest == 1:
            return length
        length += 1
