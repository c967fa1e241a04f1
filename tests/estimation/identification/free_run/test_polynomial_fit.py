"""Polynomial models: their free run, its sensitivities, and the choice of their products."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from estimation.arrays import Array
from estimation.identification.free_run import identify
from estimation.identification.free_run.choose_polynomial import _pruned
from estimation.identification.free_run.data import Channels, channels_from, liveliest_sections, scaled
from estimation.identification.free_run.identify import identify_channels
from estimation.identification.free_run.linear_fit import fit_linear
from estimation.identification.free_run.linear_problem import Form
from estimation.identification.free_run.model import FreeRunModel
from estimation.identification.free_run.normal_equations import NormalEquations
from estimation.identification.free_run.other_orders import is_wild
from estimation.identification.free_run.polynomial_dynamics import PolynomialDynamics
from estimation.identification.free_run.polynomial_fit import PolynomialFit, Runs
from estimation.identification.free_run.polynomial_terms import (
    MOST_TRIED,
    STEPS,
    candidate_terms,
    polynomial_of_linear,
    with_best_product,
)
from estimation.identification.free_run.polynomial_variables import products, write_products
from estimation.identification.free_run.saved import load_models, save_models
from plant.errors import HydrostateError


def duffing(n: int, seed: int, noise: float = 0.01) -> tuple[Array, Array]:
    """Return input and output of a resonance whose spring stiffens with the cube of the deflection."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.normal(size=n // 4 + 1), 4)[:n]
    y = np.zeros(n)
    for t in range(2, n):
        y[t] = 1.5 * y[t - 1] - 0.7 * y[t - 2] + 0.2 * u[t - 1] - 0.05 * y[t - 1] ** 3
    return u, y + noise * rng.normal(size=n)


def log(n: int = 400, seed: int = 1) -> Channels:
    u, y = duffing(n, seed)
    return channels_from([u[:, None]], [y], 0.01, ["force"], "deflection")


def grown(of: Channels) -> tuple[Channels, PolynomialFit]:
    """Return scaled data, and the polynomial model that starts from a linear model of them."""
    data, _ = scaled(of)
    start = polynomial_of_linear(fit_linear(Form(2, (1,), (1,)), data), data)
    assert start is not None
    return data, start


def test_a_polynomial_fit_begins_with_the_error_of_its_linear_model() -> None:
    data, _ = scaled(log())
    linear = fit_linear(Form(2, (1,), (1,)), data)
    start = polynomial_of_linear(linear, data)
    assert start is not None
    assert start.cost == pytest.approx(linear.cost, rel=1e-2)


def test_sensitivities_are_the_derivatives_of_the_free_run() -> None:
    data, start = grown(log(150))
    fit = with_best_product(start, candidate_terms(start.variables), data)
    assert fit is not None
    runs = Runs(fit.variables, fit.terms, data)
    equations = NormalEquations(runs, runs.ends)
    assert equations.outputs(fit.theta) is not None
    left = np.random.default_rng(4).normal(size=runs.target.size)
    gram, right = equations.sums(left)
    steps = 1e-6 * np.eye(fit.theta.size)
    ends = [[runs.outputs(fit.theta + sign * step) for step in steps] for sign in (1.0, -1.0)]
    jacobian = (np.array(ends[0]) - np.array(ends[1])).T[runs.used] / 2e-6
    assert gram == pytest.approx(jacobian.T @ jacobian, rel=1e-5, abs=1e-4)
    assert right == pytest.approx(jacobian.T @ left[runs.used], rel=1e-5, abs=1e-4)


def test_the_product_in_the_plant_is_the_first_one_added() -> None:
    data, start = grown(log())
    fit = with_best_product(start, candidate_terms(start.variables), data)
    assert fit is not None
    lags = [(int(fit.variables.source[v]), int(fit.variables.lag[v])) for v in fit.terms[-1]]
    assert {source for source, _ in lags} == {0}  # the cube of the output; its lags depend on the noise
    assert fit.cost < 0.2 * start.cost


