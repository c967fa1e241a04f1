"""The lagged signals in the terms of a polynomial model, and each term's product."""

from dataclasses import dataclass, replace

import numpy as np

from estimation.arrays import Array, IntArray
from estimation.identification.search.jit import compiled

SIGNAL_MARGIN = 0.1
"""Share of its range by which a signal may leave it in a product before it is clipped [dimensionless]."""

RELEASE_FACTOR = 2.0
"""Factor on the distance from the middle at which a released signal is clipped [dimensionless]."""

FRICTIONS = {"": 0, "position": 2, "velocity": 3}
"""Kinds of an output with friction, and number of its values: what is subtracted below and above, and, for a velocity,
where it rests; a position rests at its previous value."""


@dataclass(frozen=True, eq=False)
class Variables:
    """The lagged signals that terms multiply.

    Parameters
    ----------
    source, lag : ndarray of int, shape (v,)
        0 for the output, otherwise the input's number from 1; and the lag in samples.
    limits : ndarray, shape (v, 2)
        Ends at which each is clipped in products.
    friction : str
        One of `FRICTIONS`: dry friction subtracts a constant from the sum of the terms, and holds the output within it.
    """

    source: IntArray
    lag: IntArray
    limits: Array
    friction: str = ""

    @property
    def n_friction(self) -> int:
        """Values of its friction."""
        return FRICTIONS[self.friction]

    @property
    def ends(self) -> Array:
        """Least and greatest output that was seen, shape (2,)."""
        own = self.limits[self.source == 0][0]
        inner = (own[1] - own[0]) / (1.0 + 2.0 * SIGNAL_MARGIN)
        return own + SIGNAL_MARGIN * inner * np.array([1.0, -1.0])

    def extended_ends(self, share: float) -> Array:
        """Return ends extended by a share of the range, shape (2,).

        Parameters
        ----------
        share : float
            Of the range [dimensionless].

        Returns
        -------
        ndarray, shape (2,)
            Least and greatest output.
        """
        low, high = self.ends
        return np.array([low, high]) + share * (high - low) * np.array([-1.0, 1.0])

    def with_wider_clipping(self) -> "Variables":
        """Return the same signals, clipped `RELEASE_FACTOR` times as far from the middle of their range."""
        middle = self.limits.mean(axis=1, keepdims=True)
        return replace(self, limits=middle + RELEASE_FACTOR * (self.limits - middle))

    @property
    def n_start(self) -> int:
        """Number of first outputs that a run needs."""
        own = self.lag[self.source == 0]
        return int(own.max()) if own.size else 0


def products(variables: Variables, terms: IntArray, u: Array, y: Array) -> Array:
    """Return each term's product of lagged signals, shape (n, k).

    Parameters
    ----------
    terms : ndarray of int, shape (k, 3)
        Variables of each term, followed by -1 if there are fewer than three; -1 stands for 1.
    u : ndarray, shape (n, m)
        Inputs.
    y : ndarray, shape (n,)
        Output.

    Returns
    -------
    ndarray, shape (n, k)
        One column per term.
    """
    out = np.empty((y.size, terms.shape[0]))
    write_products(*lagged_signals(variables, u, y), terms, out)
    return out


@compiled
def write_products(single: Array, held: Array, terms: IntArray, out: Array) -> None:
    """Write the product of each term, row by row.

    Parameters
    ----------
    single, held : ndarray, shape (n, v)
        Variables as they are, for terms of one, and clipped at their ends, for products.
    terms : ndarray of int, shape (k, 3)
        As in `products`.
    out : ndarray, shape (n, p)
        Its first k columns are written.
    """
    for t in range(out.shape[0]):
        for i in range(terms.shape[0]):
            a, b, c = terms[i, 0], terms[i, 1], terms[i, 2]
            if a < 0:
                out[t, i] = 1.0
            elif b < 0:
                out[t, i] = single[t, a]
            elif c < 0:
                out[t, i] = held[t, a] * held[t, b]
            else:
                out[t, i] = held[t, a] * held[t, b] * held[t, c]


def lagged_signals(variables: Variables, u: Array, y: Array) -> tuple[Array, Array]:
    """Return the lagged signals as they are and clipped at their ends, one column each.

    Parameters
    ----------
    u : ndarray, shape (n, m)
        Inputs.
    y : ndarray, shape (n,)
        Output.

    Returns
    -------
    tuple of ndarray, shape (n, v)
        Before the first sample each signal had its first value.
    """
    single = np.empty((y.size, variables.lag.size))
    for v, (source, lag) in enumerate(zip(variables.source, variables.lag, strict=True)):
        series = y if source == 0 else u[:, source - 1]
        early = min(int(lag), y.size)
        single[:early, v], single[early:, v] = series[0], series[: y.size - early]
    return single, np.clip(single, variables.limits[:, 0], variables.limits[:, 1])
