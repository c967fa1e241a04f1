"""How sure one test is that a model is better than another: blocks of it drawn anew, the same ones for both."""

import numpy as np

from estimation.arrays import Array

BLOCKS = 15
"""Blocks that a test is made of: judged, longer than errors stay alike, and enough to scatter."""

DRAWS = 4000
"""Tests drawn anew."""


def error_ratio(one: Array, other: Array, *, blocks: int = BLOCKS, seed: int = 0) -> tuple[float, float, float]:
    """Return the root-mean-square error of one model over that of another on the same test, and its 95 % interval.

    Parameters
    ----------
    one, other : ndarray, shape (n,)
        Errors of each on the same samples, NaN nowhere.
    blocks : int
        Of which a test is made up: each begins at a sample by chance (moving blocks, Kuensch 1989).
    seed : int
        Of what is drawn.

    Returns
    -------
    tuple of float
        Ratio, lower and upper end [dimensionless].
    """
    length = max(one.size // blocks, 1)
    begins = np.random.default_rng(seed).integers(0, one.size - length + 1, (DRAWS, blocks))
    drawn: list[Array] = []
    for errors in (one, other):
        total = np.concatenate([[0.0], np.cumsum(errors**2)])
        drawn.append((total[begins + length] - total[begins]).sum(axis=1))
    low, high = np.quantile(np.sqrt(drawn[0] / drawn[1]), (0.025, 0.975))
    return float(np.sqrt(np.sum(one**2) / np.sum(other**2))), float(low), float(high)
