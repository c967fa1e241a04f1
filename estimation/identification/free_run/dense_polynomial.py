"""Polynomial models with every product of a few lags, with a penalty in place of a selection of products.

Only size and penalty are chosen: by one least-squares fit of the one-step error, and then, for the best sizes, by a
descent of the free run.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations_with_replacement
from typing import Generic, TypeVar

import numpy as np

from estimation.arrays import IntArray
from estimation.identification.free_run.choose_linear import CLEAR_GAIN
from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.held_back import JudgedModel, block_error
from estimation.identification.free_run.linear_fit import COARSE
from estimation.identification.free_run.linear_problem import Form, LinearFit
from estimation.identification.free_run.polynomial_fit import PolynomialFit, Runs, variables_of
from estimation.identification.free_run.polynomial_moments import Moments, moments, one_step_values
from estimation.identification.free_run.polynomial_variables import Variables
from estimation.progress import report_progress

SIZES = ((1, 2), (2, 2), (3, 2), (3, 3))
"""Lags of the output and of each input that are tried first."""

MOST_TERMS = 120
"""Most terms of a model; larger sizes are left out."""

ONE_STEP_PENALTIES = (1e-3, 1e-4, 1e-5, 1e-8)
"""Penalties of the one-step least squares, on terms of unit deviation [dimensionless]."""

START_PENALTY = 1e-4
"""The penalty from which the free run starts."""

FREE_RUN_PENALTIES = (1e-1, 1e-2, 1e-3)
"""Penalties of the free run; each descent begins where the one before ended [dimensionless]."""

STEPS = 15
"""Evaluations of each descent: a model that needs more is poorly determined."""

MOST_DESCENDED = 4
"""Sizes whose free run is descended."""


@dataclass(frozen=True)
class RequestedSizes:
    """Sizes given by the user; None if the data choose.

    Parameters
    ----------
    order, n_numerator : int or None
        Lags of the output and of each input.
    delay : int or None
        Dead time of every input [samples].
    """

    order: int | None = None
    delay: int | None = None
    n_numerator: int | None = None


@dataclass(frozen=True)
class Recipe:
    """Settings of a fit of a model with all products.

    Parameters
    ----------
    form : Form
        Lags.
    degree : int
        Largest degree of the products.
    one_step : float
        Penalty of the one-step least squares [dimensionless].
    free_run : tuple of float
        Penalties of the free run, one descent each; empty without a descent [dimensionless].
    """

    form: Form
    degree: int
    one_step: float
    free_run: tuple[float, ...] = ()

    def fit(
        self, data: Channels, begun: PolynomialFit | None = None, known: "Moments | None" = None
    ) -> PolynomialFit | None:
        """Return the model of given data; None if it diverges or there are too few samples.

        Parameters
        ----------
        data : Channels
            Scaled; outputs held back are NaN.
        begun : PolynomialFit, optional
            Result of the same recipe without its last penalty, if known.
        known : tuple, optional
            Moments of these data for this size, from `moments`, if known.
        """
        if begun is not None:
            return self._descended(begun, data, self.free_run[-1])
        variables, terms = _size(self.form, self.degree, data)
        coefficients = one_step_values(terms, known or moments(variables, terms, data), self.one_step)
        if coefficients is None:
            return None
        runs = Runs(variables, terms, data)
        theta = np.concatenate([coefficients, runs.start_values()])
        ran = runs.outputs(theta)
        if ran is None:
            return None
        fit = PolynomialFit(variables, terms, theta, float(np.sum((ran - runs.target)[runs.used] ** 2)))
        for penalty in self.free_run:
            fit = self._descended(fit, data, penalty)
        return fit

    @staticmethod
    def _descended(fit: PolynomialFit, data: Channels, penalty: float) -> PolynomialFit:
        return Runs(fit.variables, fit.terms, data).fit(fit.theta, STEPS, penalty, COARSE) or fit


Kind = TypeVar("Kind")
"""Of recipe."""


@dataclass(frozen=True, eq=False)
class JudgedRecipe(JudgedModel, Generic[Kind]):
    """A recipe with its fits to all blocks but one, and their errors there.

    Parameters
    ----------
    recipe : object
        Has a ``fit`` that takes data.
    fits : tuple of PolynomialFit
        One per block.
    """

    recipe: Kind
    fits: tuple[PolynomialFit, ...]


def every_term(n_variables: int, degree: int) -> IntArray:
    """Return the constant, every variable and every product up to a degree of three, shape (k, 3).

    Parameters
    ----------
    n_variables : int
        Lagged signals.
    degree : int
        Two or three.

    Returns
    -------
    ndarray of int, shape (k, 3)
        Variables in each term; -1 stands for 1.

    Examples
    --------
    >>> every_term(1, 3).tolist()
    [[-1, -1, -1], [0, -1, -1], [0, 0, -1], [0, 0, 0]]
    """
    rows = [
        (*one, *(-1,) * (3 - size))
        for size in range(degree + 1)
        for one in combinations_with_replacement(range(n_variables), size)
    ]
    return np.array(rows, dtype=np.int64)


def tried_forms(delays: tuple[int, ...], asked: RequestedSizes) -> list[Form]:
    """Return sizes of models with every product.

    Parameters
    ----------
    delays : tuple of int
        Dead time of each input that is tried beside zero and one sample [samples].
    asked : Asked
        What the user gives.

    Examples
    --------
    >>> [one.sizes for one in tried_forms((1, 1), RequestedSizes(order=2, delay=1))]
    [(2, 2)]
    """
    m, order = len(delays), asked.order
    sizes = [one for one in SIZES if one[0] == order] or [(order, order)] if order is not None else SIZES
    found = [Form(n, (asked.n_numerator or size,) * m, one) for n, size in sizes for one in tried_delays(delays, asked)]
    return list(dict.fromkeys(found))


def tried_delays(delays: tuple[int, ...], asked: RequestedSizes) -> list[tuple[int, ...]]:
    """Return the dead times of the inputs that are tried: zero, one sample and those given, or the user's.

    Parameters
    ----------
    delays : tuple of int
        Dead time of each input [samples].
    asked : Asked
        What the user gives.
    """
    m = len(delays)
    return [(0,) * m, (1,) * m, delays] if asked.delay is None else [(asked.delay,) * m]


def judged_recipes(
    data: Channels, parts: Sequence[Channels], forms: Sequence[Form], asked: RequestedSizes | None = None
) -> list[JudgedRecipe[Recipe]]:
    """Return models with every product, each judged on blocks that its fits left out.

    The free run is descended for the sizes that are best by one least-squares fit, and for larger ones next to the best
    as long as a further lag is clearly better.

    Parameters
    ----------
    data : Channels
        Scaled.
    parts : sequence of Channels
        The same without one block each.
    forms : sequence of Form
        Lags that are tried, with products of degree two and three.
    asked : Asked, optional
        Sizes that do not grow.

    Returns
    -------
    list of JudgedRecipe
        Those that run; empty if every size has too many terms.
    """
    found: list[JudgedRecipe[Recipe]] = []
    best: dict[tuple[Form, int], float] = {}
    sizes = [(form, degree) for form in forms for degree in (2, 3)]
    for form, degree in sizes:
        if len(every_term(form.order + form.n_b, degree)) > MOST_TERMS:
            continue
        known = [_moments_of(form, degree, part) for part in parts]
        tried = [
            one
            for penalty in ONE_STEP_PENALTIES
            if (one := _judged_recipe(Recipe(form, degree, penalty), data, parts, known=known)) is not None
        ]
        found += tried
        best[form, degree] = min((one.held_back for one in tried), default=float("inf"))
    descended = [
        one
        for form, degree in sorted(best, key=lambda size: best[size])[:MOST_DESCENDED]
        for one in _descended_recipes(form, degree, data, parts)
    ]
    return [*found, *descended, *_recipes_with_more_lags(descended, data, parts, asked or RequestedSizes())]


def _descended_recipes(
    form: Form, degree: int, data: Channels, parts: Sequence[Channels]
) -> list[JudgedRecipe[Recipe]]:
    """Return models of one size whose free run is descended with one penalty after the other."""
    found: list[JudgedRecipe[Recipe]] = []
    for k in range(len(FREE_RUN_PENALTIES)):
        recipe = Recipe(form, degree, START_PENALTY, FREE_RUN_PENALTIES[: k + 1])
        one = _judged_recipe(recipe, data, parts, found[-1] if found else None)
        if one is None:
            break
        found.append(one)
    return found


def _recipes_with_more_lags(
    found: Sequence[JudgedRecipe[Recipe]], data: Channels, parts: Sequence[Channels], asked: RequestedSizes
) -> list[JudgedRecipe[Recipe]]:
    """Return models with one lag more than the best, and with more lags as long as each is clearly better."""
    more: list[JudgedRecipe[Recipe]] = []
    best = min(found, key=lambda one: one.held_back, default=None)
    while best is not None:
        recipe = best.recipe
        tried = [
            one
            for form in larger_forms(recipe.form, asked)
            if len(every_term(form.order + form.n_b, recipe.degree)) <= MOST_TERMS
            for one in _descended_recipes(form, recipe.degree, data, parts)
        ]
        more += tried
        least = (1.0 - CLEAR_GAIN) * best.held_back
        best = min((one for one in tried if one.held_back < least), key=lambda one: one.held_back, default=None)
    return more


def larger_forms(form: Form, asked: RequestedSizes) -> list[Form]:
    """Return sizes with one lag more, of the output or of every input, except what the user gives.

    Parameters
    ----------
    asked : Asked
        What the user gives.

    Examples
    --------
    >>> [(one.order, one.sizes) for one in larger_forms(Form(3, (2,), (1,)), RequestedSizes())]
    [(4, (2,)), (3, (3,))]
    """
    found = [] if asked.order is not None else [replace(form, order=form.order + 1)]
    return found if asked.n_numerator is not None else [*found, replace(form, sizes=tuple(n + 1 for n in form.sizes))]


def _judged_recipe(
    recipe: Recipe,
    data: Channels,
    parts: Sequence[Channels],
    before: JudgedRecipe[Recipe] | None = None,
    known: Sequence[Moments] | None = None,
) -> JudgedRecipe[Recipe] | None:
    """Return a recipe's fits to all blocks but one, started from those before; None if one of them diverges."""
    fits = list[PolynomialFit | None]()
    for index, part in enumerate(parts):
        report_progress("polynomial models")
        begun, moments_known = None if before is None else before.fits[index], None if known is None else known[index]
        fits.append(recipe.fit(part, begun, moments_known))
        if fits[-1] is None:
            return None
    return judged_fits(recipe, fits, data, parts)


