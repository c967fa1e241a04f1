"""`stretches(where)`: consecutive samples for which a condition holds."""

import numpy as np

from estimation.arrays import BoolArray, IntArray


def stretches(where: BoolArray) -> tuple[IntArray, IntArray]:
    """Return the stretches of consecutive samples for which a condition holds.

    Parameters
    ----------
    where : ndarray of bool, shape (n,)
        Whether it holds.

    Returns
    -------
    tuple of ndarray of int, shape (stretches,)
        The first sample of each stretch, and the one after its last.

    Examples
    --------
    >>> [ends.tolist() for ends in stretches(np.array([True, False, True, True]))]
    [[0, 2], [1, 4]]
    """
    first, behind = np.flatnonzero(np.diff(where, prepend=False, append=False)).reshape(-1, 2).T
    return first, behind


def in_long_stretches(where: BoolArray, least: float) -> BoolArray:
    """Return which samples are in stretches of at least the given length.

    Parameters
    ----------
    where : ndarray of bool, shape (n,)
        Whether a condition holds.
    least : float
        Length of the shortest stretch that counts [samples].

    Returns
    -------
    ndarray of bool, shape (n,)
        Whether a sample is in one.

    Examples
    --------
    >>> in_long_stretches(np.array([True, False, True, True]), 2).tolist()
    [False, False, True, True]
    """
    kept = np.zeros_like(where)
    for first, behind in zip(*stretches(where), strict=True):
        kept[first:behind] = behind - first >= least
    return kept
