"""Which polynomial models are grown, compared and let go on, with the fits themselves made up."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation.identification.free_run import choose_polynomial
from estimation.identification.free_run.choose_polynomial import _best_grown, _dense, _with_friction
from estimation.identification.free_run.dense_polynomial import Asked
from estimation.identification.free_run.linear_fit import Form

DATA: Any = SimpleNamespace(n_samples=400, y=(np.zeros(400),), without=lambda mask: mask)


def linear(order: int, held_back: float) -> Any:
    form = Form(order, (1,), (1,))
    return SimpleNamespace(form=form, held_back=held_back, fit=SimpleNamespace(form=form, cost=10.0, name=held_back))


def rubs(
    monkeypatch: pytest.MonkeyPatch, share: dict[tuple[int, str], float], models: list[Any]
) -> tuple[list[Any], list[Any]]:
    """Return which models friction was tried on, and what grows where it leaves a share of their error."""
    asked: list[tuple[int, float, str]] = []

    def rubbing(fit: Any, friction: str, _: Any) -> Any:
        asked.append((fit.form.order, fit.name, friction))
        left = share.get((fit.form.order, friction))
        return None if left is None else SimpleNamespace(cost=left * fit.cost, theta=np.zeros(3), name=fit.name)

    monkeypatch.setattr(choose_polynomial, "fit_with_friction", rubbing)
    monkeypatch.setattr(choose_polynomial, "_Growth", lambda whole, *_: whole)
    return asked, _with_friction(models, DATA)


def test_friction_is_tried_on_two_models_of_each_order_to_the_third_and_holds_a_position_from_the_second(
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


def test_a_model_that_rubs_goes_on_where_friction_explains_a_tenth_of_the_error_and_two_of_them_do(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    models = [linear(1, 1.0), linear(2, 2.0), linear(3, 3.0)]
    _, found = rubs(monkeypatch, {(1, "velocity"): 0.89, (2, "velocity"): 0.91, (3, "position"): 0.5}, models)
    assert [one.name for one in found] == [3.0, 1.0]
    every = {(order, "velocity"): 0.8 - 0.1 * order for order in (1, 2, 3)}
    assert [one.name for one in rubs(monkeypatch, every, models)[1]] == [3.0, 2.0]


class Growing:
    """Stands in for a growth, and remembers how far it was taken."""

    def __init__(self, error: float, runs: bool = True) -> None:
        self.errors, self.runs, self.most = [9.0, error, 5.0], runs, list[int]()

    def advance(self, most: int) -> bool:
        self.most.append(most)
        return self.runs

    def finished(self) -> float:
        return self.errors[1]


def test_growths_are_compared_after_three_products_and_the_best_are_taken_to_twenty() -> None:
    growths: Any = [Growing(0.4), Growing(0.1, runs=False), Growing(0.3), Growing(0.2)]
    assert _best_grown(growths, 2) == [0.2, 0.3]
    assert [one.most for one in growths] == [[3], [3], [3, 20], [3, 20]]


def test_of_the_models_of_every_product_sixteen_and_six_larger_ones_are_fitted_but_for_wild_ones(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    small, large = "small", "large"

    def judged(rank: int, form: str) -> Any:
        fit = SimpleNamespace(wild=rank == 3, cost=1.0, theta=np.zeros(2))
        recipe = SimpleNamespace(form=form, fit=lambda _, fit=fit, rank=rank: None if rank == 5 else fit)
        return SimpleNamespace(recipe=recipe, held_back=float(rank), block_errors=(), fits=[])

    every = [judged(rank, small if rank % 2 else large) for rank in range(60, 0, -1)]
    monkeypatch.setattr(choose_polynomial, "forms_tried", lambda *_: [small])
    monkeypatch.setattr(choose_polynomial, "judged_recipes", lambda *_: every)
    monkeypatch.setattr(choose_polynomial, "is_wild", lambda fit, _: fit.wild)
    monkeypatch.setattr(choose_polynomial, "disagreement", lambda *_: 0.25)
    found = _dense(DATA, [], (1,), Asked())
    odd, even = range(1, 33, 2), range(2, 14, 2)
    assert [one.held_back for one in found] == [float(rank) for rank in (*odd, *even) if rank not in (3, 5)]
    assert found[0].price == pytest.approx(np.hypot(1.0, 0.25))