def test_auto_takes_a_polynomial_model_for_a_stiffening_spring_and_a_linear_one_for_a_linear_plant() -> None:
    stiff = identify_channels(log(), structure="auto", order=2, delay=1)
    assert stiff.model.structure == "narx"
    u, y = duffing(400, 7)
    assert stiff.model.quality([u[:, None]], [y]).fit_percent > 95.0
    rng = np.random.default_rng(2)
    u = rng.normal(size=300)
    y = np.zeros(300)
    for t in range(1, 300):
        y[t] = 0.8 * y[t - 1] + 0.3 * u[t - 1]
    linear = channels_from([u[:, None]], [y + 0.05 * rng.normal(size=300)], 1.0, ["u"], "y")
    assert identify_channels(linear, structure="auto", order=1, delay=1).model.structure == "output-error"


def test_a_saved_model_simulates_the_same_output(tmp_path: object) -> None:
    path = tmp_path / "model.json"  # type: ignore[operator]
    u, y = duffing(300, 3)
    for structure in ("narx", "output-error"):
        model = identify_channels(log(300), structure=structure, order=2, delay=1).model
        save_models([model], path)
        (again,) = load_models(path)
        assert again.simulate(u, y) == pytest.approx(model.simulate(u, y), abs=1e-12)
        assert again.predict(u, y)[5:] == pytest.approx(model.predict(u, y)[5:], abs=1e-12)
    path.write_text("[]")
    with pytest.raises(HydrostateError, match="holds no saved model"):
        load_models(path)
    with pytest.raises(HydrostateError, match="of format 'hydrostate-model'"):
        FreeRunModel.from_dict({"format": "other"})
    entries = model.to_dict()
    assert entries["version"] == 1, "a later version reads what an earlier one wrote"
    with pytest.raises(HydrostateError, match="version 2 at most, is needed, got 'hydrostate-model', version 3"):
        FreeRunModel.from_dict({**entries, "version": 3})


def test_a_model_that_leaves_its_range_with_reordered_inputs_is_wild() -> None:
    data, start = grown(log())
    fit = with_best_product(start, candidate_terms(start.variables), data)
    assert fit is not None
    assert not is_wild(fit, data)
    theta = fit.theta.copy()
    theta[fit.terms.shape[0] - 1] *= -3.0  # the spring softens
    assert is_wild(replace(fit, theta=theta), data)


def test_a_run_beyond_the_fitted_range_stays_finite() -> None:
    model = identify_channels(log(), structure="narx", order=2, delay=1).model
    assert np.isfinite(model.simulate(3.0 * duffing(400, 4)[0])).all()


def test_factors_of_products_are_clipped_to_the_fitted_range_and_single_terms_are_not() -> None:
    _, start = grown(log())
    far = 100.0 * np.ones((5, 1))
    terms = np.array([[2, -1, -1], [2, 2, -1]])
    single, square = products(start.variables, terms, far, np.zeros(5))[-1]
    assert single == 100.0
    assert square == pytest.approx(start.variables.limits[2, 1] ** 2)


def test_pruning_removes_a_product_without_effect_and_keeps_that_of_the_plant() -> None:
    data, start = grown(log())
    own = with_best_product(start, candidate_terms(start.variables), data)
    assert own is not None
    assert np.array_equal(_pruned(own, data).terms, own.terms)
    idle = next(term for term in candidate_terms(start.variables) if {start.variables.source[v] for v in term} == {1})
    terms, k = np.vstack([own.terms, idle]), own.terms.shape[0]
    both = Runs(own.variables, terms, data).fit(np.insert(own.theta, k, 0.0), 5)
    assert both is not None
    assert np.array_equal(_pruned(both, data).terms, own.terms)


TERMS = np.array([[-1, -1, -1], [0, -1, -1], [1, -1, -1], [2, -1, -1], [0, 1, -1], [0, 2, -1], [0, 0, 1], [1, 2, 2]])


@pytest.mark.parametrize("way", [lambda loop: loop, lambda loop: loop.__wrapped__], ids=["compiled", "Python"])
def test_products_of_several_signals_use_clipped_values_and_single_signals_do_not(way: Callable[[Any], Any]) -> None:
    single = np.random.default_rng(4).normal(size=(9, 3))
    held, out = np.clip(single, -0.5, 0.5), np.full((9, TERMS.shape[0] + 2), 7.0)
    way(write_products)(single, held, TERMS, out)
    for column, term in zip(out.T, TERMS, strict=False):
        factors = [v for v in term if v >= 0]
        wanted = single[:, factors[0]] if len(factors) == 1 else np.prod(held[:, factors], axis=1)
        assert column == pytest.approx(wanted)
    assert (out[:, TERMS.shape[0] :] == 7.0).all()


