"""The output-error criterion on a periodogram summed into bands, compiled: microseconds for each candidate.

With input power ``P`` and cross spectrum ``C`` of each band, the criterion is ``sum P |B/F - C/P|^2`` plus a constant.
It neglects the initial state and changes within a band. So it only ranks and improves starts.
"""

import numpy as np

from estimation.arrays import Array, ComplexArray
from estimation.identification.search.descent import solve_damped, stable
from estimation.identification.search.jit import compiled


@compiled
def explained_power(
    denominators: Array, n_b: int, delay: int, omega: Array, power: Array, cross: ComplexArray
) -> tuple[Array, Array]:
    """Return the output power that the best numerator explains for each denominator, and that numerator.

    Parameters
    ----------
    denominators : ndarray, shape (m, n_f)
        Coefficients behind the leading 1, one candidate a row.
    n_b, delay : int
        Numerator coefficients and their dead time [samples].
    omega : ndarray, shape (k,)
        Frequency of each band [rad/sample].
    power : ndarray, shape (k,)
        Input power of each band.
    cross : ndarray of complex, shape (k,)
        Output times conjugate input, summed over each band.

    Returns
    -------
    explained : ndarray, shape (m,)
        Power [output unit squared].
    numerators : ndarray, shape (m, n_b)
        The coefficients that explain it.
    """
    m, n_f, k_bands = denominators.shape[0], denominators.shape[1], omega.size
    n_powers = max(n_f, n_b + delay) + 1
    shifts = np.empty((k_bands, n_powers), np.complex128)
    for k in range(k_bands):
        for i in range(n_powers):
            shifts[k, i] = np.exp(-1j * omega[k] * i)
    explained = np.zeros(m)
    numerators = np.zeros((m, n_b))
    terms, target = np.zeros(n_b), np.zeros(n_b)
    factor, values = np.zeros((n_b, n_b)), np.zeros(n_b)
    for row in range(m):
        terms[:] = 0.0
        target[:] = 0.0
        for k in range(k_bands):
            value = 1.0 + 0.0j
            for j in range(n_f):
                value += denominators[row, j] * shifts[k, j + 1]
            # a pole on the unit circle at a band's frequency would cause a division by zero
            inverse = np.conj(value) / max(value.real * value.real + value.imag * value.imag, 1e-300)
            weight = power[k] * (inverse.real * inverse.real + inverse.imag * inverse.imag)
            seen = inverse * np.conj(cross[k])
            for i in range(n_b):
                terms[i] += weight * shifts[k, i].real
                phase = shifts[k, delay + i]
                target[i] += seen.real * phase.real - seen.imag * phase.imag
        # a band-limited input makes the Gram matrix nearly singular; the ridge is too small to affect the ranking
        for i in range(n_b):
            for j in range(i + 1):
                total = terms[i - j] + (1e-12 * terms[0] if i == j else 0.0)
                for q in range(j):
                    total -= factor[i, q] * factor[j, q]
                if i == j:
                    factor[i, i] = np.sqrt(max(total, 1e-13 * terms[0]))
                else:
                    factor[i, j] = total / factor[j, j]
        for i in range(n_b):
            total = target[i]
            for q in range(i):
                total -= factor[i, q] * values[q]
            values[i] = total / factor[i, i]
            explained[row] += values[i] * values[i]
        for i in range(n_b - 1, -1, -1):
            total = values[i]
            for q in range(i + 1, n_b):
                total -= factor[q, i] * values[q]
            values[i] = total / factor[i, i]
        numerators[row] = values
    return explained, numerators


