"""Models of few products: their selection, which never uses a held-back block, and a log that only they describe."""

import numpy as np
import pytest

from estimation.arrays import Array
from estimation.identification.free_run import choose_polynomial
from estimation.identification.free_run.choose_linear import linear_candidates
from estimation.identification.free_run.data import Channels, blocks, channels_from, scaled
from estimation.identification.free_run.dense_polynomial import RequestedSizes
from estimation.identification.free_run.held_back import BLOCKS
from estimation.identification.free_run.linear_problem import Form
from estimation.identification.free_run.model import FreeRunModel
from estimation.identification.free_run.polynomial_dynamics import PolynomialDynamics
from estimation.identification.free_run.selected_polynomial import (
    TERM_COUNTS,
    Selection,
    best_regressors,
    forms_selected,
    judged_selections,
)

FORM = Form(2, (2,), (0,))


def sparse(n: int = 400, noise: float = 0.0) -> Channels:
    """Return a log of a plant with four terms, of the 35 that two lags have."""
    rng = np.random.default_rng(1)
    u = rng.uniform(-1.0, 1.0, n)
    y = np.zeros(n)
    for t in range(2, n):
        y[t] = 0.6 * y[t - 1] + 0.5 * u[t - 1] - 0.3 * u[t - 1] * y[t - 2] + 0.2 * u[t] ** 3
    return channels_from([u[:, None]], [y + noise * rng.normal(size=n)], 1.0, ["u"], "y")


def driven(n: int, seed: int, noise: float) -> tuple[Array, Array]:
    """Return two inputs and an output with their product and a lag of four: 120 terms cannot hold all such products."""
    rng = np.random.default_rng(seed)
    u = np.column_stack([np.repeat(rng.uniform(-1.0, 1.0, n // 3 + 1), 3)[:n], rng.uniform(0.0, 1.0, n)])
    y = np.zeros(n)
    for t in range(4, n):
        y[t] = 0.5 * y[t - 1] + 0.4 * y[t - 4] * u[t - 4, 1] + u[t - 1, 0] * (1.0 - 0.8 * u[t - 4, 1])
    return u, y + noise * rng.normal(size=n)


def test_the_terms_of_a_sparse_plant_are_selected() -> None:
    data = sparse()
    fit = Selection(FORM, 4).fit(data)
    assert fit is not None
    told = {tuple(int(v) for v in term if v >= 0): value for term, value in zip(fit.terms, fit.theta, strict=False)}
    assert told == pytest.approx({(0,): 0.6, (3,): 0.5, (1, 3): -0.3, (2, 2, 2): 0.2}, abs=1e-6)


def test_each_regressor_is_rated_by_its_contribution_beyond_those_already_selected() -> None:
    rng = np.random.default_rng(2)
    columns = rng.normal(size=(200, 4))
    columns = np.column_stack([columns, columns[:, 0] + columns[:, 1]])
    wanted = columns[:, 0] + 2.0 * columns[:, 1] + 0.1 * columns[:, 2]
    found = best_regressors(columns.T @ columns, columns.T @ wanted, 5)
    # the sum explains most; one of its parts is then added, after which the other part adds nothing
    assert found[0] == 4
    assert found[1] in (0, 1)
    assert len(found) == 4
    residual = wanted - columns[:, found[:3]] @ np.linalg.lstsq(columns[:, found[:3]], wanted, rcond=None)[0]
    assert np.abs(residual).max() < 1e-9


def test_a_held_back_block_does_not_affect_the_selection_of_terms() -> None:
    data = sparse(noise=0.2)
    mask = blocks(data, BLOCKS)[1]
    spoilt = Channels(data.inputs, data.output, 1.0, data.u, (np.where(mask[0], 50.0, data.y[0]),))
    for recipe in (Selection(FORM, 9), Selection(FORM, 9, descended=True)):
        one, other = recipe.fit(data.without(mask)), recipe.fit(spoilt.without(mask))
        assert one is not None
        assert other is not None
        assert np.array_equal(one.terms, other.terms)
        assert np.array_equal(one.theta, other.theta)


def test_selections_are_refined_and_judged_by_their_free_run() -> None:
    data = sparse(noise=0.05)
    judged = judged_selections(data, [data.without(mask) for mask in blocks(data, BLOCKS)], [FORM])
    assert {one.recipe.count for one in judged} == set(TERM_COUNTS)
    best = min(judged, key=lambda one: one.held_back)
    assert best.recipe.descended, "noise at the output biases one step"
    assert best.held_back == pytest.approx(0.05, rel=0.15)
    whole = best.recipe.fit(data)
    assert whole is not None
    assert np.sqrt(whole.cost / data.n_samples) == pytest.approx(0.05, rel=0.15)


def test_a_selection_from_thirty_input_lags_has_the_requested_number_of_terms() -> None:
    found = Selection(Form(4, (30,), (0,)), 6).fit(sparse())
    assert found is not None
    assert found.terms.shape == (6, 3)


def test_too_few_samples_give_no_model() -> None:
    assert Selection(FORM, 6).fit(sparse(40)) is None
    data = sparse(40)
    assert judged_selections(data, [data.without(mask) for mask in blocks(data, BLOCKS)], [FORM]) == []


def test_requested_sizes_are_kept() -> None:
    assert {one.order for one in forms_selected((5,), RequestedSizes())} == {2, 3, 4}
    assert {one.delays for one in forms_selected((5,), RequestedSizes())} == {(0,), (1,), (5,)}
    assert forms_selected((5, 1), RequestedSizes(order=7, delay=2, n_numerator=3)) == [Form(7, (3, 3), (2, 2))]


@pytest.mark.slow
def test_selected_terms_fit_a_short_log_of_a_sparse_plant_better_than_all_products(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    (u, y), (test_u, test_y) = driven(160, 3, 0.02), driven(400, 4, 0.0)
    raw = channels_from([u], [y], 1.0, ["u", "v"], "y")
    data, by = scaled(raw)
    linear, left = linear_candidates(data, [1, 2], (1, 1)), list[float]()
    for kept in (choose_polynomial._selected_candidates, lambda *_: []):
        monkeypatch.setattr(choose_polynomial, "_selected_candidates", kept)
        best = min(choose_polynomial.polynomial_candidates(linear, data), key=lambda one: one.price)
        model = FreeRunModel(("u", "v"), "y", 1.0, "narx", by, PolynomialDynamics.of(best.fit))
        left.append(model.quality([test_u], [test_y]).fit_percent)
    assert left[0] > 90.0
    assert left[1] < 80.0, "there are too few samples for every product of four lags"
