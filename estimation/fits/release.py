"""`released(...) -> Promise`: what one more free parameter promises beside a fit, by slopes: from no further search."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from plant.arrays import Array


class Promise(NamedTuple):
    """What a parameter that is freed, or a hypothesis, promises beside a fit, to first order.

    Parameters
    ----------
    gain : float
        In log-likelihood, Rao's score statistic over two [dimensionless].
    size : float
        How far what is freed first would move in its fitted coordinate: for a logarithm a relative change
        [dimensionless].
    deviation : float
        How well that coordinate would then be known, what is presumed of it included [dimensionless].
    """

    gain: float
    size: float
    deviation: float


def released(gradient: Array, gram: Array, own: Sequence[int], together: Sequence[int], first: int) -> Promise:
    """Return what unknowns promise that are free together, beside those that are free in any case.

    Parameters
    ----------
    gradient : ndarray, shape (unknowns,)
        Of the cost by all of them [dimensionless].
    gram : ndarray, shape (unknowns, unknowns)
        ``J'J`` of all, and what is known beforehand [dimensionless].
    own, together : sequence of int
        Places of the unknowns that are free in any case, and of those that are free together.
    first : int
        Place of the one whose size and deviation are told.

    Returns
    -------
    Promise
        To first order.
    """
    gain, moved, variances = _step(gradient, gram, together)
    place = list(together).index(first)
    before = _step(gradient, gram, own)[0]
    return Promise(gain - before, float(abs(moved[place])), float(variances[place]) ** 0.5)


def _step(gradient: Array, gram: Array, places: Sequence[int]) -> tuple[float, Array, Array]:
    some = gram[np.ix_(places, places)]
    known = np.asarray(np.linalg.pinv(some, rcond=len(places) * np.finfo(float).eps), dtype=np.float64)
    moved: Array = known @ gradient[list(places)]
    return 0.5 * float(gradient[list(places)] @ moved), moved, np.diag(known)
