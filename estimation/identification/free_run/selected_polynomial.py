"""Polynomial models with few products, chosen one by one by how much of the one-step error each explains.

Orthogonal least squares on lagged signals (Chen, Billings and Luo 1989; the error reduction ratio), started from
nothing. A model with every product wastes its samples on absent products. Each held-back block has a selection of its
own, which never used it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimation.arrays import Array, IntArray
from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.dense_polynomial import (
    STEPS,
    JudgedRecipe,
    RequestedSizes,
    every_term,
    judged_fits,
    tried_delays,
)
from estimation.identification.free_run.linear_fit import COARSE
from estimation.identification.free_run.linear_problem import Form, LinearFit
from estimation.identification.free_run.polynomial_fit import PolynomialFit, Runs, variables_of
from estimation.identification.free_run.polynomial_moments import moments
from estimation.identification.free_run.polynomial_variables import Variables

LAGS = (2, 3, 4)
"""Lags of the output and of each input, for the pool of terms."""

TERM_COUNTS = (6, 9, 13, 18, 25)
"""Numbers of terms that are kept."""

MOST_POOL = 250
"""Most terms in the pool: if there would be more, those of degree three are left out, then the last of degree two."""

LEAST_INDEPENDENT_SHARE = 1e-8
"""Least share of a term's square that earlier terms must not explain; otherwise it is skipped."""

MOST_DESCENDED = 3
"""Selections whose free run is descended."""


@dataclass(frozen=True)
class Selection:
    """Settings of a fit of a model with few products.

    Parameters
    ----------
    form : Form
        Lags.
    count : int
        Number of terms, including the constant and linear ones.
    descended : bool
        Whether the one-step estimate starts a descent of the free run.
    """

    form: Form
    count: int
    descended: bool = False

    def fit(self, data: Channels) -> PolynomialFit | None:
        """Return the model of given data; None if it diverges or there are too few samples.

        Parameters
        ----------
        data : Channels
            Scaled; outputs held back are NaN.
        """
        ordered = _ordered_terms(self.form, data)
        found = None if ordered is None else ordered.model(self.count, data)
        return _descended_selections(found, data) if self.descended else found


def forms_selected(delays: tuple[int, ...], asked: RequestedSizes) -> list[Form]:
    """Return the lags for the pool of terms.

    Parameters
    ----------
    delays : tuple of int
        Dead time of each input that is tried beside zero and one sample [samples].
    asked : Asked
        What the user gives.

    Examples
    --------
    >>> [(one.order, one.delays) for one in forms_selected((1,), RequestedSizes(order=2))]
    [(2, (0,)), (2, (1,))]
    """
    m = len(delays)
    lags = LAGS if asked.order is None else (asked.order,)
    found = [Form(n, (asked.n_numerator or n,) * m, one) for n in lags for one in tried_delays(delays, asked)]
    return list(dict.fromkeys(found))


def judged_selections(
    data: Channels, parts: Sequence[Channels], forms: Sequence[Form]
) -> list[JudgedRecipe[Selection]]:
    """Return models with few products, each judged on blocks that neither its terms nor its values have used.

    Parameters
    ----------
    data : Channels
        Scaled.
    parts : sequence of Channels
        The same without one block each.
    forms : sequence of Form
        Lags for the pool of terms.
    """
    judged: list[JudgedRecipe[Selection] | None] = []
    for form in forms:
        ordered = [_ordered_terms(form, part) for part in parts]
        for count in TERM_COUNTS:
            fits = [None if one is None else one.model(count, part) for one, part in zip(ordered, parts, strict=True)]
            judged.append(judged_fits(Selection(form, count), fits, data, parts))
    found = [one for one in judged if one is not None]
    for one in sorted(found, key=lambda one: one.held_back)[:MOST_DESCENDED]:
        fits = [_descended_selections(fit, part) for fit, part in zip(one.fits, parts, strict=True)]
        recipe = Selection(one.recipe.form, len(one.fits[0].terms), descended=True)
        more = judged_fits(recipe, fits, data, parts)
        found += [] if more is None else [more]
    return found


@dataclass(frozen=True, eq=False)
class _OrderedTerms:
    """Terms in the order in which they explain the one-step error, and all moments."""

    variables: Variables
    terms: IntArray
    gram: Array
    right: Array

    def model(self, count: int, data: Channels) -> PolynomialFit | None:
        """Return the free-running model of the first terms; None if it diverges or there are not so many."""
        if self.terms.shape[0] < count:
            return None
        terms = self.terms[:count]
        size = np.sqrt(np.diag(self.gram)[:count])
        unit = self.gram[:count, :count] / np.outer(size, size)
        values = np.linalg.lstsq(unit, self.right[:count] / size, rcond=1e-12)[0] / size
        runs = Runs(self.variables, terms, data)
        theta = np.concatenate([values, runs.start_values()])
        ran = runs.outputs(theta)
        if ran is None:
            return None
        return PolynomialFit(self.variables, terms, theta, float(np.sum((ran - runs.target)[runs.used] ** 2)))


def _ordered_terms(form: Form, data: Channels) -> _OrderedTerms | None:
    """Return the terms of some lags, best first; None if there are too few samples."""
    variables = variables_of(LinearFit(form, np.zeros(form.n_values), 0.0), data)[0]
    pool = every_term(variables.lag.size, 3)
    if pool.shape[0] > MOST_POOL:
        pool = every_term(variables.lag.size, 2)[:MOST_POOL]
    gram, right, n = moments(variables, pool, data)
    if n < 2 * TERM_COUNTS[-1]:
        return None
    first = best_regressors(gram, right, TERM_COUNTS[-1])
    return _OrderedTerms(variables, pool[first], gram[np.ix_(first, first)], right[first])


def best_regressors(gram: Array, right: Array, most: int) -> IntArray:
    """Return the regressors that explain most of a target, each in addition to those before it.

    Parameters
    ----------
    gram : ndarray, shape (k, k)
        Products of regressors, summed.
    right : ndarray, shape (k,)
        Products with the target, summed.
    most : int
        Most regressors.

    Returns
    -------
    ndarray of int, shape (most,) or less
        Regressors, best first; dependent ones are left out.

    Examples
    --------
    >>> gram = np.array([[4.0, 0.0, 2.0], [0.0, 1.0, 0.0], [2.0, 0.0, 1.0]])
    >>> best_regressors(gram, np.array([4.0, 3.0, 2.0]), 3).tolist()
    [1, 0]
    """
    whole = np.diag(gram).copy()
    left, wanted = whole.copy(), right.astype(np.float64).copy()
    rows, taken = np.zeros((most, right.size)), list[int]()
    for step in range(min(most, right.size)):
        open_ = left > LEAST_INDEPENDENT_SHARE * whole
        open_[taken] = False
        if not open_.any():
            break
        gains = np.where(open_, wanted**2, 0.0) / np.where(open_, left, 1.0)
        best = int(np.argmax(gains))
        root = np.sqrt(left[best])
        rows[step] = (gram[best] - rows[:step, best] @ rows[:step]) / root
        wanted = wanted - rows[step] * (wanted[best] / root)
        left = left - rows[step] ** 2
        taken.append(best)
    return np.array(taken, dtype=np.int64)


def _descended_selections(fit: PolynomialFit | None, data: Channels) -> PolynomialFit | None:
    return None if fit is None else Runs(fit.variables, fit.terms, data).fit(fit.theta, STEPS, least_gain=COARSE) or fit
