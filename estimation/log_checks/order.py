"""`median`, `percentile`: order statistics of samples that are all there, as NumPy gives them, but quicker."""

from math import floor

import numpy as np

from plant.arrays import Array


def median(values: Array) -> float:
    """Return the median.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Any unit; one sample at least, none missing.

    Returns
    -------
    float
        In the same unit.

    Examples
    --------
    >>> median(np.array([3.0, 1.0, 2.0, 10.0]))
    2.5
    """
    low, high = (len(values) - 1) // 2, len(values) // 2
    ordered = np.partition(values, (low, high))
    return float((ordered[low] + ordered[high]) / 2.0)


def percentile(values: Array, percent: float) -> float:
    """Return a percentile, on the straight line between neighbours.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Any unit; one sample at least, none missing.
    percent : float
        Share of the samples that lie below [percent].

    Returns
    -------
    float
        In the same unit.

    Examples
    --------
    >>> percentile(np.array([3.0, 1.0, 2.0, 10.0]), 50.0)
    2.5
    """
    place = (len(values) - 1) * (percent / 100.0)
    low = floor(place)
    high, share = min(low + 1, len(values) - 1), place - low
    ordered = np.partition(values, (low, high))
    below, above = ordered[low], ordered[high]
    between = below + share * (above - below) if share < 0.5 else above - (1.0 - share) * (above - below)
    return float(between)
