"""Which polynomial models are grown, compared and continued, with stubs in place of the fits."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation.identification.free_run import choose_polynomial
from estimation.identification.free_run.choose_polynomial import (
    _best_grown,
    _dense_candidates,
    _fitted,
    _growths_with_friction,
)
from estimation.identification.free_run.dense_polynomial import Recipe, RequestedSizes
from estimation.identification.free_run.linear_problem import Form

DATA: Any = SimpleNamespace(n_samples=400, y=(np.zeros(400),), without=lambda mask: mask)


def linear(order: int, held_back: float) -> Any:
    form = Form(order, (1,), (1,))
    return SimpleNamespace(form=form, held_back=held_back, fit=SimpleNamespace(form=form, cost=10.0, name=held_back))


def rubs(
    monkeypatch: pytest.MonkeyPatch, share: dict[tuple[int, str], float], models: list[Any]
) -> tuple[list[Any], list[Any]]:
    """Return the models on which friction was tried, and those that grow if it leaves a given share of their error."""
    asked: list[tuple[int, float, str]] = []

    def rubbing(fit: Any, friction: str, _: Any) -> Any:
        asked.append((fit.form.order, fit.name, friction))
        left = share.get((fit.form.order, friction))
        return None if left is None else SimpleNamespace(cost=left * fit.cost, theta=np.zeros(3), name=fit.name)

    monkeypatch.setattr(choose_polynomial, "fit_with_friction", rubbing)
    monkeypatch.setattr(choose_polynomial, "_Growth", lambda whole, *_: whole)
    return asked, _growths_with_friction(models, DATA)


def test_friction_is_tried_on_the_best_two_models_of_orders_1_to_3_and_position_friction_from_order_2(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    models = [linear(order, 0.1 * rank + order) for order in (1, 2, 3, 4) for rank in (3, 1, 2)]
    asked, found = rubs(monkeypatch, {}, models)
    assert asked == [
        (order, order + 0.1 * rank, friction)
        for order in (1, 2, 3)
        for rank in (1, 2)
        for friction in (("velocity", "position") if order > 1 else ("velocity",))
    ]
    assert found == []


def test_the_best_two_models_with_friction_are_kept_if_it_explains_a_tenth_of_the_error(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    models = [linear(1, 1.0), linear(2, 2.0), linear(3, 3.0)]
    _, found = rubs(monkeypatch, {(1, "velocity"): 0.89, (2, "velocity"): 0.91, (3, "position"): 0.5}, models)
    assert [one.name for one in found] == [3.0, 1.0]
    every = {(order, "velocity"): 0.8 - 0.1 * order for order in (1, 2, 3)}
    assert [one.name for one in rubs(monkeypatch, every, models)[1]] == [3.0, 2.0]


class Growing:
    """Stub of a growth that records how far it was taken."""

    def __init__(self, error: float, runs: bool = True) -> None:
        self.errors, self.runs, self.most = [9.0, error, 5.0], runs, list[int]()

    def advance(self, most: int) -> bool:
        self.most.append(most)
        return self.runs

    def finished_candidate(self) -> float:
        return self.errors[1]


def test_growing_models_are_compared_at_three_products_and_the_best_grow_to_twenty() -> None:
    growths: Any = [Growing(0.4), Growing(0.1, runs=False), Growing(0.3), Growing(0.2)]
    assert _best_grown(growths, 2) == [0.2, 0.3]
    assert [one.most for one in growths] == [[3], [3], [3, 20], [3, 20]]


def made_up(monkeypatch: pytest.MonkeyPatch, error: Callable[[int], float]) -> list[int]:
    """Judge sixty models with every product by an error given by rank; return the ranks that are fitted to all data."""
    small, large = "small", "large"
    fitted: list[int] = []

    def judged(rank: int, form: str) -> Any:
        fit = SimpleNamespace(wild=rank == 3, cost=1.0, theta=np.zeros(2))

        def whole(_: Any) -> Any:
            fitted.append(rank)
            return None if rank == 5 else fit

        return SimpleNamespace(
            recipe=SimpleNamespace(form=form, fit=whole), held_back=error(rank), block_errors=(error(rank),), fits=[]
        )

    every = [judged(rank, small if rank % 2 else large) for rank in range(60, 0, -1)]
    monkeypatch.setattr(choose_polynomial, "tried_forms", lambda *_: [small])
    monkeypatch.setattr(choose_polynomial, "judged_recipes", lambda *_: every)
    monkeypatch.setattr(choose_polynomial, "is_wild", lambda fit, _: fit.wild)
    monkeypatch.setattr(choose_polynomial, "disagreement", lambda *_: 0.25)
    return fitted


def test_the_best_sixteen_dense_models_and_six_larger_ones_are_kept_except_wild_ones(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made_up(monkeypatch, lambda rank: 1.0 + 1e-6 * rank)
    found = _dense_candidates(DATA, [], (1,), RequestedSizes(), np.inf)
    ranks = sorted((*range(1, 33, 2), *range(2, 14, 2)))
    assert [one.held_back for one in found] == [1.0 + 1e-6 * rank for rank in ranks if rank not in (3, 5)]
    assert found[0].price == pytest.approx(np.hypot(1.0, 0.25), abs=1e-5)


def test_a_model_that_can_no_longer_be_the_best_is_not_fitted_to_all_data(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # the price of the first model is 1.031 with its spread of 0.25: the fifth has a larger held-back error
    fitted = made_up(monkeypatch, lambda rank: 0.99 + 0.01 * rank)
    assert [one.held_back for one in _dense_candidates(DATA, [], (1,), RequestedSizes(), np.inf)] == pytest.approx(
        [1.0, 1.01, 1.03]
    )
    assert fitted == [1, 2, 3, 4]
    fitted.clear()
    assert [one.held_back for one in _dense_candidates(DATA, [], (1,), RequestedSizes(), 1.005)] == pytest.approx([1.0])
    assert fitted == [1]


def test_the_fit_of_a_recipe_starts_from_that_with_one_penalty_fewer() -> None:
    steps: list[tuple[Any, Any, Any]] = []

    class Noted(Recipe):
        def fit(self, data: Any, begun: Any = None) -> Any:
            steps.append((data, self.free_run, begun))
            return self.free_run

    known: dict[Any, Any] = {}
    form = Form(1, (1,), (1,))
    assert _fitted(Noted(form, 2, 1e-4, (0.1, 0.01)), DATA, known) == (0.1, 0.01)
    assert _fitted(Noted(form, 2, 1e-4, (0.1, 0.01, 0.001)), DATA, known) == (0.1, 0.01, 0.001)
    chain = [(), (0.1,), (0.1, 0.01), (0.1, 0.01, 0.001)]
    assert steps == [(DATA, one, begun) for one, begun in zip(chain, [None, *chain[:-1]], strict=True)]
