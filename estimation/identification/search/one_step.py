"""One-step-ahead prediction errors of ``y = B/F u + C/D e`` with exact sensitivities, compiled.

A missing output is replaced by its prediction, so the recursion goes on and the error there is no error.
"""

import numpy as np

from estimation.arrays import Array, BoolArray, IntArray
from estimation.identification.search.jit import compiled


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
    n_b, n_f, n_c, n_d, delay, n_s = sizes[0], sizes[1], sizes[2], sizes[3], sizes[4], sizes[5]
    p = theta.size
    at_c, at_d = n_b + n_f, n_b + n_f + n_c
    first = at_d + n_d
    n_ar = n_f if tied else n_d
    at_ar = n_b if tied else at_d
    deep = max(n_ar, n_c) + 1
    cost: float = 0.0
    for e in range(bounds.size - 1):
        begin, n = bounds[e], bounds[e + 1] - bounds[e]
        own = first + e * n_s
        pad = max(n_f, n_b + delay, n_s) + 1
        fu, fw, pulse = np.zeros(n + pad), np.zeros(n + pad), np.zeros(n + pad)
        noise, moved_noise = np.zeros(deep), np.zeros((deep, p))
        past, moved_past = np.zeros(deep), np.zeros((deep, p))
        slope = np.zeros(p)
        for t in range(n):
            value, kick, simulated = u[begin + t], 1.0 if t == 0 else 0.0, 0.0
            for j in range(n_f):
                value -= theta[n_b + j] * fu[pad + t - 1 - j]
                kick -= theta[n_b + j] * pulse[pad + t - 1 - j]
            fu[pad + t], pulse[pad + t] = value, kick
            for k in range(n_b):
                simulated += theta[k] * fu[pad + t - delay - k]
            for k in range(n_s):
                simulated += theta[own + k] * pulse[pad + t - k]
            value = simulated
            for j in range(n_f):
                value -= theta[n_b + j] * fw[pad + t - 1 - j]
            fw[pad + t] = value
            # what the past says of the noise now, and how that moves with the parameters
            expected = 0.0
            slope[:] = 0.0
            for j in range(n_ar):
                row = (t - 1 - j) % deep
                if t - 1 - j >= 0:
                    expected -= theta[at_ar + j] * noise[row]
                    slope[at_ar + j] -= noise[row]
                    for i in range(p):
                        slope[i] -= theta[at_ar + j] * moved_noise[row, i]
            for j in range(n_c):
                row = (t - 1 - j) % deep
                if t - 1 - j >= 0:
                    expected += theta[at_c + j] * past[row]
                    slope[at_c + j] += past[row]
                    for i in range(p):
                        slope[i] += theta[at_c + j] * moved_past[row, i]
            row = t % deep
            if used[begin + t]:
                noise[row] = y[begin + t] - simulated
                past[row] = noise[row] - expected
                for i in range(p):
                    moved_noise[row, i] = 0.0
                for k in range(n_b):
                    moved_noise[row, k] = -fu[pad + t - delay - k]
                for j in range(n_f):
                    moved_noise[row, n_b + j] = fw[pad + t - 1 - j]
                for k in range(n_s):
                    moved_noise[row, own + k] = -pulse[pad + t - k]
                for i in range(p):
                    moved_past[row, i] = moved_noise[row, i] - slope[i]
            else:
                noise[row], past[row] = expected, 0.0
                for i in range(p):
                    moved_noise[row, i] = slope[i]
                    moved_past[row, i] = 0.0
            error[begin + t] = past[row]
            for i in range(p):
                jacobian[begin + t, i] = -moved_past[row, i]
            cost += float(error[begin + t]) ** 2
    return cost
