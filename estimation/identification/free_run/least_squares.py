"""Least squares by scaled normal equations, over the samples that count."""

from collections.abc import Sequence

import numpy as np

from estimation.arrays import Array, BoolArray

MOST_PIECES = 32
"""Parts without a gap that are summed one by one; if there are more, the samples that count are copied."""


class Counted:
    """Which samples count, as parts without a gap: held-back blocks leave few, and nothing is copied.

    Parameters
    ----------
    used : ndarray of bool, shape (n,)
        Mask of the samples that count.
    """

    def __init__(self, used: BoolArray) -> None:
        self.used = used
        edges = np.flatnonzero(np.diff(np.concatenate([[False], used, [False]])))
        self.pieces: Sequence[slice | BoolArray] = [used]
        if edges.size <= 2 * MOST_PIECES:
            self.pieces = [slice(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]

    def normal_equations(self, columns: Array, target: Array) -> tuple[Array, Array]:
        """Return the sums of products of columns with each other and with a target.

        Parameters
        ----------
        columns : ndarray, shape (n, p)
            Regressors.
        target : ndarray, shape (n,)
            Target; not read where a sample does not count.

        Returns
        -------
        tuple of ndarray, shapes (p, p) and (p,)
            Over the samples that count.
        """
        gram, right = np.zeros((columns.shape[1],) * 2), np.zeros(columns.shape[1])
        for piece in self.pieces:
            part = columns[piece]
            gram += part.T @ part
            right += part.T @ target[piece]
        return gram, right

    def square(self, left: Array) -> float:
        """Return the sum of squared residuals over the samples that count.

        Parameters
        ----------
        left : ndarray, shape (n,)
            Residuals.

        Returns
        -------
        float
            In the squared unit of the residuals.
        """
        return sum(float(left[piece] @ left[piece]) for piece in self.pieces)


def least_squares(columns: Array, target: Array, counted: Counted | None = None) -> tuple[Array, float]:
    """Return values of a least-squares fit by scaled normal equations, and its cost.

    Parameters
    ----------
    columns : ndarray, shape (n, p)
        Regressors.
    target : ndarray, shape (n,)
        Target.
    counted : Counted, optional
        Which samples count; all by default.

    Returns
    -------
    tuple of ndarray, shape (p,), and float
        Values, and the sum of squared residuals.
    """
    counted = counted or Counted(np.ones(target.size, dtype=np.bool_))
    gram, right = counted.normal_equations(columns, target)
    scale = np.sqrt(np.diag(gram))
    scale[scale == 0.0] = 1.0
    values = np.linalg.lstsq(gram / np.outer(scale, scale), right / scale, rcond=None)[0] / scale
    return values, counted.square(target - columns @ values)
