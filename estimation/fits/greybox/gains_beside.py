"""Gain of each of several explanations beside the most likely one, to first order."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from estimation.arrays import Array


def gains_beside(free: Array, along: Array, widths: Sequence[int], prices: Sequence[float]) -> list[float]:
    """Return the gain in log-likelihood of explanations beside the most likely one (half of Rao's score statistic).

    Parameters
    ----------
    free : ndarray, shape (blocks, columns)
        Changes of the normalised residuals by each column, without the part that the unknowns absorb [dimensionless].
    along : ndarray, shape (columns,)
        Minus the scalar product of the residuals with each column [dimensionless].
    widths : sequence of int
        Columns of each explanation, in turn [count]; further columns are ignored.
    prices : sequence of float
        Cost of the search for each, in log-likelihood [dimensionless].

    Returns
    -------
    list of float
        Gain of each, less its price [dimensionless]: an image of the likeliest gains nothing, nor does the likeliest
        itself.

    Examples
    --------
    >>> image = np.array([[1.0, 1.0, 0.0], [0.0, 0.1, 1.0]])
    >>> gains_beside(image, np.array([4.0, 4.0, 2.0]), [1, 1, 1], [0.0, 0.0, 1.0])
    [0.0, 0.0, 1.0]
    """
    ends = np.cumsum([0, *widths]).tolist()
    places = [slice(begin, end) for begin, end in pairwise(ends)]
    power = free.T @ free
    gains = [_gain(power[its, its], along[its]) - price for its, price in zip(places, prices, strict=True)]
    if not gains:
        return []
    top = places[int(np.argmax(gains))]
    taken = np.linalg.pinv(power[top, top])
    left, asked = power - power[:, top] @ taken @ power[top], along - power[:, top] @ taken @ along[top]
    found = [_gain(left[its, its], asked[its]) - price for its, price in zip(places, prices, strict=True)]
    return [0.0 if its == top else gain for its, gain in zip(places, found, strict=True)]


def _gain(power: Array, asked: Array) -> float:
    return 0.5 * float(asked @ np.linalg.pinv(power) @ asked)
