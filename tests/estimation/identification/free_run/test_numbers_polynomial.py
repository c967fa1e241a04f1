"""Polynomial and Hammerstein models of small logs, kept in `numbers_polynomial.json`."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from estimation.identification.free_run import (
    choose_hammerstein,
    choose_polynomial,
    dense_polynomial,
    hammerstein_fit,
    other_orders,
    polynomial_terms,
)
from estimation.identification.free_run.candidate_rows import hammerstein_row, linear_row, polynomial_row
from estimation.identification.free_run.choose_linear import Candidate, linear_candidates
from estimation.identification.free_run.choose_polynomial import PolynomialCandidate
from estimation.identification.free_run.data import Channels, blocks, channels_from, scaled
from estimation.identification.free_run.dense_polynomial import JudgedRecipe, Recipe, RequestedSizes
from estimation.identification.free_run.hammerstein_dynamics import HammersteinDynamics
from estimation.identification.free_run.hammerstein_fit import HammersteinProblem, fit_hammerstein
from estimation.identification.free_run.identify import identify_channels
from estimation.identification.free_run.input_nonlinearity import NONLINEARITIES, _inner, _outer, _widths, play
from estimation.identification.free_run.input_range import input_range_notes
from estimation.identification.free_run.linear_fit import fit_linear
from estimation.identification.free_run.linear_problem import Form, LinearFit
from estimation.identification.free_run.model import FreeRunModel
from estimation.identification.free_run.normal_equations import NormalEquations
from estimation.identification.free_run.polynomial_dynamics import PolynomialDynamics
from estimation.identification.free_run.polynomial_fit import PolynomialFit, Runs, first_values
from estimation.identification.free_run.polynomial_variables import products
from plant.arrays import Array
from tests.kernels import loops_in_python
from tests.numbers import Found, Numbers, Roughly, some

NUMBERS = Numbers(__file__)
RNG = np.random.default_rng(61)
N = 240
U: Array = np.repeat(RNG.choice([-1.0, 0.3, 1.0], N // 4), 4) + 0.2 * RNG.standard_normal(N)
NOISE: Array = RNG.standard_normal(N)
LOGS = (slice(0, 90), slice(90, N))


def answer(bend: float = 0.05) -> Array:
    y = np.zeros(N)
    for t in range(2, N):
        y[t] = 1.5 * y[t - 1] - 0.7 * y[t - 2] + 0.2 * U[t - 1] - bend * y[t - 1] ** 3
    return y + 0.02 * NOISE


@cache
def data(lost: bool = False) -> Channels:
    y = np.where(np.arange(N) % 13 == 5, np.nan, answer()) if lost else answer()
    return scaled(channels_from([U[one, None] for one in LOGS], [y[one] for one in LOGS], 0.1, ("a",), "y"))[0]


@cache
def grown(count: int = 1) -> PolynomialFit:
    fit = polynomial_terms.polynomial_of_linear(fit_linear(Form(2, (1,), (1,)), data()), data())
    assert fit is not None
    for _ in range(count):
        fit = polynomial_terms.with_best_product(fit, polynomial_terms.candidate_terms(fit.variables), data())
        assert fit is not None
    return fit


def ended(fit: PolynomialFit | None) -> dict[str, Any] | None:
    if fit is None:
        return None
    return {"terms": fit.terms, "values": [Found(float(v), 1e-2) for v in fit.theta], "cost": Roughly(fit.cost, 1e-4)}


TERMS = np.array([[-1, -1, -1], [0, -1, -1], [1, -1, -1], [2, -1, -1], [0, 0, -1], [0, 2, -1], [0, 0, 0], [2, 0, 1]])
COEFFICIENTS = np.array([0.1, 1.2, -0.5, 0.2, 0.05, -0.04, -0.06, 0.03])


@NUMBERS.case()
def runs_of_products() -> dict[str, Any]:
    told: dict[str, Any] = {}
    one = grown(0)
    with loops_in_python():
        runs = Runs(one.variables, TERMS, data(lost=True))
        used = runs.used.copy()
        for name, scale in (("calm", 1.0), ("held at its ends", 1.6), ("runs away", 900.0)):
            theta = np.concatenate([scale * COEFFICIENTS, [0.3, -0.1, 0.2, 0.5]])
            equations = NormalEquations(runs, runs.ends)
            ran = equations.outputs(theta)
            if ran is None:
                told[name] = None
                continue
            slopes = [equations._slopes(index)[1] for index in range(len(LOGS))]
            told[name] = [some(ran, 9), *(some(slope[:, k], 5) for slope in slopes for k in (0, 1))]
            runs.used[:] = True
            moved = np.concatenate([part.copy() for part, _ in equations._stretches(ran)])
            told[f"{name}, slopes"] = [some(column, 4) for column in moved.T]
            runs.used[:] = used
        line = Runs(one.variables, TERMS[:4], data())
        found = line.outputs(np.concatenate([[500.0, 0.9, 0.0, 0.2], np.zeros(4)]))
        told["a linear run is not held"] = None if found is None else some(found)
        told["runs away at last"] = [
            line.outputs(np.concatenate([[size, 0.5, 0.0, 0.0], np.zeros(4)])) is None for size in (499.0, 501.0)
        ]
        told["products"] = [some(p, 4) for p in products(one.variables, TERMS, 3.0 * data().u[0], 2.0 * data().y[0]).T]
        for most in (1, 2, 4):
            fit = runs.fit(np.concatenate([COEFFICIENTS, [0.3, -0.1, 0.2, 0.5]]), most)
            told[f"{most} steps"] = None if fit is None else [fit.theta, fit.cost]
            fit = runs.fit(np.concatenate([COEFFICIENTS, [0.3, -0.1, 0.2, 0.5]]), most, 0.3)
            told[f"{most} steps of small products"] = None if fit is None else [fit.theta, fit.cost]
        told["no fit"] = runs.fit(np.concatenate([900.0 * COEFFICIENTS, np.zeros(4)]), 3) is None
    told["variables"] = [one.variables.source, one.variables.lag, one.variables.limits, one.variables.ends]
    told["around"] = [one.variables.extended_ends(share) for share in (0.0, 0.2)]
    told["starts"] = [runs.start_values(), one.variables.n_start, first_values(np.array([np.nan, 2.0, 3.0]), 2)]
    told["no starts"] = first_values(np.full(3, np.nan), 2)
    return told


@NUMBERS.case()
def products_that_are_chosen() -> dict[str, Any]:
    one = grown(1)
    told: dict[str, Any] = {f"{count} products": ended(grown(count)) for count in (0, 1, 2)}
    pools = {
        n: polynomial_terms.candidate_terms(
            replace(one.variables, lag=np.arange(n), source=np.array([0] * (n // 2) + [1] * (n - n // 2)))
        )
        for n in (2, 8, 10, 22)
    }
    told["pools"] = {str(n): [len(pool), pool[-1], int((pool[:, 2] >= 0).sum())] for n, pool in pools.items()}
    own = np.column_stack([U, np.roll(U, 1), np.zeros(N)])
    every = np.column_stack([np.roll(U, 2), U + 1e-4 * NOISE, U + 1e-2 * NOISE, np.zeros(N), NOISE])
    square = np.einsum("ij,ij->j", every, every)
    both = own.T @ answer(), every.T @ answer()
    told["gains"] = polynomial_terms._gains(own.T @ own, own.T @ every, square, *both)
    told["without"] = ended(polynomial_terms.without_term(one, 4, data()))
    told["nothing more"] = polynomial_terms.with_best_product(one, np.array([[0, 0, -1]]), data()) is None
    told["pruned"] = len(choose_polynomial._pruned(grown(2), data()).terms)
    told["criterion"] = choose_polynomial._bic(replace(one, cost=3.0), data(lost=True))
    told["criterion of what leaves nothing"] = choose_polynomial._bic(replace(one, cost=0.0), data())
    told["wild"] = [
        other_orders.is_wild(
            replace(one, theta=one.theta * np.where(np.arange(one.theta.size) == 4, size, 1.0)), data()
        )
        for size in (1.0, 0.0, -1.0, -4.0)
    ]
    told["disagreement"] = [
        other_orders.disagreement([grown(0)], one, data()),
        other_orders.disagreement([replace(one, theta=900.0 * one.theta)], one, data()),
    ]
    told["reordered"] = [some(other.u[1][:, 0], 3) for other in other_orders.reordered_channels(data())]
    return told


@NUMBERS.case()
def every_product() -> dict[str, Any]:
    told: dict[str, Any] = {}
    parts = [data().without(mask) for mask in blocks(data(), 4)]
    for name, recipe in {
        "one step": Recipe(Form(1, (2,), (0,)), 2, 1e-3),
        "free run": Recipe(Form(2, (1,), (1,)), 2, 1e-4, (1e-1,)),
        "cubes": Recipe(Form(1, (1,), (1,)), 3, 1e-4, (1e-1, 1e-2)),
    }.items():
        told[name] = ended(recipe.fit(data(lost=True)))
        judged = dense_polynomial._judged_recipe(recipe, data(), parts)
        told[f"{name}, judged"] = None if judged is None else [Found(judged.held_back, 1e-3), len(judged.fits)]
    begun = Recipe(Form(1, (1,), (1,)), 2, 1e-4, (1e-1,)).fit(data())
    told["taken on"] = ended(Recipe(Form(1, (1,), (1,)), 2, 1e-4, (1e-1, 1e-2)).fit(data(), begun))
    short = replace(data(), u=(data().u[0][:9],), y=(data().y[0][:9],))
    told["too few"] = [Recipe(Form(1, (1,), (1,)), degree, 1e-3).fit(short) is None for degree in (2, 3)]
    told["forms"] = [
        [[one.order, one.sizes, one.delays] for one in dense_polynomial.tried_forms(delays, asked)]
        for delays, asked in (
            ((4,), RequestedSizes()),
            ((1,), RequestedSizes(order=2)),
            ((1,), RequestedSizes(order=7)),
            ((1, 2), RequestedSizes(delay=0, n_numerator=2)),
        )
    ]
    told["terms"] = [len(dense_polynomial.every_term(n, degree)) for n in (1, 4, 7) for degree in (2, 3)]
    sizes = (Form(1, (2,), (1,)), Form(2, (2,), (1,)), Form(3, (5,), (1,)))
    judged = dense_polynomial.judged_recipes(data(), parts, sizes)
    told["recipes"] = [
        [one.recipe.form.order, one.recipe.degree, one.recipe.one_step, len(one.recipe.free_run)] for one in judged
    ]
    told["errors"] = [Found(one.held_back, 1e-3) for one in judged]
    return told


@cache
def linear() -> list[Candidate]:
    return linear_candidates(data(), [1, 2, 3], (1,))


@NUMBERS.case()
def choices_of_polynomials() -> dict[str, Any]:
    told: dict[str, Any] = {}
    bases = choose_polynomial._bases(linear())
    told["bases"] = [one.form.order for one in bases]
    base = linear()[0]

    def made(order: int, late: int, error: float, doubt: str = "") -> Candidate:
        fit = LinearFit(Form(order, (1,), (late,)), np.zeros(order + 2), 1.0)
        return replace(base, fit=fit, block_errors=(error,), doubt=doubt)

    rows = [made(k, late, 1.0 - 0.01 * k - 0.1 * late) for k in (1, 2, 3, 4, 5) for late in (1, 2)]
    told["bases of many"] = [[one.form.order, one.form.delays[0]] for one in choose_polynomial._bases(rows)]
    doubtful = [made(1, 1, 1.0, "no_fit"), made(2, 1, 0.5, "no_fit")]
    told["bases of doubtful ones"] = len(choose_polynomial._bases(doubtful))
    whole = polynomial_terms.polynomial_of_linear(base.fit, data())
    assert whole is not None
    growth = choose_polynomial._Growth(whole, choose_polynomial._from_linear(base.fit), data())
    told["grows"] = growth.advance(2)
    told["growth"] = [Found(one, 1e-3) for one in growth.errors]
    done = growth.finished_candidate()
    told["finished"] = [
        len(done.fit.terms),
        Found(done.held_back, 1e-3),
        Found(done.spread, 1e-2),
        Found(done.bic, 1.0),
    ]
    told["price"] = PolynomialCandidate(done.fit, done.refit, 0.4, block_errors=(0.3,), bic=0.0).price
    refit = done.refit(data(lost=True))
    told["refitted"] = ended(refit)
    recipe = Recipe(Form(1, (1,), (1,)), 2, 1e-3)
    judged = JudgedRecipe(recipe, (grown(0), grown(1)), block_errors=(0.3, 0.4))
    one = choose_polynomial._candidate(grown(1), done.refit, judged, data())
    told["candidate"] = [one.held_back, Found(one.spread, 1e-2), Found(one.bic, 1.0)]
    told["rows"] = [
        {key: value for key, value in row.items() if key in ("structure", "order", "terms", "delay", "doubt")}
        for row in (polynomial_row(one), linear_row(base))
    ]
    shares = polynomial_row(replace(one, spread=0.02, block_errors=(0.1,))), polynomial_row(replace(one, spread=np.inf))
    told["shares"] = [[row["held_back_percent"], row["spread_percent"]] for row in shares[:1]] + [
        shares[1]["spread_percent"]
    ]
    told["share of a line"] = linear_row(replace(base, block_errors=(0.25,)))["held_back_percent"]
    return told


@NUMBERS.case()
def polynomial_bodies() -> dict[str, Any]:
    one = PolynomialDynamics.of(grown(1))
    whole = channels_from([U[:, None]], [answer()], 0.1, ("a",), "y")
    by = scaled(whole)[1]
    y = np.where(np.arange(90) % 7 == 2, np.nan, data().y[0])
    told: dict[str, Any] = {
        "values": one.n_values,
        "run": some(one.run(data().u[0], y), 7),
        "one step": some(one.one_step(data().u[0], y), 7),
        "few outputs": [
            some(one.run(data().u[0], np.where(np.arange(90) < n, data().y[0], np.nan)), 3) for n in (8, 9, 0)
        ],
        "saved": PolynomialDynamics.from_dict(one.to_dict()).terms,
    }
    model = FreeRunModel(("a",), "y", 0.1, "narx", by, one)
    limits = by.u_mean[0] + by.u_std[0] * one.variables.limits[one.variables.source == 1][0]
    for name, inputs in {
        "within": np.clip(U, *(limits * (1.0 - 1e-9))),
        "above": np.where(np.arange(N) < 5, limits[1] + 0.1, np.clip(U, *limits)),
        "below": np.where(np.arange(N) < 5, limits[0] - 0.1, np.clip(U, *limits)),
    }.items():
        found = input_range_notes(model, replace(whole, u=(inputs[:, None],)))
        told[f"inputs {name}"] = [dict(note.data) for note in found]
    return told


@NUMBERS.case()
def bends() -> dict[str, Any]:
    told: dict[str, Any] = {}
    with loops_in_python():
        out, slopes = np.zeros(N), np.zeros((N, 2))
        play(np.cumsum(NOISE), 1.5, 0.2, out, slopes)
        told["play"] = [some(out, 9), some(slopes[:, 0]), some(slopes[:, 1])]
        for name, kind in NONLINEARITIES.items():
            values = np.array([-0.4, 0.5])[: len(kind.names)] if kind.level else np.array([0.3])
            bent, by = kind.apply(U, values, 0.1)
            told[name] = [some(bent, 9), *(some(one) for one in by.T), len(kind.starts(U))]
            trials = ((-0.4, 0.5), (0.5, -0.4), (0.2, 0.2), (U.min(), 0.5), (-0.4, U.max()), (-9.0, 0.5), (-0.4, 9.0))
            if kind.level:
                told[f"{name}, may"] = [kind.may(U, np.array(one)) for one in trials]
            else:
                told[f"{name}, may"] = [kind.may(U, np.array([one * np.ptp(U)])) for one in (-0.1, 0.0, 0.49, 0.51)]
    told["starts"] = [np.concatenate(found(U)) for found in (_inner, _outer, _widths)]
    return told


@NUMBERS.case(relative=1e-5)
def bent_inputs() -> dict[str, Any]:
    told: dict[str, Any] = {}
    form = Form(1, (1,), (1,))
    for kind in NONLINEARITIES:
        values = np.array([-0.6, 0.7]) if NONLINEARITIES[kind].level else np.array([0.3])
        problem = HammersteinProblem(kind, form, data(lost=True))
        starts = hammerstein_fit._first_inputs(problem)
        theta = np.concatenate([values, starts, [0.3, -0.6, 0.1, 0.2, -0.1]])
        output, slopes = problem.jacobian(theta)
        told[f"{kind}, output"] = some(output, 7)
        told[f"{kind}, slopes"] = [some(one, 4) for one in slopes.T]
        found = fit_hammerstein(kind, form, data(), [np.array([1.0, -0.8])])
        assert found is not None
        told[kind] = [[Found(float(v), 1e-2) for v in found.theta], Roughly(found.cost, 1e-4), len(found.starts)]
        spread = hammerstein_fit.deviations(found, data())
        told[f"{kind}, deviations"] = [Roughly(float(one), 1e-2) for one in spread]
        again = hammerstein_fit.refitted_hammerstein(found, data(lost=True))
        told[f"{kind}, refitted"] = Roughly(again.cost, 1e-4)
        left, bic = choose_hammerstein._held_back_errors(found, data()), choose_hammerstein._bic(found, data())
        one = choose_hammerstein.HammersteinCandidate(found, block_errors=left, bic=bic)
        told[f"{kind}, judged"] = [Found(one.held_back, 1e-3), Found(one.bic, 1.0), hammerstein_row(one)["order"]]
        body = HammersteinDynamics.of(found, spread)
        by = scaled(channels_from([U[:, None]], [answer()], 0.1, ("a",), "y"))[1]
        told[f"{kind}, told"] = {
            name: {key: Found(v, 1e-2) for key, v in row.items() if isinstance(v, float)}
            for name, row in body.nonlinearity(by).items()
            if isinstance(row, dict)
        }
        told[f"{kind}, run"] = [some(body.run(data().u[0], data().y[0]), 3), body.n_values]
        told[f"{kind}, run without outputs"] = some(body.run(data().u[0], np.full(90, np.nan)), 3)
    exact = replace(found, linear=replace(found.linear, cost=0.0))
    told["criterion of what leaves nothing"] = choose_hammerstein._bic(exact, data())
    ranked = [(float(k), np.array([float(k // 2)]), np.ones(2)) for k in range(12)]
    told["apart"] = [one[0] for one in hammerstein_fit._distinct_starts(ranked)]
    told["bases"] = [one.form.order for one in choose_hammerstein._bases(linear())]
    base = choose_hammerstein.HammersteinCandidate(found, block_errors=(1.0,), bic=3.0)
    rows = [base, replace(base, block_errors=(1.009,), bic=2.0), replace(base, block_errors=(1.011,), bic=1.0)]
    told["chosen"] = choose_hammerstein.chosen_hammerstein(rows).bic
    return told


@NUMBERS.case(relative=1e-3)
def what_is_identified() -> dict[str, Any]:
    told: dict[str, Any] = {}
    whole = channels_from([U[:, None]], [answer(0.3)], 0.1, ("a",), "y")
    for structure in ("output-error", "narx", "hammerstein", "auto", "arx"):
        found = identify_channels(whole, structure=structure, order=1, delay=1)
        told[structure] = [
            found.model.structure,
            found.held_back_percent,
            found.quality.fit_percent,
            found.sound,
            sorted({str(row["structure"]) for row in found.candidates}),
            [str(note.code) for note in found.notes],
        ]
    return told


@pytest.mark.parametrize("case", NUMBERS.cases)
@pytest.mark.filterwarnings("ignore::plant.errors.LogWarning", "ignore::plant.errors.CovarianceWarning")
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
