"""Models with every product: their least squares, their penalty, and how they are judged."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.arrays import Array
from estimation.identification.free_run.choose_linear import linear_candidates
from estimation.identification.free_run.choose_polynomial import polynomial_candidates
from estimation.identification.free_run.data import Channels, blocks, channels_from, scaled
from estimation.identification.free_run.dense_polynomial import (
    Recipe,
    RequestedSizes,
    every_term,
    judged_recipes,
    tried_forms,
)
from estimation.identification.free_run.held_back import BLOCKS
from estimation.identification.free_run.identify import identify_channels
from estimation.identification.free_run.linear_problem import Form
from estimation.identification.free_run.other_orders import disagreement, reordered_channels
from estimation.identification.free_run.polynomial_dynamics import PolynomialDynamics
from estimation.identification.free_run.polynomial_fit import Runs


def bilinear(n: int, seed: int, noise: float) -> tuple[Array, Array]:
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.normal(size=n // 4 + 1), 4)[:n]
    y = np.zeros(n)
    for t in range(1, n):
        y[t] = 0.8 * y[t - 1] + 0.2 * u[t - 1] - 0.1 * np.clip(u[t - 1], -2.0, 2.0) * y[t - 1]
    return u, y + noise * rng.normal(size=n)


def log(n: int = 400, seed: int = 1, noise: float = 0.01) -> Channels:
    u, y = bilinear(n, seed, noise)
    return scaled(channels_from([u[:, None]], [y], 1.0, ["u"], "y"))[0]


RECIPE = Recipe(Form(1, (1,), (1,)), 2, 1e-8)


def test_without_noise_one_least_squares_finds_the_terms_of_a_bilinear_plant() -> None:
    u = np.random.default_rng(1).uniform(-1.0, 1.0, 200)
    y = np.zeros(200)
    for t in range(1, 200):
        y[t] = 0.5 * y[t - 1] + u[t - 1] - 0.3 * u[t - 1] * y[t - 1]
    data = channels_from([u[:, None]], [y], 1.0, ["u"], "y")
    fit = RECIPE.fit(data)
    assert fit is not None
    told = {tuple(int(v) for v in term if v >= 0): value for term, value in zip(fit.terms, fit.theta, strict=False)}
    assert told[0,] == pytest.approx(0.5, abs=1e-5)
    assert told[1,] == pytest.approx(1.0, abs=1e-5)
    assert told[0, 1] == pytest.approx(-0.3, abs=1e-5)
    assert told[0, 0] == pytest.approx(0.0, abs=1e-5)


def test_a_held_back_block_does_not_affect_the_fit() -> None:
    data = log()
    mask = blocks(data, BLOCKS)[1]
    spoilt = Channels(data.inputs, data.output, 1.0, data.u, (np.where(mask[0], 50.0, data.y[0]),))
    for recipe in (RECIPE, Recipe(Form(2, (2,), (0,)), 2, 1e-4, (1e-2,))):
        one, other = recipe.fit(data.without(mask)), recipe.fit(spoilt.without(mask))
        assert one is not None
        assert other is not None
        assert np.array_equal(one.theta, other.theta)


def test_a_larger_penalty_gives_smaller_coefficients_and_a_larger_error() -> None:
    data = log(noise=0.2)
    sizes, costs = list[float](), list[float]()
    for penalty in (1e-6, 1e-1, 1e1):
        fit = Recipe(Form(2, (2,), (0,)), 2, 1e-8, (penalty,)).fit(data)
        assert fit is not None
        sizes.append(float(np.sum(fit.coefficients[fit.terms[:, 1] >= 0] ** 2)))
        costs.append(fit.cost)
    assert sizes[0] > sizes[1] > sizes[2]
    assert costs[0] < costs[1] < costs[2]


def test_too_few_samples_give_no_model() -> None:
    data = log(60)
    assert Recipe(Form(3, (3,), (0,)), 3, 1e-4).fit(data) is None
    parts = [data.without(mask) for mask in blocks(data, BLOCKS)]
    assert judged_recipes(data, parts, [Form(3, (30,), (0,))]) == []


def test_requested_sizes_are_kept() -> None:
    assert {form.order for form in tried_forms((5,), RequestedSizes())} == {1, 2, 3}
    assert {form.delays for form in tried_forms((5,), RequestedSizes())} == {(0,), (1,), (5,)}
    assert tried_forms((5, 1), RequestedSizes(order=4, delay=2)) == [Form(4, (4, 4), (2, 2))]
    assert tried_forms((5,), RequestedSizes(order=2, delay=2, n_numerator=7)) == [Form(2, (7,), (2,))]


def late_product(n: int = 500) -> Channels:
    """Return a log of a plant that responds to the input three samples ago, and to its product with the last input."""
    rng = np.random.default_rng(3)
    u = rng.uniform(-1.5, 1.5, n)
    y = np.zeros(n)
    for t in range(3, n):
        y[t] = 0.5 * y[t - 1] + u[t - 3] + 0.5 * u[t - 3] * u[t - 1]
    return scaled(channels_from([u[:, None]], [y + 0.01 * rng.normal(size=n)], 1.0, ["u"], "y"))[0]


def test_a_lag_beyond_the_first_sizes_is_found_and_much_larger_sizes_are_not_tried() -> None:
    data = late_product()
    parts = [data.without(mask) for mask in blocks(data, BLOCKS)]
    forms = [Form(1, (2,), (0,)), Form(1, (3,), (0,))]
    found = judged_recipes(data, parts, forms)
    best = min(found, key=lambda one: one.held_back)
    assert best.recipe.form.sizes == (4,)
    assert best.held_back < 0.1 * min(one.held_back for one in found if one.recipe.form in forms)
    assert max(one.recipe.form.sizes[0] for one in found) <= 5


def test_the_fit_of_a_log_that_begins_in_motion_leaves_only_the_noise() -> None:
    data, recipe = late_product(), Recipe(Form(1, (4,), (0,)), 2, 1e-8, (1e-6,))
    assert np.ptp(data.u[0][:4]) > 1.0
    fit = recipe.fit(data)
    assert fit is not None
    noise = 0.01 / 1.27  # over the output's deviation
    assert np.sqrt(fit.cost / 500) == pytest.approx(noise, rel=0.25)
    two = replace(data, u=(data.u[0],) * 2, y=(data.y[0], np.roll(data.y[0], 1)))
    runs = Runs(fit.variables, fit.terms, two)
    theta = np.concatenate([fit.coefficients, runs.start_values()])
    ran = runs.outputs(theta)
    assert ran is not None
    assert ran[:3] == pytest.approx(data.y[0][:3])
    assert not runs.used[:2].any()
    assert runs.used[2:500].all()


def test_the_effect_of_inputs_before_the_log_on_a_run_decays() -> None:
    data = late_product()
    fit = Recipe(Form(1, (4,), (0,)), 2, 1e-8, (1e-6,)).fit(data)
    assert fit is not None
    body, begin = PolynomialDynamics.of(fit), 211
    u, y = data.u[0][begin : begin + 40], data.y[0][begin : begin + 40]
    error = body.run(u, y) - y
    assert np.abs(error[2:]).max() < 0.04
    assert np.abs(error[:2]).max() > 0.1  # inputs before the log are unknown, and outputs are not copied
    assert np.isfinite(body.run(u, np.full(40, np.nan))).all()


def test_requested_lags_do_not_grow() -> None:
    data = late_product()
    parts = [data.without(mask) for mask in blocks(data, BLOCKS)]
    found = judged_recipes(data, parts, [Form(1, (3,), (0,))], RequestedSizes(order=1, n_numerator=3))
    assert {one.recipe.form for one in found} == {Form(1, (3,), (0,))}


def test_every_product_occurs_once() -> None:
    terms = every_term(4, 3)
    assert len(terms) == 1 + 4 + 10 + 20
    assert len({tuple(term) for term in terms.tolist()}) == len(terms)


def test_reordered_inputs_have_the_same_values() -> None:
    data = log()
    others = list(reordered_channels(data))
    assert all(sorted(one.u[0][:, 0]) == sorted(data.u[0][:, 0]) for one in others)
    assert not any(np.array_equal(one.u[0], data.u[0]) for one in others)


def test_fits_agree_with_many_clean_samples_and_disagree_with_few_noisy_ones() -> None:
    found: list[float] = []
    for n, noise in ((800, 0.01), (150, 0.3)):
        data, recipe = log(n, noise=noise), Recipe(Form(2, (2,), (0,)), 3, 1e-5)
        fits = [recipe.fit(data.without(mask)) for mask in blocks(data, BLOCKS)]
        whole = recipe.fit(data)
        assert whole is not None
        found.append(disagreement([fit for fit in fits if fit is not None], whole, data))
    assert found[0] < 0.05 < 0.1 < found[1]


def test_the_price_of_a_model_includes_the_disagreement_of_its_fits() -> None:
    data = log()
    every = polynomial_candidates(
        linear_candidates(data, [1], (1,)), data, RequestedSizes(order=1, delay=1, n_numerator=1)
    )
    assert len(every) > 1
    for one in every:
        assert one.price == pytest.approx(np.hypot(one.held_back, one.spread))
        assert one.price > one.held_back


def test_the_model_of_a_bilinear_plant_simulates_another_log_well() -> None:
    u, y = bilinear(400, 1, 0.02)
    asked = {"order": 1, "delay": 1, "n_numerator": 1}
    model = identify_channels(channels_from([u[:, None]], [y], 1.0, ["u"], "y"), structure="narx", **asked).model
    u, y = bilinear(400, 9, 0.0)
    assert model.quality([u[:, None]], [y]).fit_percent > 95.0