def test_slopes_are_computed_only_for_accepted_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    data, start = grown(log(200))
    runs, costs, asked = Runs(start.variables, start.terms, data), list[float](), list[int]()
    outputs, sums = NormalEquations.outputs, NormalEquations.sums

    def running(self: NormalEquations, theta: Array) -> Any:
        found = outputs(self, theta)
        costs.append(np.inf if found is None else float(np.nansum((found - runs.target) ** 2)))
        return found

    def asking(self: NormalEquations, left: Array) -> Any:
        asked.append(len(costs) - 1)
        return sums(self, left)

    monkeypatch.setattr(NormalEquations, "outputs", running)
    monkeypatch.setattr(NormalEquations, "sums", asking)
    far = start.theta * np.array([1.0, 0.2, -1.0, -4.0, 1.0, 1.0])
    assert runs.fit(far, 40) is not None
    lowering = [k for k, cost in enumerate(costs) if cost < min(costs[:k], default=np.inf)]
    assert asked == lowering
    assert len(asked) < len(costs)


def test_a_diverging_fit_is_wild_gets_no_product_and_predicts_nan() -> None:
    data, start = grown(log())
    away = replace(start, theta=5.0 * start.theta)
    runs = Runs(away.variables, away.terms, data)
    assert runs.outputs(away.theta) is None
    assert runs.fit(away.theta, 10) is None
    assert with_best_product(away, candidate_terms(away.variables), data) is None
    assert is_wild(away, data)
    body = PolynomialDynamics.of(away)
    assert np.isnan(body.run(data.u[0], data.y[0])).all()


def test_no_product_is_added_if_none_reduces_the_error_or_every_free_run_diverges(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    data, start = grown(log())
    pool = candidate_terms(start.variables)
    explained = replace(start, cost=1e9 * start.cost)
    assert with_best_product(explained, pool, data) is None
    tried: list[tuple[int, int]] = []
    monkeypatch.setattr(Runs, "fit", lambda _, theta, steps: tried.append((theta.size, steps)))
    assert with_best_product(start, pool, data) is None
    assert tried == [(start.theta.size + 1, STEPS)] * MOST_TRIED


def test_a_requested_polynomial_model_is_refused_if_none_runs_freely(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(identify, "polynomial_candidates", lambda *_: [])
    with pytest.raises(HydrostateError, match="no polynomial model of 'deflection' runs free without growing beyond"):
        identify_channels(log(), structure="narx", order=2, delay=1)
    assert identify_channels(log(), structure="auto", order=2, delay=1).model.structure != "narx"


def test_the_section_of_a_long_log_is_its_most_excited_part() -> None:
    quiet, u = np.zeros((1000, 1)), np.zeros((3000, 1))
    u[1200:1500, 0] = np.sin(np.arange(300.0))
    data = channels_from([u, quiet], [np.arange(3000.0), np.arange(1000.0)], 1.0, ["u"], "y")
    assert liveliest_sections(data, 4000) is data
    part = liveliest_sections(data, 400)
    assert [len(one) for one in part.y] == [300, 100]
    first = int(part.y[0][0])
    np.testing.assert_array_equal(part.u[0], u[first : first + 300])
    assert first in np.linspace(0, 2700, 11).astype(int)
    assert np.var(part.u[0]) > 0.5 * np.var(u[1200:1500])


def test_a_model_is_read_from_the_output_file_of_the_command(tmp_path: Path) -> None:
    model = identify_channels(log(300), structure="output-error", order=2, delay=1).model
    entries = [{"rows": []}, {"model": "none"}, {"model": model.to_dict()}]
    (tmp_path / "found.json").write_text(json.dumps(entries))
    (again,) = load_models(tmp_path / "found.json")
    assert again.to_dict() == model.to_dict()
