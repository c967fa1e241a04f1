"""Which polynomial model is offered: products added one by one, or all products of a few lags with a penalty.

The number of products is chosen on held-back blocks, each of which has a selection of its own that never used it. A
model is offered if it runs well there, and if fits to different blocks agree for the same inputs in another order.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from estimation.identification.free_run.choose_linear import Candidate, criteria
from estimation.identification.free_run.data import Channels, blocks
from estimation.identification.free_run.dense_polynomial import (
    JudgedRecipe,
    Recipe,
    RequestedSizes,
    judged_recipes,
    tried_forms,
)
from estimation.identification.free_run.held_back import BLOCKS, ComparedModel, block_error, pooled_error
from estimation.identification.free_run.linear_fit import fit_linear
from estimation.identification.free_run.linear_problem import LinearFit
from estimation.identification.free_run.other_orders import disagreement, is_wild
from estimation.identification.free_run.output_friction import continued_fit, fit_with_friction
from estimation.identification.free_run.polynomial_fit import FINAL_STEPS, PolynomialFit, Runs
from estimation.identification.free_run.polynomial_terms import (
    candidate_terms,
    polynomial_of_linear,
    with_best_product,
    without_term,
)
from estimation.identification.free_run.selected_polynomial import Selection, forms_selected, judged_selections
from estimation.progress import report_progress

MOST_TERMS = 20
"""Products beside the linear terms."""

PATIENCE = 4
"""Products without gain on held-back data after which no more are added."""

CLEAR_GAIN = 0.01
"""Share by which further products must reduce the held-back error."""

HIGHEST_BASE = 4
"""Highest order of the linear model to which products are added."""

HIGHEST_FRICTION_ORDER, FRICTION_BASES, LEAST_FRICTION_GAIN = 3, 2, 0.1
"""Highest order of a linear model with output friction, models of each order, and share of the squared error that
friction must explain."""

BASES, SCREENED, KEPT = 6, 3, 2
"""Linear models to which products are added, how many products each gets at first, and how many models continue."""

COMPARED, LARGER = 16, 6
"""Models with every product, the best on held-back data, that are fitted to all data and tried in other orders: of the
sizes tried first, and of larger ones, so that neither excludes the other."""

SELECTIONS = 5
"""Models with few products, likewise."""


@dataclass(frozen=True, eq=False)
class PolynomialCandidate(ComparedModel):
    """A polynomial fit with its held-back error.

    Parameters
    ----------
    fit : PolynomialFit
        Fit to all data on which structures are compared.
    refit : callable
        Fits the same to other data with as many logs; None if that diverges.
    spread : float
        Deviation of fits without one block each, on inputs in other orders [dimensionless].
    parts : tuple of PolynomialFit
        Fits that left out one block each.
    """

    fit: PolynomialFit
    refit: Callable[[Channels], PolynomialFit | None]
    spread: float
    parts: tuple[PolynomialFit, ...] = ()

    @property
    def price(self) -> float:
        """Criterion for comparisons: error on held-back data, plus the uncertainty elsewhere [dimensionless]."""
        return float(np.hypot(self.held_back, self.spread))


def polynomial_candidates(
    linear: Sequence[Candidate], data: Channels, asked: RequestedSizes | None = None, bar: float = float("inf")
) -> list[PolynomialCandidate]:
    """Return polynomial models: grown from linear ones, with every product, and with the few that explain most.

    The latter two are fitted to all data only while they can still be the best: a price is at least the held-back
    error.

    Parameters
    ----------
    linear : sequence of Candidate
        Judged on blocks of the same data.
    data : Channels
        Scaled.
    asked : Asked, optional
        Sizes that the user gives.
    bar : float
        Price from which no model is used [dimensionless].
    """
    delays, wanted = min(linear, key=lambda one: one.held_back).form.delays, asked or RequestedSizes()
    parts = [data.without(mask) for mask in blocks(data, BLOCKS)]
    found = _grown_candidates(linear, data)
    for offered in (_dense_candidates, _selected_candidates):
        found += offered(data, parts, delays, wanted, min([bar, *(one.price for one in found)]))
    return found


def _grown_candidates(linear: Sequence[Candidate], data: Channels) -> list[PolynomialCandidate]:
    growths = [
        _Growth(whole, _from_linear(base.fit), data)
        for base in _bases(linear)
        if (whole := polynomial_of_linear(base.fit, data)) is not None
    ]
    return [*_best_grown(growths, KEPT), *_best_grown(_growths_with_friction(linear, data), 1)]


def _best_grown(growths: Sequence["_Growth"], count: int) -> list[PolynomialCandidate]:
    screened = [growth for growth in growths if growth.advance(SCREENED)]
    best = sorted(screened, key=lambda one: min(one.errors))[:count]
    for growth in best:
        growth.advance(MOST_TERMS)
    return [growth.finished_candidate() for growth in best]


def _from_linear(base: LinearFit) -> Callable[[Channels], PolynomialFit | None]:
    return lambda part: polynomial_of_linear(fit_linear(base.form, part, [base.f]), part)


def _growths_with_friction(linear: Sequence[Candidate], data: Channels) -> list["_Growth"]:
    """Return growths from models with output friction, if friction explains much that linear models leave."""
    fits: list[PolynomialFit] = []
    for order in range(1, HIGHEST_FRICTION_ORDER + 1):
        # a plant with friction may integrate, so a time constant beyond the record is no objection here
        own = sorted((one for one in linear if one.form.order == order), key=lambda one: one.held_back)
        for base in own[:FRICTION_BASES]:
            for friction in ("velocity", "position")[:order]:
                fit = fit_with_friction(base.fit, friction, data)
                if fit is not None and fit.cost < (1.0 - LEAST_FRICTION_GAIN) * base.fit.cost:
                    fits.append(fit)
    best = sorted(fits, key=lambda one: _bic(one, data))[:KEPT]
    return [_Growth(fit, partial(continued_fit, fit), data) for fit in best]


def _dense_candidates(
    data: Channels, parts: Sequence[Channels], delays: tuple[int, ...], asked: RequestedSizes, bar: float
) -> list[PolynomialCandidate]:
    """Return the models with every product that are best on held-back data, except those that leave their range."""
    forms = tried_forms(delays, asked)
    judged = sorted(judged_recipes(data, parts, forms, asked), key=lambda one: one.held_back)
    first = [one for one in judged if one.recipe.form in forms][:COMPARED]
    return _candidates_in_range([*first, *[one for one in judged if one.recipe.form not in forms][:LARGER]], data, bar)


def _selected_candidates(
    data: Channels, parts: Sequence[Channels], delays: tuple[int, ...], asked: RequestedSizes, bar: float
) -> list[PolynomialCandidate]:
    """Return the models with few products that are best on held-back data, except those that leave their range."""
    judged = judged_selections(data, parts, forms_selected(delays, asked))
    return _candidates_in_range(sorted(judged, key=lambda one: one.held_back)[:SELECTIONS], data, bar)


def _candidates_in_range(
    judged: Sequence[JudgedRecipe[Recipe]] | Sequence[JudgedRecipe[Selection]], data: Channels, bar: float
) -> list[PolynomialCandidate]:
    """Return models of all data that were judged without a block each, except those that leave their range.

    Models are skipped if their held-back error exceeds the price of the best one, or the bar.
    """
    found: list[PolynomialCandidate] = []
    known: dict[Recipe, PolynomialFit | None] = {}
    for one in sorted(judged, key=lambda one: one.held_back):
        if one.held_back > bar:
            break
        report_progress("polynomial models")
        recipe = one.recipe
        fit = _fitted(recipe, data, known) if isinstance(recipe, Recipe) else recipe.fit(data)
        if fit is not None and not is_wild(fit, data):
            found.append(_candidate(fit, recipe.fit, one, data))
            bar = min(bar, found[-1].price)
    return found


def _fitted(recipe: Recipe, data: Channels, known: dict[Recipe, PolynomialFit | None]) -> PolynomialFit | None:
    """Return the fit of a recipe, started from the same one with fewer penalties; it is cached."""
    if recipe not in known:
        begun = None
        if recipe.free_run:
            begun = _fitted(replace(recipe, free_run=recipe.free_run[:-1]), data, known)
        known[recipe] = recipe.fit(data, begun) if begun is not None or not recipe.free_run else None
    return known[recipe]


def _candidate(
    fit: PolynomialFit,
    refit: Callable[[Channels], PolynomialFit | None],
    judged: JudgedRecipe[Recipe] | JudgedRecipe[Selection],
    data: Channels,
) -> PolynomialCandidate:
    spread = disagreement(judged.fits, fit, data)
    errors, bic = judged.block_errors, _bic(fit, data)
    return PolynomialCandidate(fit, refit, spread, judged.fits, block_errors=errors, bic=bic)


def _bic(fit: PolynomialFit, data: Channels) -> float:
    return criteria(fit.cost, fit.theta.size, data.n_samples)[0]


def _bases(linear: Sequence[Candidate]) -> list[Candidate]:
    """Return the best linear models of each order, with dead time and without."""
    best: dict[tuple[int, bool], Candidate] = {}
    for one in linear:
        kind = (one.form.order, max(one.form.delays) > 1)
        if kind[0] <= HIGHEST_BASE and not one.doubt and (kind not in best or one.held_back < best[kind].held_back):
            best[kind] = one
    sound = list(best.values()) or list(linear)[:1]
    return sorted(sound, key=lambda one: one.held_back)[:BASES]


class _Growth:
    """Polynomial models of one base that grow on each block's data side by side."""

    def __init__(self, whole: PolynomialFit, begin: Callable[[Channels], PolynomialFit | None], data: Channels) -> None:
        self.path, self.data = [whole], data
        self.masks = blocks(data, BLOCKS)
        self.parts = [data.without(mask) for mask in self.masks]
        self.fits = [begin(part) for part in self.parts]
        self.block_errors = [self._held_back()]
        self.history = [list(self.fits)]

    @property
    def errors(self) -> list[float]:
        """Held-back error by the number of products."""
        return [pooled_error(one) for one in self.block_errors]

    def advance(self, most: int) -> bool:
        """Add products until there are as many as wanted, or more bring no gain; return whether it runs free at all."""
        if not np.isfinite(self.errors[0]):
            return False
        pool = candidate_terms(self.path[0].variables)
        while len(self.errors) <= most and len(self.errors) - 1 - int(np.argmin(self.errors)) < PATIENCE:
            report_progress("products that grow")
            self.fits = [
                None if fit is None else with_best_product(fit, pool, part) or fit
                for fit, part in zip(self.fits, self.parts, strict=True)
            ]
            more = with_best_product(self.path[-1], pool, self.data)
            if more is None:
                break
            self.path.append(more)
            self.history.append(list(self.fits))
            wild = is_wild(more, self.data)
            self.block_errors.append((float("inf"),) * len(self.masks) if wild else self._held_back())
        return True

    def finished_candidate(self) -> PolynomialCandidate:
        """Return the model of all data with the number of products chosen on held-back blocks, pruned."""
        errors = self.errors
        least = min(errors)
        count = next(k for k, error in enumerate(errors) if error <= (1.0 + CLEAR_GAIN) * least)
        fit = _pruned(self.path[count], self.data)
        fit = Runs(fit.variables, fit.terms, self.data).fit(fit.theta, FINAL_STEPS) or fit
        parts = [part for part in self.history[count] if part is not None]
        spread = disagreement(parts, fit, self.data)
        refit, own, bic = partial(continued_fit, fit), self.block_errors[count], _bic(fit, self.data)
        return PolynomialCandidate(fit, refit, spread, tuple(parts), block_errors=own, bic=bic)

    def _held_back(self) -> tuple[float, ...]:
        target, errors = np.concatenate(self.data.y), list[float]()
        for fit, mask in zip(self.fits, self.masks, strict=True):
            ran = None if fit is None else Runs(fit.variables, fit.terms, self.data).outputs(fit.theta)
            if ran is None:
                return (float("inf"),) * len(self.masks)
            errors.append(block_error(ran - target, np.concatenate(mask) & np.isfinite(target)))
        return tuple(errors)


def _pruned(fit: PolynomialFit, data: Channels) -> PolynomialFit:
    """Return a fit without the products that the free run's information criterion does not need."""
    price = float(np.log(data.n_samples)) / data.n_samples
    index = fit.terms.shape[0] - 1
    while index >= 0:
        if fit.terms[index, 1] >= 0:
            less = without_term(fit, index, data)
            if less is not None and np.log(less.cost / fit.cost) < price and not is_wild(less, data):
                fit = less
        index -= 1
    return fit
