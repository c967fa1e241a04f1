"""Runs a series through a discrete transfer function, with the same recursion and bits as `scipy.signal.lfilter`.

scipy.signal imports scipy.stats, and the import takes longer than the fit of a model.
"""

import numpy as np
from numpy.typing import ArrayLike

from estimation.arrays import Array
from plant.compiled.native.loops import natively_compiled


def filtered(numerator: ArrayLike, denominator: ArrayLike, series: ArrayLike, state: ArrayLike | None = None) -> Array:
    """Return the response of a transfer function to a series.

    Parameters
    ----------
    numerator : array_like, shape (n_b,)
        Coefficients of ``q^0, q^-1, ...``.
    denominator : array_like, shape (n_f,)
        Monic, coefficients of ``q^0, q^-1, ...``.
    series : array_like, shape (n,)
        Input.
    state : array_like, shape (max(n_b, n_f) - 1,), optional
        State before the first sample, of the observer form; rest unless told.

    Returns
    -------
    ndarray, shape (n,)
        Output.

    Examples
    --------
    >>> filtered([1.0], [1.0, -0.5], [1.0, 0.0, 0.0]).tolist()
    [1.0, 0.5, 0.25]
    """
    b, f = (np.array(values, dtype=np.float64) for values in (numerator, denominator))
    order = max(b.size, f.size, 2) - 1
    z = np.zeros(order)
    if state is not None:
        z[: np.size(state)] = state
    u = np.array(series, dtype=np.float64)
    _run(np.pad(b, (0, order + 1 - b.size)), np.pad(f, (0, order + 1 - f.size)), u, z)
    return u


@natively_compiled()
def _run(b: Array, f: Array, u: Array, z: Array) -> None:
    """Write the output over the input (transposed direct form II); the state follows.

    Parameters
    ----------
    b, f : ndarray, shape (order + 1,)
        Coefficients.
    u : ndarray, shape (n,)
        Input, receives the output.
    z : ndarray, shape (order,)
        State.
    """
    last = z.size - 1
    for k in range(u.size):
        now = u[k]
        out = z[0] + b[0] * now
        for i in range(last):
            z[i] = z[i + 1] + now * b[i + 1] - out * f[i + 1]
        z[last] = now * b[last + 1] - out * f[last + 1]
        u[k] = out
