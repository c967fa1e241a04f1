"""Levenberg-Marquardt on the output-error criterion, compiled: recursion, sensitivities and normal equations in one.

The columns of the Jacobian are shifts of three filtered signals (Ljung, System Identification, section 10.3), so an
iteration over n samples costs three recursions and p (p + 1) / 2 inner products, and stores no Jacobian.
"""

import numpy as np

from estimation.arrays import Array, IntArray
from estimation.identification.search.jit import compiled
from estimation.identification.search.response import impulse_response, respond

CHUNK = 2048
"""Samples whose Jacobian rows are held at once; small enough for the processor's cache."""


@compiled
def stable(f: Array) -> bool:
    """Return whether ``1 + f_1 q^-1 + ...`` has all roots inside the unit circle (Schur-Cohn recursion).

    Parameters
    ----------
    f : ndarray, shape (n,)
        Coefficients behind the leading 1.

    Returns
    -------
    bool
        False, too, where a coefficient is not finite.
    """
    row = f.copy()
    for size in range(row.size, 0, -1):
        reflection = row[size - 1]
        if not abs(reflection) < 1.0:
            return False
        scale = 1.0 / (1.0 - reflection * reflection)
        for i in range(size // 2):
            j = size - 2 - i
            first, last = row[i], row[j]
            row[i] = (first - reflection * last) * scale
            row[j] = (last - reflection * first) * scale
    return True


@compiled
def solve_damped(gram: Array, gradient: Array, damping: float, step: Array, factor: Array) -> bool:
    """Solve ``(H + damping diag H) step = -gradient`` by Cholesky, columns scaled; False if not definite.

    Parameters
    ----------
    gram : ndarray, shape (p, p)
        ``H``; the lower triangle is read.
    gradient : ndarray, shape (p,)
        Of half the cost.
    damping : float
        Marquardt's factor [dimensionless].
    step : ndarray, shape (p,)
        Receives the solution.
    factor : ndarray, shape (p, p)
        Workspace.
    """
    p = gradient.size
    for i in range(p):
        scale_i = np.sqrt(gram[i, i]) if gram[i, i] > 0.0 else 1.0
        for j in range(i + 1):
            scale_j = np.sqrt(gram[j, j]) if gram[j, j] > 0.0 else 1.0
            total = gram[i, j] / (scale_i * scale_j)
            if i == j:
                total = 1.0 + damping
            for k in range(j):
                total -= factor[i, k] * factor[j, k]
            if i == j:
                if not total > 0.0:
                    return False
                factor[i, i] = np.sqrt(total)
            else:
                factor[i, j] = total / factor[j, j]
    for i in range(p):
        scale_i = np.sqrt(gram[i, i]) if gram[i, i] > 0.0 else 1.0
        total = -gradient[i] / scale_i
        for k in range(i):
            total -= factor[i, k] * step[k]
        step[i] = total / factor[i, i]
    for i in range(p - 1, -1, -1):
        total = step[i]
        for k in range(i + 1, p):
            total -= factor[k, i] * step[k]
        step[i] = total / factor[i, i]
    for i in range(p):
        if gram[i, i] > 0.0:
            step[i] /= np.sqrt(gram[i, i])
    return True


@compiled
def normal_equations(
    theta: Array,
    sizes: IntArray,
    u: Array,
    y: Array,
    weight: Array,
    bounds: IntArray,
    gram: Array,
    gradient: Array,
) -> float:
    """Return the sum of squared residuals; fill ``J'J`` and half its gradient.

    Parameters
    ----------
    theta : ndarray, shape (p,)
        Numerator, denominator behind its 1, and the initial state of each experiment in turn.
    sizes : ndarray of int, shape (4,)
        Numerator, denominator, delay, initial-state values an experiment.
    u, y : ndarray, shape (n,)
        Input and output, one experiment after the other.
    weight : ndarray, shape (n,)
        1 where an output counts, 0 where it is missing.
    bounds : ndarray of int, shape (experiments + 1,)
        Where each experiment begins, and the end.
    gram : ndarray, shape (p, p)
        Receives ``J'J``, lower triangle.
    gradient : ndarray, shape (p,)
        Receives ``-J'r``.

    Returns
    -------
    float
        Sum of squared residuals.
    """
    n_b, n_f, delay, n_s = sizes[0], sizes[1], sizes[2], sizes[3]
    n_main = n_b + n_f
    pad = max(n_f, n_b + delay, n_s) + 1
    longest = 0
    for e in range(bounds.size - 1):
        longest = max(longest, bounds[e + 1] - bounds[e])
    signals, simulated = np.zeros((3, longest + pad)), np.zeros(longest)
    columns = np.empty((n_main + n_s + 1, CHUNK))
    gram[:] = 0.0
    gradient[:] = 0.0
    cost = 0.0
    b, f = theta[:n_b], theta[n_b:n_main]
    for e in range(bounds.size - 1):
        begin, n = bounds[e], bounds[e + 1] - bounds[e]
        first_s = n_main + e * n_s
        n_pulse = impulse_response(f, n, n_s, pad, signals[0])
        state = theta[first_s : first_s + n_s]
        respond(b, f, delay, state, u[begin : begin + n], pad, signals, n_pulse, simulated)
        for lower in range(0, n, CHUNK):
            m = min(CHUNK, n - lower)
            p = n_main + n_s if lower < n_pulse else n_main
            part = weight[begin + lower : begin + lower + m]
            first = pad + lower
            for k in range(n_b):
                for t in range(m):
                    columns[k, t] = part[t] * signals[1, first + t - delay - k]
            for j in range(n_f):
                for t in range(m):
                    columns[n_b + j, t] = -part[t] * signals[2, first + t - 1 - j]
            for k in range(p - n_main):
                for t in range(m):
                    columns[n_main + k, t] = part[t] * signals[0, first + t - k] if lower + t < n_pulse else 0.0
            for t in range(m):
                columns[p, t] = part[t] * (y[begin + lower + t] - simulated[lower + t])
            cost += _add_products(columns, p, m, n_main, first_s, gram, gradient)
    return cost


@compiled
def _add_products(columns: Array, p: int, m: int, n_main: int, first_s: int, gram: Array, gradient: Array) -> float:
    """Add products of p columns of m samples to ``J'J`` and ``-J'r``, and return that of the last, r, with itself."""
    for i in range(p + 1):
        row = i if i < n_main else first_s + i - n_main
        for j in range(i + 1):
            total = 0.0
            for t in range(m):
                total += columns[i, t] * columns[j, t]
            column = j if j < n_main else first_s + j - n_main
            if j == p:
                return total
            if i == p:
                gradient[column] -= total
            else:
                gram[row, column] += total
    return 0.0


@compiled
def descend(
    start: Array,
    sizes: IntArray,
    u: Array,
    y: Array,
    weight: Array,
    bounds: IntArray,
    most_steps: int,
    tolerance: float,
) -> tuple[float, Array, Array, bool]:
    """Minimise the output-error criterion from one start.

    A step that leaves the unit circle is rejected like one that raises the cost, and the next step is shorter. So
    stability needs no bound, at which an optimum could get stuck.

    Parameters
    ----------
    start : ndarray, shape (p,)
        As `normal_equations` takes it; stable.
    sizes : ndarray of int, shape (4,)
        As `normal_equations` takes it.
    u, y, weight : ndarray, shape (n,)
        Likewise.
    bounds : ndarray of int, shape (experiments + 1,)
        Likewise.
    most_steps : int
        Evaluations at most.
    tolerance : float
        Share of the cost that a further step may still promise at the end [dimensionless].

    Returns
    -------
    cost : float
        Sum of squared residuals.
    theta : ndarray, shape (p,)
        Where it is least.
    gram : ndarray, shape (p, p)
        ``J'J`` there, lower triangle.
    converged : bool
        Whether the iteration ended by itself.
    """
    p = start.size
    theta, trial, step = start.copy(), start.copy(), np.zeros(p)
    gram, gradient, factor = np.zeros((p, p)), np.zeros(p), np.zeros((p, p))
    new_gram, new_gradient = np.zeros((p, p)), np.zeros(p)
    n_b, n_f = sizes[0], sizes[1]
    cost = normal_equations(theta, sizes, u, y, weight, bounds, gram, gradient)
    power = 0.0
    for t in range(y.size):
        power += weight[t] * y[t] * y[t]
    least = 1e-30 * power
    damping = 1e-3
    for _ in range(most_steps):
        if cost <= least:
            return cost, theta, gram, True
        if not solve_damped(gram, gradient, damping, step, factor):
            damping = max(10.0 * damping, 1e-12)
            continue
        slope, curvature = 0.0, 0.0
        for i in range(p):
            slope -= gradient[i] * step[i]
            curvature += damping * gram[i, i] * step[i] * step[i]
        # H step = -g - damping D step, so the quadratic model of half the cost falls by (slope + curvature) / 2
        promised = slope + curvature
        if promised <= tolerance * cost and (damping <= 1e-2 or promised <= 1e-15 * cost):
            return cost, theta, gram, True
        for i in range(p):
            trial[i] = theta[i] + step[i]
        new_cost = np.inf
        if stable(trial[n_b : n_b + n_f]):
            new_cost = normal_equations(trial, sizes, u, y, weight, bounds, new_gram, new_gradient)
        if new_cost < cost:
            ratio = (cost - new_cost) / promised
            cost = new_cost
            theta, trial = trial, theta
            gram, new_gram = new_gram, gram
            gradient, new_gradient = new_gradient, gradient
            if ratio > 0.75:
                damping = max(0.1 * damping, 1e-14)
            elif ratio < 0.25:
                damping *= 4.0
        else:
            if promised <= 1e-14 * cost:
                return cost, theta, gram, True
            damping = max(10.0 * damping, 1e-8)
            if damping > 1e14:
                return cost, theta, gram, False
    return cost, theta, gram, False
