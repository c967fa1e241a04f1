"""Polynomial models with the products that a test names, fitted to their free run."""

from collections.abc import Sequence

import numpy as np

from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.linear_fit import fit_linear
from estimation.identification.free_run.linear_problem import Form
from estimation.identification.free_run.polynomial_fit import FINAL_STEPS, PolynomialFit, Runs, variables_of

SECOND = Form(2, (1,), (1,))
"""Second order, one input behind one sample."""

CUBE = (0, 0, 0)
"""Of the last output."""


def line(data: Channels, form: Form = SECOND) -> PolynomialFit:
    """Return a linear model as a polynomial one."""
    variables, terms, values = variables_of(fit_linear(form, data), data)
    runs = Runs(variables, terms, data)
    fit = runs.fit(np.concatenate([values, runs.start_values()]), FINAL_STEPS)
    assert fit is not None
    return fit


def beside(fit: PolynomialFit, data: Channels, *products: Sequence[int]) -> PolynomialFit:
    """Return the fit with products beside its terms, all values fitted anew."""
    k = fit.terms.shape[0]
    terms = np.vstack([fit.terms, np.array(products, dtype=np.int64).reshape(-1, 3)])
    theta = np.insert(fit.theta, k, np.zeros(len(products)))
    found = Runs(fit.variables, terms, data).fit(theta, FINAL_STEPS)
    assert found is not None
    return found