def judged_fits(
    recipe: Kind, fits: Sequence[PolynomialFit | None], data: Channels, parts: Sequence[Channels]
) -> JudgedRecipe[Kind] | None:
    """Return fits to all blocks but one with their errors there; None if one of them diverges.

    Parameters
    ----------
    recipe : object
        The recipe.
    fits : sequence of PolynomialFit or None
        One per block.
    data : Channels
        Scaled.
    parts : sequence of Channels
        The same without one block each.
    """
    target, kept, errors = np.concatenate(data.y), list[PolynomialFit](), list[float]()
    for fit, part in zip(fits, parts, strict=True):
        ran = None if fit is None else Runs(fit.variables, fit.terms, data).outputs(fit.theta)
        if fit is None or ran is None:
            return None
        kept.append(fit)
        errors.append(block_error(ran - target, np.isnan(np.concatenate(part.y)) & np.isfinite(target)))
    return JudgedRecipe(recipe, tuple(kept), block_errors=tuple(errors))


def _size(form: Form, degree: int, data: Channels) -> tuple[Variables, IntArray]:
    variables = variables_of(LinearFit(form, np.zeros(form.n_values), 0.0), data)[0]
    return variables, every_term(variables.lag.size, degree)


def _moments_of(form: Form, degree: int, data: Channels) -> Moments:
    return moments(*_size(form, degree, data), data)
