"""Behaviour of models under reordered inputs: whether they stay within bounds, and agree."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from estimation.arrays import Array
from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.polynomial_fit import OUTPUT_MARGIN, PolynomialFit, Runs

WILD_SHARE = 0.003
"""Share of samples at which a model may be clipped if its inputs come in another order; above it, the model is wild."""

MOST_REORDERED, PIECES = 10, (8, 25)
"""Number of other orders of the inputs on which a model is tried, and alternating numbers of pieces."""


def reordered_channels(data: Channels, count: int = MOST_REORDERED) -> Iterator[Channels]:
    """Yield the same channels with pieces of the inputs in other orders, some of them reversed.

    Parameters
    ----------
    data : Channels
        Scaled.
    count : int
        Number of other orders.

    Yields
    ------
    Channels
        Outputs are those of the order that was measured.
    """
    rng = np.random.default_rng(0)
    for k in range(count):
        inputs, cuts = list[Array](), PIECES[k % len(PIECES)]
        for u in data.u:
            pieces = np.array_split(u, cuts)
            turned = [pieces[p][::-1] if rng.random() < 0.5 else pieces[p] for p in rng.permutation(cuts)]
            inputs.append(np.ascontiguousarray(np.concatenate(turned)))
        yield replace(data, u=tuple(inputs))


def is_wild(fit: PolynomialFit, data: Channels) -> bool:
    """Return whether a model keeps leaving the range of its output under reordered inputs.

    Parameters
    ----------
    data : Channels
        Scaled.
    """
    low, high = fit.variables.extended_ends(OUTPUT_MARGIN)
    held, total = 0, 0
    for other in reordered_channels(data):
        ran = Runs(fit.variables, fit.terms, other).outputs(fit.theta)
        if ran is None:
            return True
        held, total = held + int(np.count_nonzero((ran <= low) | (ran >= high))), total + ran.size
    return held > WILD_SHARE * total


def disagreement(fits: Sequence[PolynomialFit], whole: PolynomialFit, data: Channels) -> float:
    """Return the deviation of fits that left out one block each from that of all data, under reordered inputs.

    No output is measured there, so errors common to all fits do not show; but what changes with a block more or less is
    not determined.

    Parameters
    ----------
    fits : sequence of PolynomialFit
        One per block.
    whole : PolynomialFit
        Fit to all data.
    data : Channels
        Scaled.

    Returns
    -------
    float
        Root mean square, over the output's deviation; infinite if one diverges [dimensionless].
    """
    squares = list[float]()
    for other in reordered_channels(data):
        own = Runs(whole.variables, whole.terms, other).outputs(whole.theta)
        for fit in fits:
            ran = Runs(fit.variables, fit.terms, other).outputs(fit.theta)
            if own is None or ran is None:
                return float("inf")
            squares.append(float(np.mean((ran - own) ** 2)))
    return float(np.sqrt(np.mean(squares)))
