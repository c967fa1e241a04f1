"""Start of a polynomial model of an output with friction: a linear model whose output is held by dry friction.

A body held by dry friction does not move until the pull exceeds the friction, and is then accelerated by the
difference. For a velocity the implicit Euler step is exact: the sum of the other terms is moved towards rest by a
constant, and is at rest within it. A position does the same relative to its previous value.
"""

from dataclasses import replace

import numpy as np

from estimation.arrays import Array
from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.linear_problem import LinearFit, Problem
from estimation.identification.free_run.polynomial_fit import FINAL_STEPS, PolynomialFit, Runs, variables_of

START_FRICTIONS = (0.02, 0.1, 0.3, 0.6)
"""Friction at which searches begin, over the effect of the inputs at one deviation [dimensionless]."""


def fit_with_friction(linear: LinearFit, friction: str, data: Channels) -> PolynomialFit | None:
    """Return a linear model with output friction, fitted to its free run; None if it diverges.

    Parameters
    ----------
    friction : str
        ``"velocity"`` or ``"position"``: the kind of output.
    data : Channels
        Scaled; outputs held back are NaN.
    """
    plain, terms, values = variables_of(linear, data)
    runs = Runs(replace(plain, friction=friction), terms, data)
    begun = _first_outputs(linear, runs, data)
    put_in = float(np.abs([one.sum() for one in linear.numerators]).sum())
    found: list[PolynomialFit] = []
    for level in START_FRICTIONS:
        rub = np.array([level * put_in, level * put_in, 0.0])[: runs.variables.n_friction]
        fit = runs.fit(np.concatenate([values, begun, rub]), FINAL_STEPS)
        if fit is not None:
            found.append(fit)
    return min(found, key=lambda one: one.cost, default=None)


def _first_outputs(linear: LinearFit, runs: Runs, data: Channels) -> Array:
    """Return the outputs of the linear model with which each log's run begins: noise misleads integrating ones."""
    problem, n = Problem(linear.form, data), runs.variables.n_start
    output = problem.jacobian(linear.theta)[0]
    places = zip(problem.bounds[:-1], runs.begins, strict=True)
    return np.concatenate([output[int(first) + begin - n : int(first) + begin] for first, begin in places])


def continued_fit(fit: PolynomialFit, data: Channels) -> PolynomialFit | None:
    """Return a fit continued on other data with as many logs; None if it diverges."""
    runs = Runs(fit.variables, fit.terms, data)
    return runs.fit(np.concatenate([fit.coefficients, runs.start_values(), fit.friction]), FINAL_STEPS)
