"""Which products a polynomial model gets: orthogonal least squares on the sensitivities of its free run.

Of all products of two and three lagged signals, the one is added whose effect on the free run explains most of the
residual, beyond what the model can already do (orthogonal least squares, Chen, Billings and Luo 1989, on the
sensitivities of the free run instead of regressors of the one-step error). After each, all values are fitted again.
"""

from itertools import combinations_with_replacement

import numpy as np

from estimation.arrays import Array, IntArray
from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.linear_problem import LinearFit
from estimation.identification.free_run.normal_equations import NormalEquations
from estimation.identification.free_run.polynomial_fit import FINAL_STEPS, STEPS, PolynomialFit, Runs, variables_of
from estimation.identification.free_run.polynomial_variables import Variables

MOST_CANDIDATES = 250
"""Products that are compared."""

MOST_TRIED = 4
"""Number of best products that are tried until one reduces the error."""

ROUNDING_SHARE = 1e-12
"""Share of the squared sensitivities below which a direction is rounding."""

LEAST_GAIN = 1e-4
"""Share of the squared error that a term must explain to be added."""


def candidate_terms(variables: Variables) -> IntArray:
    """Return products of two and, if there are not too many, three lagged signals, shape (k, 3)."""
    n = variables.lag.size
    found = [(*pair, -1) for pair in combinations_with_replacement(range(n), 2)]
    cubes = list(combinations_with_replacement(range(n), 3))
    if len(found) + len(cubes) > MOST_CANDIDATES:
        cubes = [cube for cube in cubes if len(set(cube)) == 1 or len({int(variables.source[v]) for v in cube}) == 1]
    return np.array([*found, *cubes][:MOST_CANDIDATES], dtype=np.int64)


def polynomial_of_linear(linear: LinearFit, data: Channels) -> PolynomialFit | None:
    """Return a linear model as a polynomial one, fitted to its free run; None if it diverges.

    Parameters
    ----------
    data : Channels
        Scaled; outputs held back are NaN.
    """
    variables, terms, values = variables_of(linear, data)
    runs = Runs(variables, terms, data)
    return runs.fit(np.concatenate([values, runs.start_values()]), FINAL_STEPS)


def with_best_product(fit: PolynomialFit, pool: IntArray, data: Channels) -> PolynomialFit | None:
    """Return the fit with the product that explains most in addition; None if none does.

    Parameters
    ----------
    pool : ndarray of int, shape (k, 3)
        Products that may be added.
    data : Channels
        Scaled; outputs held back are NaN.
    """
    gains = _gains_of(fit, pool, data)
    if gains is None:
        return None
    for k in np.argsort(-gains)[:MOST_TRIED]:
        if not gains[k] > LEAST_GAIN * fit.cost:
            return None
        terms = np.concatenate([fit.terms, pool[k : k + 1]])
        count = fit.terms.shape[0]
        theta = np.concatenate([fit.theta[:count], [0.0], fit.theta[count:]])
        found = Runs(fit.variables, terms, data).fit(theta, STEPS)
        if found is not None and found.cost < (1.0 - LEAST_GAIN) * fit.cost:
            return found
    return None


def without_term(fit: PolynomialFit, index: int, data: Channels) -> PolynomialFit | None:
    """Return the fit without one of its terms, with the others fitted again."""
    terms = np.delete(fit.terms, index, axis=0)
    return Runs(fit.variables, terms, data).fit(np.delete(fit.theta, index), STEPS)


def _gains_of(fit: PolynomialFit, pool: IntArray, data: Channels) -> Array | None:
    """Return the part of the squared residual that each product explains; None if the fit diverges."""
    count = fit.terms.shape[0]
    every = Runs(fit.variables, np.concatenate([fit.terms, pool]), data)
    equations = NormalEquations(every, Runs(fit.variables, fit.terms, data).ends)
    ran = equations.outputs(np.concatenate([fit.theta[:count], np.zeros(pool.shape[0]), fit.theta[count:]]))
    if ran is None:
        return None
    asked = slice(count, count + pool.shape[0])
    beside, square, right = equations.sums_beside(every.target - ran, asked)
    kept = np.delete(np.arange(square.size), np.arange(square.size)[asked])
    return _gains(beside[:, kept], beside[:, asked], square[asked], right[kept], right[asked])


def _gains(own: Array, shared: Array, square: Array, right: Array, explained: Array) -> Array:
    """Return the part of the squared residual that each candidate explains in addition to present terms, linearised.

    The arguments are products of sensitivities: of the present values with each other and with the candidates, of the
    candidates with themselves, and of both with the residual.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        usable = np.isfinite(square) & (square > 0.0) & np.isfinite(shared).all(axis=0)
        size = np.where(usable, square, 1.0)
        scale = np.sqrt(np.diag(own))
        scale[scale == 0.0] = 1.0
        # directions of the present values that the data do not determine are left out
        powers, directions = np.linalg.eigh(own / np.outer(scale, scale))
        told = powers > ROUNDING_SHARE * powers[-1]
        basis = directions[:, told] / np.sqrt(powers[told]) / scale[:, None]
        shadow = basis.T @ np.where(usable, shared, 0.0)
        power = 1.0 - np.einsum("ij,ij->j", shadow, shadow) / size
        explained = explained - shadow.T @ (basis.T @ right)
    # a candidate that is nearly a sum of present terms would only make values undetermined
    fresh = usable & (power > 1e-6)
    return np.where(fresh, explained, 0.0) ** 2 / np.where(fresh, power * size, 1.0)
