"""Which polynomial model is offered: all products of a few lags kept small by a penalty, few of them, or friction.

What is offered must run well on blocks that are held back, which its fits never saw, and its fits to different blocks
must agree where the same inputs come in another order.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from estimation.identification.free_run.choose_linear import Candidate, criteria
from estimation.identification.free_run.data import Channels, blocks
from estimation.identification.free_run.dense_polynomial import (
    Asked,
    JudgedRecipe,
    Recipe,
    forms_tried,
    judged_fits,
    judged_recipes,
)
from estimation.identification.free_run.held_back import BLOCKS, Compared
from estimation.identification.free_run.other_orders import disagreement
from estimation.identification.free_run.output_friction import continued, fit_with_friction
from estimation.identification.free_run.polynomial_fit import PolynomialFit
from estimation.identification.free_run.selected_polynomial import Selection, forms_selected, judged_selections
from estimation.progress import tell

HIGHEST_RUBBING, RUBBING_BASES, RUBS, RUBBING_JUDGED = 3, 2, 0.1, 2
"""Order of a linear model whose output may rub, models of each order, share of the squared error that friction must
explain, and how many of such models are judged."""

COMPARED, LARGER = 16, 6
"""Models of every product, best on what was held back, that are fitted to all data and tried in other orders: of the
sizes that are tried first, and of larger ones, so that neither leave out the other."""

SELECTIONS = 5
"""Models of few products, likewise."""


@dataclass(frozen=True, eq=False)
class PolynomialCandidate(Compared):
    """A polynomial fit with its held-back error.

    Parameters
    ----------
    fit : PolynomialFit
        Of all data that structures are compared on.
    refit : callable
        Fits the same to other data of as many logs; None where that runs away.
    spread : float
        How far fits without one block each run from it on inputs in other orders [dimensionless].
    parts : tuple of PolynomialFit
        Fits that left out one block each.
    """

    fit: PolynomialFit
    refit: Callable[[Channels], PolynomialFit | None]
    spread: float
    parts: tuple[PolynomialFit, ...] = ()

    @property
    def price(self) -> float:
        """Criterion for comparing models: error on held-back data, and doubt elsewhere [dimensionless]."""
        return float(np.hypot(self.held_back, self.spread))


def polynomial_candidates(
    linear: Sequence[Candidate], data: Channels, asked: Asked | None = None, bar: float = float("inf")
) -> list[PolynomialCandidate]:
    """Return polynomial models: linear ones that rub, of every product, and of the few that explain most.

    The latter two are fitted to all data only while they can still be the best one: a price is not less than the
    held-back error that it begins with.

    Parameters
    ----------
    linear : sequence of Candidate
        Judged on blocks of the same data.
    data : Channels
        Scaled.
    asked : Asked, optional
        Sizes that the data do not choose.
    bar : float
        Price from which on nobody takes a model [dimensionless].
    """
    delays, wanted = min(linear, key=lambda one: one.held_back).form.delays, asked or Asked()
    parts = [data.without(mask) for mask in blocks(data, BLOCKS)]
    found = _with_friction(linear, data, parts)
    for offered in (_dense, _selected):
        found += offered(data, parts, delays, wanted, min([bar, *(one.price for one in found)]))
    return found


def _with_friction(linear: Sequence[Candidate], data: Channels, parts: Sequence[Channels]) -> list[PolynomialCandidate]:
    """Return the best linear model whose output rubs, if friction explains much that linear models leave."""
    fits: list[PolynomialFit] = []
    for order in range(1, HIGHEST_RUBBING + 1):
        # what rubs may integrate: a time constant beyond the record is no doubt here
        own = sorted((one for one in linear if one.form.order == order), key=lambda one: one.held_back)
        for base in own[:RUBBING_BASES]:
            for friction in ("velocity", "position")[:order]:
                fit = fit_with_friction(base.fit, friction, data)
                if fit is not None and fit.cost < (1.0 - RUBS) * base.fit.cost:
                    fits.append(fit)
    tell("outputs with friction")
    best = sorted(fits, key=lambda one: _bic(one, data))[:RUBBING_JUDGED]
    judged = [judged_fits(fit, [continued(fit, part) for part in parts], data, parts) for fit in best]
    taken = min((one for one in judged if one is not None), key=lambda one: one.held_back, default=None)
    return [] if taken is None else [_candidate(taken.recipe, partial(continued, taken.recipe), taken, data)]


def _dense(
    data: Channels, parts: Sequence[Channels], delays: tuple[int, ...], asked: Asked, bar: float
) -> list[PolynomialCandidate]:
    """Return the models of every product that do best on what was held back."""
    forms = forms_tried(delays, asked)
    judged = sorted(judged_recipes(data, parts, forms, asked), key=lambda one: one.held_back)
    first = [one for one in judged if one.recipe.form in forms][:COMPARED]
    return _kept([*first, *[one for one in judged if one.recipe.form not in forms][:LARGER]], data, bar)


def _selected(
    data: Channels, parts: Sequence[Channels], delays: tuple[int, ...], asked: Asked, bar: float
) -> list[PolynomialCandidate]:
    """Return the models of few products that do best on what was held back."""
    judged = judged_selections(data, parts, forms_selected(delays, asked))
    return _kept(sorted(judged, key=lambda one: one.held_back)[:SELECTIONS], data, bar)


def _kept(
    judged: Sequence[JudgedRecipe[Recipe]] | Sequence[JudgedRecipe[Selection]], data: Channels, bar: float
) -> list[PolynomialCandidate]:
    """Return models of all data that were judged without a block each.

    Passed over are those that leave more of what was held back than the price of the best one, or than the bar.
    """
    found: list[PolynomialCandidate] = []
    known: dict[Recipe, PolynomialFit | None] = {}
    for one in sorted(judged, key=lambda one: one.held_back):
        if one.held_back > bar:
            break
        tell("polynomial models")
        recipe = one.recipe
        fit = _fitted(recipe, data, known) if isinstance(recipe, Recipe) else recipe.fit(data)
        if fit is not None:
            found.append(_candidate(fit, recipe.fit, one, data))
            bar = min(bar, found[-1].price)
    return found


def _fitted(recipe: Recipe, data: Channels, known: dict[Recipe, PolynomialFit | None]) -> PolynomialFit | None:
    """Return the fit of a recipe, begun at what is known of the same one with fewer penalties, and remember it."""
    if recipe not in known:
        begun = None
        if recipe.free_run:
            begun = _fitted(replace(recipe, free_run=recipe.free_run[:-1]), data, known)
        known[recipe] = recipe.fit(data, begun) if begun is not None or not recipe.free_run else None
    return known[recipe]


def _candidate(
    fit: PolynomialFit,
    refit: Callable[[Channels], PolynomialFit | None],
    judged: JudgedRecipe[Recipe] | JudgedRecipe[Selection] | JudgedRecipe[PolynomialFit],
    data: Channels,
) -> PolynomialCandidate:
    spread = disagreement(judged.fits, fit, data)
    errors, bic = judged.block_errors, _bic(fit, data)
    return PolynomialCandidate(fit, refit, spread, judged.fits, block_errors=errors, bic=bic)


def _bic(fit: PolynomialFit, data: Channels) -> float:
    return criteria(fit.cost, fit.theta.size, data.n_samples)[0]
