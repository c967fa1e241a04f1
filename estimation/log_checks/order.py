"""Order statistics of complete samples: NumPy's values, faster."""

from collections.abc import Sequence
from math import floor

import numpy as np

from plant.arrays import Array


def median(values: Array) -> float:
    """Return the median.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Any unit; at least one sample, none missing.

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


def medians(rows: Array) -> Array:
    """Return the median of each row.

    Parameters
    ----------
    rows : ndarray, shape (m, n)
        Any unit; none missing.

    Returns
    -------
    ndarray, shape (m,)
        In the same unit.

    Examples
    --------
    >>> medians(np.array([[3.0, 1.0, 2.0, 10.0], [1.0, 1.0, 2.0, 2.0]])).tolist()
    [2.5, 1.5]
    """
    low, high = (rows.shape[1] - 1) // 2, rows.shape[1] // 2
    ordered = np.partition(rows, (low, high), axis=1) if rows.size else rows
    middle: Array = (ordered[:, low] + ordered[:, high]) / 2.0
    return middle


def percentile(values: Array, percent: float) -> float:
    """Return a percentile, linearly interpolated between neighbours.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Any unit; at least one sample, none missing.
    percent : float
        Share of the samples below it [percent].

    Returns
    -------
    float
        In the same unit.

    Examples
    --------
    >>> percentile(np.array([3.0, 1.0, 2.0, 10.0]), 50.0)
    2.5
    """
    return percentiles(values, (percent,))[0]


def percentiles(values: Array, percents: Sequence[float]) -> list[float]:
    """Return several percentiles of the same samples, sorted once; see `percentile`.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Any unit; at least one sample, none missing.
    percents : sequence of float
        Shares of the samples below them [percent].

    Returns
    -------
    list of float
        In the same unit.

    Examples
    --------
    >>> percentiles(np.array([3.0, 1.0, 2.0, 10.0]), (0.0, 50.0))
    [1.0, 2.5]
    """
    places = [(len(values) - 1) * (percent / 100.0) for percent in percents]
    ends = [(floor(place), min(floor(place) + 1, len(values) - 1)) for place in places]
    ordered = np.partition(values, sorted({end for each in ends for end in each}))
    found: list[float] = []
    for place, (low, high) in zip(places, ends, strict=True):
        below, above, share = ordered[low], ordered[high], place - low
        between = below + share * (above - below) if share < 0.5 else above - (1.0 - share) * (above - below)
        found.append(float(between))
    return found


def stacked(values: Array, count: int) -> tuple[Array, Array]:
    """Return parts of a channel as rows, cut as `numpy.array_split` cuts them: some parts have one sample more.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Any unit.
    count : int
        Number of parts, at most n.

    Returns
    -------
    tuple of ndarray, shapes (n % count, n // count + 1) and (count - n % count, n // count)
        The longer parts, which come first, and the others; views.

    Examples
    --------
    >>> [part.tolist() for part in stacked(np.arange(5.0), 2)]
    [[[0.0, 1.0, 2.0]], [[3.0, 4.0]]]
    """
    each, longer = divmod(len(values), count)
    end = longer * (each + 1)
    return values[:end].reshape(longer, each + 1), values[end:].reshape(count - longer, each)