@compiled
def _banded_normal_equations(
    theta: Array,
    n_b: int,
    n_f: int,
    delay: int,
    shifts: ComplexArray,
    root_power: Array,
    wanted: ComplexArray,
    gram: Array,
    gradient: Array,
) -> float:
    """Return ``sum |root_power B/F - wanted|^2``; fill ``J'J`` and minus ``J'r``, J'r the descent direction."""
    p = n_b + n_f
    columns = np.empty(p, np.complex128)
    gram[:] = 0.0
    gradient[:] = 0.0
    cost = 0.0
    for k in range(root_power.size):
        value = 1.0 + 0.0j
        for j in range(n_f):
            value += theta[n_b + j] * shifts[k, j + 1]
        size = max(value.real * value.real + value.imag * value.imag, 1e-300)
        value = np.conj(value) / size
        inverse = root_power[k] * value
        response = 0.0 + 0.0j
        for i in range(n_b):
            columns[i] = inverse * shifts[k, delay + i]
            response += theta[i] * columns[i]
        error = wanted[k] - response
        slope = response * value
        for j in range(n_f):
            columns[n_b + j] = -slope * shifts[k, j + 1]
        cost += error.real * error.real + error.imag * error.imag
        for i in range(p):
            gradient[i] -= columns[i].real * error.real + columns[i].imag * error.imag
            for j in range(i + 1):
                gram[i, j] += columns[i].real * columns[j].real + columns[i].imag * columns[j].imag
    return cost


@compiled
def refine_banded(
    starts: Array,
    n_b: int,
    delay: int,
    omega: Array,
    power: Array,
    cross: ComplexArray,
    most_steps: int,
) -> tuple[Array, Array]:
    """Improve starts by Levenberg-Marquardt on the banded criterion.

    Parameters
    ----------
    starts : ndarray, shape (m, n_b + n_f)
        Numerator and denominator behind its 1, one start a row; stable.
    n_b, delay : int
        As `explained_power` takes them.
    omega : ndarray, shape (k,)
        Frequency of each band [rad/sample].
    power : ndarray, shape (k,)
        Input power of each band, positive.
    cross : ndarray of complex, shape (k,)
        Output times conjugate input, summed over each band.

    Returns
    -------
    cost : ndarray, shape (m,)
        Banded criterion less its constant [output unit squared].
    refined : ndarray, shape (m, n_b + n_f)
        Stable.
    """
    m, p, n_bands = starts.shape[0], starts.shape[1], omega.size
    n_f = p - n_b
    n_powers = max(n_f, n_b + delay) + 1
    shifts = np.empty((n_bands, n_powers), np.complex128)
    root_power, wanted = np.sqrt(power), np.empty(n_bands, np.complex128)
    for k in range(n_bands):
        wanted[k] = cross[k] / root_power[k]
        for i in range(n_powers):
            shifts[k, i] = np.exp(-1j * omega[k] * i)
    costs, refined = np.zeros(m), starts.copy()
    gram, gradient, step, factor = np.zeros((p, p)), np.zeros(p), np.zeros(p), np.zeros((p, p))
    new_gram, new_gradient = np.zeros((p, p)), np.zeros(p)
    for row in range(m):
        theta = starts[row].copy()
        cost = _banded_normal_equations(theta, n_b, n_f, delay, shifts, root_power, wanted, gram, gradient)
        damping = 1e-3
        for _ in range(most_steps):
            new_cost, promised = np.inf, 0.0
            if solve_damped(gram, gradient, damping, step, factor):
                for i in range(p):
                    promised += step[i] * (damping * gram[i, i] * step[i] - gradient[i])
                if promised <= 1e-7 * cost:
                    break
                trial = theta + step
                if stable(trial[n_b:]):
                    new_cost = _banded_normal_equations(
                        trial, n_b, n_f, delay, shifts, root_power, wanted, new_gram, new_gradient
                    )
            if new_cost < cost:
                damping = max(0.1 * damping, 1e-12) if cost - new_cost > 0.5 * promised else 2.0 * damping
                cost, theta = new_cost, theta + step
                gram[:] = new_gram
                gradient[:] = new_gradient
            else:
                damping = max(10.0 * damping, 1e-8)
                if damping > 1e9:
                    break
        costs[row], refined[row] = cost, theta
    return costs, refined
