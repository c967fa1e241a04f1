"""Start of a polynomial model of an output with friction: a linear model whose output dry friction holds.

A body that dry friction holds does not move until more than the friction pulls, and is then pulled by the difference.
Of a velocity the implicit step of Euler is exact: what the other terms would give is brought nearer to rest by a level,
and stands at rest within it. A position does the same from where it was a sample before.
"""

from dataclasses import replace

import numpy as np

from estimation.arrays import Array
from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.linear_problem import LinearFit, Problem
from estimation.identification.free_run.polynomial_fit import FINAL_STEPS, PolynomialFit, Runs, variables_of

LEVELS = (0.02, 0.1, 0.3, 0.6)
"""Friction that searches begin at, over what the inputs put in at one deviation [dimensionless]."""


def fit_with_friction(linear: LinearFit, friction: str, data: Channels) -> PolynomialFit | None:
    """Return a linear model whose output rubs, fitted to its free run; None where it runs away.

    Parameters
    ----------
    friction : str
        ``"velocity"`` or ``"position"``: what the output is.
    data : Channels
        Scaled; outputs held back are NaN.
    """
    plain, terms, values = variables_of(linear, data)
    runs = Runs(replace(plain, friction=friction), terms, data)
    begun = _first_outputs(linear, runs, data)
    put_in = float(np.abs([one.sum() for one in linear.numerators]).sum())
    found: list[PolynomialFit] = []
    for level in LEVELS:
        rub = np.array([level * put_in, level * put_in, 0.0])[: runs.variables.n_friction]
        fit = runs.fit(np.concatenate([values, begun, rub]), FINAL_STEPS)
        if fit is not None:
            found.append(fit)
    return min(found, key=lambda one: one.cost, default=None)


def _first_outputs(linear: LinearFit, runs: Runs, data: Channels) -> Array:
    """Return the outputs of the linear model that each log's run begins with: noise sends what integrates astray."""
    problem, n = Problem(linear.form, data), runs.variables.n_start
    output = problem.jacobian(linear.theta)[0]
    places = zip(problem.bounds[:-1], runs.begins, strict=True)
    return np.concatenate([output[int(first) + begin - n : int(first) + begin] for first, begin in places])


def continued(fit: PolynomialFit, data: Channels) -> PolynomialFit | None:
    """Return a fit carried on with other data of as many logs; None where it runs away."""
    runs = Runs(fit.variables, fit.terms, data)
    return runs.fit(np.concatenate([fit.coefficients, runs.start_values(), fit.friction]), FINAL_STEPS)
