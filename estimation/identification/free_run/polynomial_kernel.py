"""The free run of a polynomial model sample by sample, and how a change of its terms is carried on by its feedback."""

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
    u: Array,
    out: Array,
    slope: Array,
) -> int:
    """Write the output behind its first values, and its slope by its own past; return where it ran away, else -1.

    Parameters
    ----------
    theta : ndarray, shape (k,)
        Coefficient of each term.
    terms : ndarray of int, shape (k, d)
        Variables that a term multiplies; -1 stands for 1.
    source, lag : ndarray of int, shape (v,)
        Of each variable: 0 for the output, else the input's number from 1, and how many samples earlier.
    limits : ndarray, shape (v, 2)
        Ends at which a variable is held in terms of degree two and more.
    ends : ndarray, shape (2,)
        Between which the output is held.
    u : ndarray, shape (n, m)
        Inputs; before the first sample they stood at their first values.
    out : ndarray, shape (n,)
        Holds as many first values as the longest lag of the output; the others are written.
    slope : ndarray, shape (n, l)
        Written: derivative of each output by the l before it.
    """
    n, n_start = out.size, slope.shape[1]
    z, held = limits[:, 0].copy(), limits[:, 0].copy()
    for t in range(n_start, n):
        for v in range(source.size):
            if source[v] == 0:
                z[v] = out[t - lag[v]]
            else:
                z[v] = u[max(t - lag[v], 0), source[v] - 1]
            held[v] = min(max(z[v], limits[v, 0]), limits[v, 1])
        for k in range(n_start):
            slope[t, k] = 0.0
        total = 0.0
        for i in range(terms.shape[0]):
            single = terms.shape[1] < 2 or terms[i, 1] < 0
            value = theta[i]
            for d in range(terms.shape[1]):
                if terms[i, d] >= 0:
                    value *= z[terms[i, d]] if single else held[terms[i, d]]
            total += value
            for d in range(terms.shape[1]):
                v = terms[i, d]
                if v < 0 or source[v] != 0:
                    continue
                if not single and (z[v] < limits[v, 0] or z[v] > limits[v, 1]):
                    continue
                part = theta[i]
                for other in range(terms.shape[1]):
                    if other != d and terms[i, other] >= 0:
                        part *= held[terms[i, other]]
                slope[t, lag[v] - 1] += part
        if not abs(total) < 1e3:
            return t
        if total < ends[0] or total > ends[1]:
            total = min(max(total, ends[0]), ends[1])
            for k in range(n_start):
                slope[t, k] = 0.0
        out[t] = total
    return -1


@compiled
def carry(slope: Array, moved: Array) -> None:
    """Turn the direct effect of values on the output into the whole one: what the output's past passes on is added.

    Parameters
    ----------
    slope : ndarray, shape (n, l)
        As `run_free` writes it.
    moved : ndarray, shape (n, p)
        Direct effects; the first l rows are those of the first values.
    """
    for t in range(slope.shape[1], moved.shape[0]):
        for k in range(slope.shape[1]):
            gain = slope[t, k]
            for j in range(moved.shape[1]):
                moved[t, j] += gain * moved[t - 1 - k, j]
