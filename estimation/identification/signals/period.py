"""The common period of inputs.

See decision 295.
"""

import numpy as np
from numpy.typing import ArrayLike

from estimation.arrays import Array

LARGEST_PERIODIC_CHANGE = 1e-4
"""Power of an input's change over a period, over its own, up to which it is periodic [fraction]."""

LARGEST_NOISY_CHANGE = 0.01
"""The same if the inputs are measured with noise [fraction]."""

LEAST_OTHER_CHANGE = 0.5
"""The same from which a signal has changed: a period is longer than a lag with such a change [fraction]."""

LEAST_REPEATED_SHARE = 0.2
"""Least share of a log that is repeated [fraction]."""


def find_period(u: ArrayLike) -> int | None:
    """Return the period of an input in samples; None if there is none within half of the log.

    Parameters
    ----------
    u : array_like, shape (n,)
        Input [any unit].

    Examples
    --------
    >>> find_period(np.tile([0.0, 1.0, 3.0, 2.0], 5)), find_period(np.arange(20.0))
    (4, None)
    """
    values = np.asarray(u, dtype=np.float64)
    values = values - values.mean()
    n = len(values)
    total = float(values @ values)
    if not total > 0.0 or not np.isfinite(total):
        return None
    change, power = _change_energy(values, n // 2)
    same = 1 + np.flatnonzero(change <= 2.0 * LARGEST_PERIODIC_CHANGE * power)
    return int(same[0]) if len(same) else None


def common_period(u: Array) -> int | None:
    """Return the common period of all inputs in samples, apart from noise; the last period may be incomplete.

    Parameters
    ----------
    u : ndarray, shape (n, m)
        Inputs [any unit].

    Returns
    -------
    int or None
        The period [samples]; None if there is none of which a fifth of the log is repeated.

    Examples
    --------
    >>> once = np.random.default_rng(0).normal(size=(60, 2))
    >>> common_period(np.concatenate([once, once, once[:9]])), common_period(np.arange(20.0)[:, None])
    (60, None)
    """
    n, longest = len(u), int((1.0 - LEAST_REPEATED_SHARE) * len(u))
    if longest < 2:
        return None
    share = np.zeros(longest)
    for values in (u - u.mean(axis=0)).T:
        total = float(values @ values)
        if not total > 0.0:
            continue
        change, power = _change_energy(values, longest)
        # if both parts hardly move, their agreement says nothing
        moves = power >= LEAST_OTHER_CHANGE * total * (n - np.arange(1, longest + 1)) / n
        share = np.maximum(share, np.where(moves, change / np.maximum(2.0 * power, 1e-300), np.inf))
    other = np.flatnonzero((share > LEAST_OTHER_CHANGE) & np.isfinite(share))
    if not len(other):
        return None
    same = np.flatnonzero(share[other[0] :] <= LARGEST_NOISY_CHANGE)
    if not len(same):
        return None
    # a smooth signal is nearly the same for some lags around its period
    first = int(other[0] + same[0])
    near = share[first : first + max(first // 20, 1)]
    return 1 + first + int(np.argmin(near))


def _change_energy(values: Array, longest: int) -> tuple[Array, Array]:
    """Return the energy of a signal's change over lags from one on, and that of its later part."""
    n = len(values)
    spectrum = np.fft.rfft(values, 2 * n)
    likeness = np.fft.irfft(np.abs(spectrum) ** 2)[:n]
    squares = np.concatenate([[0.0], np.cumsum(values**2)])
    lags = np.arange(1, longest + 1)
    # the power of u[k + lag] - u[k] over the samples that both have
    later = squares[n] - squares[lags]
    return later + squares[n - lags] - 2.0 * likeness[lags], later
