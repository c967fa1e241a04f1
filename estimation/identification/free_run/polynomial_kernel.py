"""The free run of a polynomial model sample by sample, and how a change of its terms is carried on by its feedback."""

import numpy as np

from estimation.arrays import Array, IntArray
from estimation.identification.search.jit import compiled


@compiled
def run_free(
    theta: Array,
    terms: IntArray,
    source: IntArray,
    lag: IntArray,
    limits: Array,
    ends: Array,
    begin: int,
    u: Array,
    out: Array,
    slope: Array,
    rub: Array,
) -> int:
    """Write the output from a sample on, and its slope by its own past; return where it ran away, else -1.

    Parameters
    ----------
    theta : ndarray, shape (k,)
        Coefficient of each term.
    terms : ndarray of int, shape (k, 3)
        Variables that a term multiplies, ahead of as many -1 as there are fewer than three; -1 stands for 1.
    source, lag : ndarray of int, shape (v,)
        Of each variable: 0 for the output, else the input's number from 1, and how many samples earlier.
    limits : ndarray, shape (v, 2)
        Ends at which a variable is held in terms of degree two and more.
    ends : ndarray, shape (2,)
        Between which the output is held.
    begin : int
        First sample that is written; not less than the longest lag of the output.
    u : ndarray, shape (n, m)
        Inputs; before the first sample they stood at their first values.
    out : ndarray, shape (n,)
        Holds outputs before that sample; the others are written.
    slope : ndarray, shape (s, l)
        Written: derivative of each output by the l before it, in n rows, or none where no slopes are wanted; where the
        output rubs, the last column is 1 where friction holds it back from above, -1 from below, and 0 where it holds.
    rub : ndarray, shape (f,)
        What friction takes off the output below and above where it rests: at the third value, or of two where it was a
        sample before; there it stays unless more than that moves it. None where nothing rubs.
    """
    n, n_start, sloped = out.size, slope.shape[1], slope.shape[0] > 0
    if rub.size > 0:
        n_start -= 1
    z, held = limits[:, 0].copy(), limits[:, 0].copy()
    # where a slope by each variable goes: one place more takes those by inputs, and by outputs that are held
    single, inner, rates = source.copy(), source.copy(), np.zeros(n_start + 1)
    for v in range(source.size):
        single[v] = lag[v] - 1 if source[v] == 0 else n_start
    for t in range(begin, n):
        for v in range(source.size):
            if source[v] == 0:
                z[v] = out[t - lag[v]]
            else:
                z[v] = u[max(t - lag[v], 0), source[v] - 1]
            held[v] = min(max(z[v], limits[v, 0]), limits[v, 1])
            inner[v] = n_start if z[v] < limits[v, 0] or z[v] > limits[v, 1] else single[v]
        rates[:] = 0.0
        total = 0.0
        for i in range(terms.shape[0]):
            a, b, c, value = terms[i, 0], terms[i, 1], terms[i, 2], theta[i]
            if not sloped:
                if a < 0:
                    total += value
                elif b < 0:
                    total += value * z[a]
                elif c < 0:
                    total += value * held[a] * held[b]
                else:
                    total += value * held[a] * (held[b] * held[c])
                continue
            if a < 0:
                total += value
            elif b < 0:
                total += value * z[a]
                rates[single[a]] += value
            elif c < 0:
                total += value * held[a] * held[b]
                rates[inner[a]] += value * held[b]
                rates[inner[b]] += value * held[a]
            else:
                first, last = value * held[a], held[b] * held[c]
                total += first * last
                rates[inner[a]] += value * last
                rates[inner[b]] += first * held[c]
                rates[inner[c]] += first * held[b]
        if not abs(total) < 1e3:
            return t
        if rub.size > 0:
            stay = out[t - 1]
            if rub.size > 2:
                stay = rub[2]
            side = 0.0
            if total - stay > rub[1]:
                total -= rub[1]
                side = 1.0
            elif stay - total > rub[0]:
                total += rub[0]
                side = -1.0
            else:
                total = stay
                rates[:] = 0.0
                if rub.size == 2:
                    rates[0] = 1.0
            if sloped:
                slope[t, n_start] = side
        if total < ends[0] or total > ends[1]:
            total = min(max(total, ends[0]), ends[1])
            rates[:] = 0.0
        if sloped:
            for k in range(n_start):
                slope[t, k] = rates[k]
        out[t] = total
    return -1


@compiled
def write_products(single: Array, held: Array, terms: IntArray, out: Array) -> None:
    """Write the product of each term, row by row.

    Parameters
    ----------
    single, held : ndarray, shape (n, v)
        Variables as they are, for terms of one, and held at their ends, for products.
    terms : ndarray of int, shape (k, 3)
        As `run_free` takes them.
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


@compiled
def carry(slope: Array, begin: int, moved: Array) -> None:
    """Turn the direct effect of values on the output into the whole one: what the output's past passes on is added.

    Parameters
    ----------
    slope : ndarray, shape (n, l)
        As `run_free` writes it.
    begin : int
        As `run_free` takes it.
    moved : ndarray, shape (n, p)
        Direct effects; rows before that sample are those of the first values.
    """
    for t in range(begin, moved.shape[0]):
        for k in range(slope.shape[1]):
            gain = slope[t, k]
            for j in range(moved.shape[1]):
                moved[t, j] += gain * moved[t - 1 - k, j]
