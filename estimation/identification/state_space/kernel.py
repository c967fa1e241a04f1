"""Loops of a state-space model: its states, and the effect of a push on each of them on every later output."""

from estimation.arrays import Array
from estimation.identification.search.jit import compiled


@compiled
def run_states(a: Array, pushed: Array, start: Array, out: Array) -> None:
    """Fill in the states: ``x[t + 1] = A x[t] + pushed[t]``.

    Parameters
    ----------
    a : ndarray, shape (n, n)
        Transition.
    pushed : ndarray, shape (samples, n)
        What inputs add.
    start : ndarray, shape (n,)
        State at the first sample.
    out : ndarray, shape (samples, n)
        Room for the states; there may be none.
    """
    n = start.size
    if out.shape[0] == 0:
        return
    for i in range(n):
        out[0, i] = start[i]
    for t in range(1, out.shape[0]):
        for i in range(n):
            total = pushed[t - 1, i]
            for j in range(n):
                total += a[i, j] * out[t - 1, j]
            out[t, i] = total


@compiled
def state_responses(a: Array, c: Array, source: Array, room: Array, out: Array) -> None:
    """Fill in the outputs that follow where one series pushes each state in turn.

    Parameters
    ----------
    a : ndarray, shape (n, n)
        Transition.
    c : ndarray, shape (p, n)
        Outputs of states.
    source : ndarray, shape (samples,)
        The series.
    room : ndarray, shape (r, n)
        Zeros, twice as many rows as outputs: now and next.
    out : ndarray, shape (samples, k)
        Room for the outputs: output o of the run in which the source pushes state j stands at ``o n + j``.
    """
    # a row for each output, ``w[t + 1] = w[t] A + source[t] c``, instead of a state for each push; the sums are equal
    n, p = a.shape[0], c.shape[0]
    for t in range(source.size):
        for o in range(p):
            for j in range(n):
                out[t, o * n + j] = room[o, j]
                total = source[t] * c[o, j]
                for i in range(n):
                    total += room[o, i] * a[i, j]
                room[p + o, j] = total
        for o in range(p):
            for j in range(n):
                room[o, j] = room[p + o, j]
