"""Which products a polynomial model is given: orthogonal least squares on the sensitivities of its free run.

Of all products of two and three lagged signals, the one is added whose effect on the free run explains most of its
residual, beside all that the model can do already (orthogonal least squares, Chen, Billings and Luo 1989, on the
sensitivities of the free run instead of regressors of the one-step error). After each, all values are fitted anew.
"""

from itertools import combinations_with_replacement

import numpy as np

from estimation.arrays import Array, IntArray
from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.linear_fit import LinearFit
from estimation.identification.free_run.polynomial_fit import FINAL_STEPS, STEPS, PolynomialFit, Runs, variables_of
from estimation.identification.free_run.polynomial_variables import Variables

MOST_CANDIDATES = 250
"""Products that are compared."""

TRIED = 4
"""Of the best products, how many are tried until one lowers the error."""

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


def begun(linear: LinearFit, data: Channels) -> PolynomialFit | None:
    """Return a linear model as a polynomial one, fitted to its free run; None where it runs away.

    Parameters
    ----------
    data : Channels
        Scaled; outputs held back are NaN.
    """
    variables, terms, values = variables_of(linear, data)
    runs = Runs(variables, terms, data)
    return runs.fit(np.concatenate([values, runs.start_values()]), FINAL_STEPS)


def one_more(fit: PolynomialFit, pool: IntArray, data: Channels) -> PolynomialFit | None:
    """Return the fit with the product that explains most beside those that are there; None where none does.

    Parameters
    ----------
    pool : ndarray of int, shape (k, 3)
        Products that may be added.
    data : Channels
        Scaled; outputs held back are NaN.
    """
    runs = Runs(fit.variables, fit.terms, data)
    ran = runs.run(fit.theta)
    if ran is None:
        return None
    own = runs.sensitivities(*ran, fit.terms, starts=True)[runs.used]
    residual = runs.target[runs.used] - ran[0][runs.used]
    every = runs.sensitivities(*ran, pool, starts=False)[runs.used]
    gains = _gains(own, every, residual)
    for k in np.argsort(-gains)[:TRIED]:
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
    """Return the fit without one of its terms, the others fitted anew."""
    terms = np.delete(fit.terms, index, axis=0)
    return Runs(fit.variables, terms, data).fit(np.delete(fit.theta, index), STEPS)


def _gains(own: Array, every: Array, residual: Array) -> Array:
    """Return how much of the squared residual each candidate explains beside what is there, in the linearised run."""
    with np.errstate(over="ignore", invalid="ignore"):
        size = np.einsum("ij,ij->j", every, every)
        usable = np.isfinite(size) & (size > 0.0)
        size = np.where(usable, size, 1.0)
        scale = np.sqrt(np.einsum("ij,ij->j", own, own))
        basis = np.linalg.qr(own / np.where(scale > 0.0, scale, 1.0))[0]
        shadow = basis.T @ every
        power = 1.0 - np.einsum("ij,ij->j", shadow, shadow) / size
        explained = every.T @ residual - shadow.T @ (basis.T @ residual)
    # what is nearly a sum of those that are there only makes values undetermined
    fresh = usable & (power > 1e-6)
    return np.where(fresh, explained, 0.0) ** 2 / np.where(fresh, power * size, 1.0)
