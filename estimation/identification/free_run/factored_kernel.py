"""The free run of a polynomial by monomials of past outputs, whose factors the inputs give, and its sensitivities."""

import numpy as np

from estimation.arrays import Array, IntArray
from estimation.identification.search.jit import compiled


@compiled
def output_under_friction(total: float, before: float, rub: Array) -> tuple[float, float]:
    """Return an output under friction, and its direction: 1 up, -1 down, 0 where friction holds it.

    Parameters
    ----------
    total : float
        Sum of the terms [dimensionless].
    before : float
        The previous output [dimensionless].
    rub : ndarray, shape (f,)
        What friction subtracts below and above the resting place, which is the third value, or of two values the
        previous output; the output stays there unless more than that moves it.

    Returns
    -------
    tuple of float
        The output [dimensionless], and its direction [dimensionless].
    """
    stay = before
    if rub.size > 2:
        stay = rub[2]
    if total - stay > rub[1]:
        return total - rub[1], 1.0
    if stay - total > rub[0]:
        return total + rub[0], -1.0
    return stay, 0.0


@compiled
def run_factored(
    share: Array,
    parent: IntArray,
    factor: IntArray,
    lag: IntArray,
    limits: Array,
    ends: Array,
    begin: int,
    rub: Array,
    out: Array,
) -> int:
    """Write the output from a sample on; return where it diverged, otherwise -1.

    Parameters
    ----------
    share : ndarray, shape (n, m)
        Factors of each monomial of past outputs; the first monomial is 1.
    parent, factor : ndarray of int, shape (m,)
        A monomial is an earlier one times a past output: the first values of the latter are used as they are, the
        others are clipped at their ends.
    lag : ndarray of int, shape (l,)
        Of the past outputs [samples].
    limits : ndarray, shape (l, 2)
        Ends at which they are clipped in products.
    ends : ndarray, shape (2,)
        Ends at which the output is clipped.
    begin : int
        First sample that is written; at least the longest lag.
    rub : ndarray, shape (f,)
        For `output_under_friction`; empty without friction.
    out : ndarray, shape (n,)
        Contains outputs before that sample; the others are written.
    """
    own = lag.size
    past, made = np.zeros(2 * own), np.zeros(parent.size)
    made[0] = 1.0
    for t in range(begin, out.size):
        for s in range(own):
            past[s] = out[t - lag[s]]
            past[own + s] = min(max(past[s], limits[s, 0]), limits[s, 1])
        total = share[t, 0]
        for j in range(1, parent.size):
            made[j] = made[parent[j]] * past[factor[j]]
            total += share[t, j] * made[j]
        if not abs(total) < 1e3:
            return t
        if rub.size > 0:
            total, _ = output_under_friction(total, out[t - 1], rub)
        out[t] = min(max(total, ends[0]), ends[1])
    return -1


@compiled
def slopes_of(
    share: Array,
    parent: IntArray,
    factor: IntArray,
    lag: IntArray,
    limits: Array,
    ends: Array,
    begin: int,
    rub: Array,
    out: Array,
    monomials: Array,
    slope: Array,
) -> None:
    """Write monomials of past outputs, and the dependence of each output on those before it.

    Parameters
    ----------
    share : ndarray, shape (n, m)
        As in `run_factored`, like all before ``out``.
    parent, factor : ndarray of int, shape (m,)
        Likewise.
    lag : ndarray of int, shape (l,)
        Likewise [samples].
    limits : ndarray, shape (l, 2)
        Likewise.
    ends : ndarray, shape (2,)
        Likewise.
    begin : int
        First sample that was run.
    rub : ndarray, shape (f,)
        Likewise.
    out : ndarray, shape (n,)
        Result of `run_factored`.
    monomials : ndarray, shape (n, m)
        Written.
    slope : ndarray, shape (n, k)
        Written: derivative of each output by the k before it; with friction by k - 1, and the last column is the
        direction of motion from `output_under_friction`.
    """
    own, count = lag.size, parent.size
    past, adjoint, effect = np.zeros(2 * own), np.zeros(count), np.zeros(2 * own)
    for t in range(begin, out.size):
        for s in range(own):
            past[s] = out[t - lag[s]]
            past[own + s] = min(max(past[s], limits[s, 0]), limits[s, 1])
        effect[:] = 0.0
        monomials[t, 0] = 1.0
        total = share[t, 0]
        for j in range(1, count):
            monomials[t, j] = monomials[t, parent[j]] * past[factor[j]]
            total += share[t, j] * monomials[t, j]
            adjoint[j] = share[t, j]
        for i in range(1, count):
            j = count - i
            adjoint[parent[j]] += adjoint[j] * past[factor[j]]
            effect[factor[j]] += adjoint[j] * monomials[t, parent[j]]
        slope[t, :] = 0.0
        for s in range(own):
            slope[t, lag[s] - 1] = effect[s]
            if limits[s, 0] <= past[s] and past[s] <= limits[s, 1]:
                slope[t, lag[s] - 1] += effect[own + s]
        if rub.size > 0:
            total, side = output_under_friction(total, out[t - 1], rub)
            if side == 0.0:
                slope[t, :] = 0.0
                if rub.size == 2:
                    slope[t, 0] = 1.0
            if total < ends[0] or total > ends[1]:
                slope[t, :] = 0.0
            slope[t, slope.shape[1] - 1] = side
        elif total < ends[0] or total > ends[1]:
            slope[t, :] = 0.0


@compiled
def write_own(
    monomials: Array, inputs: Array, place: IntArray, column: IntArray, slope: Array, n_rub: int, rows: Array
) -> None:
    """Write the derivatives of some samples by coefficients and friction, for constant past outputs.

    Parameters
    ----------
    monomials : ndarray, shape (r, m)
        From `slopes_of`.
    inputs : ndarray, shape (r, i)
        Monomials of inputs.
    place, column : ndarray of int, shape (terms,)
        Monomial of past outputs and monomial of inputs of each term.
    slope : ndarray, shape (r, k)
        From `slopes_of`.
    n_rub : int
        Number of the friction's values, which take the last columns.
    rows : ndarray, shape (r, p)
        Written.
    """
    values, last = rows.shape[1], slope.shape[1] - 1
    for t in range(rows.shape[0]):
        rows[t, :] = 0.0
        slips = 1.0
        if n_rub > 0:
            slips = abs(slope[t, last])
        for i in range(place.size):
            rows[t, i] = slips * monomials[t, place[i]] * inputs[t, column[i]]
        if n_rub > 0:
            if slope[t, last] < 0.0:
                rows[t, values - n_rub] = 1.0
            elif slope[t, last] > 0.0:
                rows[t, values - n_rub + 1] = -1.0
            elif n_rub > 2:
                rows[t, values - 1] = 1.0


@compiled
def pass_on(slope: Array, depth: int, rows: Array) -> None:
    """Add the effect of earlier outputs to the derivatives of each output.

    Parameters
    ----------
    slope : ndarray, shape (r, k)
        From `slopes_of`.
    depth : int
        Number of earlier outputs on which each one depends.
    rows : ndarray, shape (depth + r, p)
        Derivatives of the outputs before the first sample; below them those of `write_own`, which are added to.
    """
    values = rows.shape[1]
    # the row is built in an array of its own, so that the sums below vectorise
    now = np.zeros(values)
    for t in range(slope.shape[0]):
        r = depth + t
        now[:] = rows[r]
        for k in range(depth):
            gain = slope[t, k]
            before = rows[r - 1 - k]
            for j in range(values):
                now[j] += gain * before[j]
        rows[r, :] = now
