"""Nonlinearities at a model's input: dead zone, saturation, backlash, each with its derivatives by what is fitted."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from estimation.arrays import Array
from estimation.identification.search.jit import compiled

START_SHARES = (0.02, 0.05, 0.1, 0.2, 0.3, 0.4)
"""Shares of the input's samples, or of its range, at which searches begin [fraction]."""


@compiled
def play(u: Array, width: float, start: float, out: Array, slopes: Array) -> None:
    """Fill in the output of a play: it follows the input at half its width, and is constant in between.

    Parameters
    ----------
    u : ndarray, shape (n,)
        Input.
    width : float
        Half the width [unit of the input].
    start : float
        Output before the first sample [unit of the input].
    out : ndarray, shape (n,)
        Output array.
    slopes : ndarray, shape (n, 2)
        Output array for the derivatives by half the width and by the start.
    """
    at, by_width, by_start = start, 0.0, 1.0
    for k in range(u.size):
        if at < u[k] - width:
            at, by_width, by_start = u[k] - width, -1.0, 0.0
        elif at > u[k] + width:
            at, by_width, by_start = u[k] + width, 1.0, 0.0
        out[k] = at
        slopes[k, 0] = by_width
        slopes[k, 1] = by_start


Applied = Callable[[Array, Array, float], tuple[Array, Array]]
"""``apply(u, values, start)``: input of the linear model, shape (n,), and its derivatives by the values, and by the
start if there is one, shape (n, values)."""


def _dead_zone(u: Array, values: Array, start: float) -> tuple[Array, Array]:  # noqa: ARG001 -- all take a start
    below, above = u < values[0], u > values[1]
    out = np.where(below, u - values[0], np.where(above, u - values[1], 0.0))
    return out, -np.column_stack([below, above]).astype(np.float64)


def _saturation(u: Array, values: Array, start: float) -> tuple[Array, Array]:  # noqa: ARG001 -- likewise
    return np.clip(u, *values), np.column_stack([u < values[0], u > values[1]]).astype(np.float64)


def _backlash(u: Array, values: Array, start: float) -> tuple[Array, Array]:
    out, slopes = np.empty(u.size), np.empty((u.size, 2))
    play(np.ascontiguousarray(u), float(values[0]), start, out, slopes)
    return out, slopes


def _inner(u: Array) -> list[Array]:
    """Return bands in the middle of an input, around zero and around its median."""
    bands = [np.quantile(u, [0.5 - share / 2.0, 0.5 + share / 2.0]) for share in (*START_SHARES, 0.6)]
    size = np.quantile(np.abs(u), START_SHARES)
    return [*bands, *(np.array([-one, one]) for one in size)]


def _outer(u: Array) -> list[Array]:
    """Return levels with equally many samples above and below, and on one side alone."""
    least, most = float(u.min()), float(u.max())
    both = [np.quantile(u, [share, 1.0 - share]) for share in START_SHARES]
    high = [np.array([least, np.quantile(u, 1.0 - share)]) for share in START_SHARES[1::2]]
    low = [np.array([np.quantile(u, share), most]) for share in START_SHARES[1::2]]
    return [*both, *high, *low]


def _widths(u: Array) -> list[Array]:
    return [np.array([0.5 * share * float(np.ptp(u))]) for share in (0.005, 0.01, *START_SHARES)]


def _is_within_range(u: Array, values: Array) -> bool:
    """Return whether a band has ordered ends, both within the range of the samples."""
    low, high = values
    return bool(low <= high and low >= u.min() and high <= u.max())


@dataclass(frozen=True)
class Nonlinearity:
    """One kind of nonlinearity.

    Parameters
    ----------
    names : tuple of str
        Fitted values: levels of the input, or half a width.
    level : bool
        Whether they are levels.
    remembers : bool
        Whether it has an initial state in every log.
    apply : callable
        See `Applied`.
    starts : callable
        From the input of all logs to first guesses.
    may : callable
        Whether values are valid for that input.
    """

    names: tuple[str, ...]
    level: bool
    remembers: bool
    apply: Applied
    starts: Callable[[Array], list[Array]]
    may: Callable[[Array, Array], bool]


NONLINEARITIES: Mapping[str, Nonlinearity] = {
    "dead-zone": Nonlinearity(("lower", "upper"), True, False, _dead_zone, _inner, _is_within_range),
    "saturation": Nonlinearity(
        ("lower", "upper"), True, False, _saturation, _outer, lambda u, v: _is_within_range(u, v) and v[0] < v[1]
    ),
    "backlash": Nonlinearity(
        ("half_width",), False, True, _backlash, _widths, lambda u, v: bool(0.0 <= v[0] < 0.5 * np.ptp(u))
    ),
}
"""Nonlinearities by name."""
