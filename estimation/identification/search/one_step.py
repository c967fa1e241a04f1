"""One-step-ahead prediction errors of ``y = B/F u + C/D e`` with exact sensitivities, compiled.

A missing output is replaced by its prediction: the recursion continues, and its error is zero.
"""

import numpy as np

from estimation.arrays import Array, BoolArray, IntArray
from estimation.identification.search.jit import compiled
from estimation.identification.search.response import impulse_response, respond


@compiled
def prediction_errors(
    theta: Array,
    sizes: IntArray,
    tied: bool,
    u: Array,
    y: Array,
    used: BoolArray,
    bounds: IntArray,
    error: Array,
    jacobian: Array,
) -> float:
    """Return the sum of squared prediction errors; fill errors and the derivative of the prediction.

    Parameters
    ----------
    theta : ndarray, shape (p,)
        ``b, f, c, d``, and the initial state of ``B/F`` of each experiment in turn.
    sizes : ndarray of int, shape (6,)
        Free values of b, f, c, d; delay; initial-state values an experiment.
    tied : bool
        Whether ``D = F`` (ARX, ARMAX), d having no values of its own.
    u, y : ndarray, shape (n,)
        Input and output, one experiment after the other.
    used : ndarray of bool, shape (n,)
        Where the output is there.
    bounds : ndarray of int, shape (experiments + 1,)
        Where each experiment begins, and the end.
    error : ndarray, shape (n,)
        Receives the prediction errors; 0 where the output is missing.
    jacobian : ndarray, shape (n, p)
        Receives the derivative of the prediction, minus that of the error.

    Returns
    -------
    float
        Sum of squares.
    """
    n_b, n_f, delay, n_s = sizes[0], sizes[1], sizes[4], sizes[5]
    first = n_b + n_f + sizes[2] + sizes[3]
    pad = max(n_f, n_b + delay, n_s) + 1
    b, f = theta[:n_b], theta[n_b : n_b + n_f]
    cost: float = 0.0
    for e in range(bounds.size - 1):
        part = slice(bounds[e], bounds[e + 1])
        n, own = bounds[e + 1] - bounds[e], first + e * n_s
        signals, noise = np.zeros((3, n + pad)), np.zeros(n)
        n_pulse = impulse_response(f, n, n_s, pad, signals[0])
        respond(b, f, delay, theta[own : own + n_s], u[part], pad, signals, n_pulse, noise)
        # minus the derivative of the output's residual
        for t in range(n):
            noise[t] = y[bounds[e] + t] - noise[t]
            for i in range(theta.size):
                jacobian[bounds[e] + t, i] = 0.0
            for k in range(n_b):
                jacobian[bounds[e] + t, k] = signals[1, pad + t - delay - k]
            for j in range(n_f):
                jacobian[bounds[e] + t, n_b + j] = -signals[2, pad + t - 1 - j]
            if t < n_pulse:
                for k in range(n_s):
                    jacobian[bounds[e] + t, own + k] = signals[0, pad + t - k]
        cost += _whiten(theta, sizes, tied, noise, used[part], error[part], jacobian[part])
    return cost


@compiled
def _whiten(
    theta: Array, sizes: IntArray, tied: bool, noise: Array, used: BoolArray, error: Array, jacobian: Array
) -> float:
    """Turn ``v = C/D e`` and minus its derivative into e and minus its own; return the sum of its squares.

    A sample that is missing is replaced, in v, by what the past says of it.
    """
    n_c = sizes[2]
    at_c = sizes[0] + sizes[1]
    n_ar, at_ar = (sizes[1], sizes[0]) if tied else (sizes[3], at_c + n_c)
    p = theta.size
    deep = max(n_ar, n_c) + 1
    moved_noise, slope = np.zeros((deep, p)), np.zeros(p)
    cost = 0.0
    for t in range(noise.size):
        # the noise expected from its past, and the derivatives of that by the parameters
        expected = 0.0
        slope[:] = 0.0
        for j in range(min(n_ar, t)):
            expected -= theta[at_ar + j] * noise[t - 1 - j]
            slope[at_ar + j] -= noise[t - 1 - j]
            for i in range(p):
                slope[i] -= theta[at_ar + j] * moved_noise[(t - 1 - j) % deep, i]
        for j in range(min(n_c, t)):
            expected += theta[at_c + j] * error[t - 1 - j]
            slope[at_c + j] += error[t - 1 - j]
            for i in range(p):
                slope[i] -= theta[at_c + j] * jacobian[t - 1 - j, i]
        for i in range(p):
            moved_noise[t % deep, i] = -jacobian[t, i] if used[t] else slope[i]
            jacobian[t, i] = slope[i] - moved_noise[t % deep, i]
        if not used[t]:
            noise[t] = expected
        error[t] = noise[t] - expected
        cost += error[t] * error[t]
    return cost
