"""Confidence that one model is better than another: paired resampling of blocks or records."""

from collections.abc import Sequence

import numpy as np

from estimation.arrays import Array

BLOCKS = 15
"""Blocks in a resampled test: judged, each longer than the correlation of errors, and enough of them to vary."""

DRAWS = 4000
"""Number of resampled tests."""


def error_ratio(one: Array, other: Array, *, blocks: int = BLOCKS, seed: int = 0) -> tuple[float, float, float]:
    """Return the ratio of two models' root-mean-square errors on the same test, and its 95 % interval.

    Parameters
    ----------
    one, other : ndarray, shape (n,)
        Errors of each on the same samples, without NaN.
    blocks : int
        Blocks in a resampled test; each begins at a random sample (moving blocks, Kuensch 1989).
    seed : int
        Seed of the resampling.

    Returns
    -------
    tuple of float
        Ratio, lower and upper end [dimensionless].
    """
    low, high = np.quantile(_drawn_ratios(one, other, blocks, seed), (0.025, 0.975))
    return _ratio(one, other), float(low), float(high)


def chance_of_lead(one: Array, other: Array, allowed: float, *, blocks: int = BLOCKS, seed: int = 0) -> float:
    """Return how likely the second of two equally good models is ahead by more than allowed on such a test.

    The ratio of errors scatters as that of these models does over resampled tests, but around 1.

    Parameters
    ----------
    one, other : ndarray, shape (n,)
        Errors of each on the same samples, without NaN.
    allowed : float
        Ratio of the first model's error to the second's up to which the second is not ahead [dimensionless].
    blocks, seed : int
        As in `error_ratio`.

    Returns
    -------
    float
        Probability.
    """
    return float(np.mean(_drawn_ratios(one, other, blocks, seed) > allowed * _ratio(one, other)))


def _ratio(one: Array, other: Array) -> float:
    return float(np.sqrt(np.sum(one**2) / np.sum(other**2)))


def _drawn_ratios(one: Array, other: Array, blocks: int, seed: int) -> Array:
    """Return the ratio of errors on resampled tests, the same blocks for both, shape (draws,)."""
    length = max(one.size // blocks, 1)
    begins = np.random.default_rng(seed).integers(0, one.size - length + 1, (DRAWS, blocks))
    drawn: list[Array] = []
    for errors in (one, other):
        total = np.concatenate([[0.0], np.cumsum(errors**2)])
        drawn.append((total[begins + length] - total[begins]).sum(axis=1))
    return np.sqrt(drawn[0] / drawn[1])


def records_ratio(one: Sequence[Array], other: Sequence[Array], *, seed: int = 0) -> tuple[float, float, float]:
    """Return the ratio of two models' errors over several records, with its 95 % interval by resampling the records.

    A model that is better on one record of a nonlinear plant may be worse on the next; blocks of one record cannot show
    that.

    Parameters
    ----------
    one, other : sequence of ndarray, shape (n,)
        Errors of each on the same records, without NaN.
    seed : int
        Seed of the resampling.

    Returns
    -------
    tuple of float
        Ratio, lower and upper end [dimensionless].
    """
    squares = np.array([[float(np.sum(errors**2)) for errors in errors_of] for errors_of in (one, other)])
    drawn = squares[:, np.random.default_rng(seed).integers(0, len(one), (DRAWS, len(one)))].sum(axis=2)
    # this method does not interpolate, which infinite errors would not allow
    low, high = np.quantile(np.sqrt(drawn[0] / drawn[1]), (0.025, 0.975), method="inverted_cdf")
    ratio = np.sqrt(squares[0].sum() / squares[1].sum())
    return float(ratio), float(low), float(high)
