"""Holds back related runs together: neighbours in time are nearly copies of one another."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimation.arrays import IntArray
from plant.errors import HydrostateError


def contiguous_blocks(places: IntArray, count: int, most: float = 1.0) -> IntArray:
    """Return the block of every run: contiguous stretches of runs, in the order in which they were made.

    If a block would hold so much of a class that the other blocks could not teach it, as with runs sorted by class, the
    runs of each class are cut into stretches instead.

    Parameters
    ----------
    places : ndarray of int, shape (n,)
        Class of each run.
    count : int
        Number of blocks.
    most : float
        Share of a class above which a block holds too much of it [fraction].

    Returns
    -------
    ndarray of int, shape (n,)
        Block of each run.

    Examples
    --------
    >>> contiguous_blocks(np.array([0, 1, 0, 1]), 2).tolist()
    [0, 0, 1, 1]
    >>> contiguous_blocks(np.array([0, 0, 1, 1]), 2).tolist()
    [0, 1, 0, 1]
    """
    whole = np.arange(len(places)) * count // len(places)
    if all(np.bincount(whole[places == k]).max() < most * np.sum(places == k) for k in np.unique(places)):
        return whole
    out = np.zeros(len(places), dtype=np.int64)
    for k in np.unique(places):
        own = np.flatnonzero(places == k)
        out[own] = np.arange(len(own)) * count // len(own)
    return out


def folds(
    places: IntArray, groups: Sequence[Any] | NDArray[Any] | None, count: int, most: float = 1.0
) -> list[IntArray]:
    """Return the runs of each fold; every group lies in one fold.

    Parameters
    ----------
    places : ndarray of int, shape (n,)
        Class of each run.
    groups : sequence, shape (n,), optional
        Group of each run; contiguous blocks if not given. If there are more groups than folds, they are spread so that
        each fold has runs of all classes, as far as possible.
    count : int
        Number of folds.
    most : float
        As in `contiguous_blocks` [fraction].

    Returns
    -------
    list of ndarray of int
        Indices of the runs of each fold.

    Raises
    ------
    HydrostateError
        If there is not a group for every run, or but one.
    """
    if groups is None:
        blocks = contiguous_blocks(places, min(count, len(places)), most)
    else:
        blocks = np.unique(np.asarray(groups), return_inverse=True)[1].astype(np.int64)
    if blocks.shape != places.shape:
        raise HydrostateError(f"a group for each of {len(places)} runs is needed, got {blocks.size}")
    names = np.unique(blocks)
    if len(names) < 2:
        raise HydrostateError("runs of two groups at least are needed, got one: it cannot be held back")
    if len(names) <= count:
        return [np.flatnonzero(blocks == name) for name in names]
    return _spread(places, blocks, count)


def _spread(places: IntArray, blocks: IntArray, count: int) -> list[IntArray]:
    """Return folds of whole groups, large groups first: each goes to the fold in which its classes are scarcest."""
    table = np.zeros((int(blocks.max()) + 1, int(places.max()) + 1))
    np.add.at(table, (blocks, places), 1.0)
    held = np.zeros((count, table.shape[1]))
    wanted = table.sum(axis=0)
    fold_of = np.zeros(len(table), dtype=np.int64)
    for group in np.argsort(-table.sum(axis=1), kind="stable"):
        crowd = (held * table[group] / np.maximum(wanted, 1.0)).sum(axis=1)
        best = min(range(count), key=lambda k: (crowd[k], held[k].sum()))
        held[best] += table[group]
        fold_of[group] = best
    members = [np.flatnonzero(fold_of[blocks] == k) for k in range(count)]
    return [one for one in members if one.size]
