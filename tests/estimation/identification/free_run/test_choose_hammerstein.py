"""Which candidate with an input nonlinearity is chosen, from which linear ones they start, and how each is reported."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation.identification.free_run.candidate_rows import hammerstein_row, linear_row, polynomial_row
from estimation.identification.free_run.choose_hammerstein import (
    ORDERS,
    HammersteinCandidate,
    _bases,
    _bic,
    chosen_hammerstein,
)
from estimation.identification.free_run.choose_linear import CLEAR_GAIN
from estimation.identification.free_run.linear_problem import Form

NONE: Any = None


def candidate(held_back: float, bic: float, doubt: str = "") -> HammersteinCandidate:
    return HammersteinCandidate(NONE, doubt, block_errors=(held_back,), bic=bic)


def test_the_lowest_bic_among_candidates_nearly_as_good_as_the_best_is_chosen() -> None:
    best = candidate(0.1, 50.0)
    near = candidate(0.1 * (1.0 + 0.99 * CLEAR_GAIN), 40.0)
    far = candidate(0.1 * (1.0 + 1.01 * CLEAR_GAIN), 30.0)
    assert chosen_hammerstein([best, far]) is best
    assert chosen_hammerstein([best, near, far]) is near
    doubted = candidate(0.01, 10.0, "cancelling")
    assert chosen_hammerstein([doubted, best, near, far]) is near
    assert chosen_hammerstein([doubted]) is doubted


def linear(order: int, delay: int, held_back: float) -> Any:
    return SimpleNamespace(form=Form(order, (1,), (delay,)), held_back=held_back)


def test_hammerstein_fits_begin_at_the_best_linear_model_of_each_order_with_and_without_dead_time() -> None:
    late, later, at_once = linear(2, 1, 0.3), linear(2, 5, 0.2), linear(2, 0, 0.9)
    high, higher = linear(ORDERS, 1, 0.5), linear(ORDERS + 1, 1, 0.1)
    found = _bases([late, later, at_once, high, higher])
    assert [id(one) for one in found] == [id(one) for one in (later, at_once, high)]


@pytest.mark.parametrize("cost", [0.0, 3.0, 70.0])
def test_bic_is_that_of_a_gaussian_likelihood(cost: float) -> None:
    fit: Any = SimpleNamespace(theta=np.zeros(5), cost=cost)
    data: Any = SimpleNamespace(n_samples=200)
    found = _bic(fit, data)
    if cost == 0.0:
        assert found < _bic(SimpleNamespace(theta=np.zeros(5), cost=1e-200), data) < 0.0  # type: ignore[arg-type]
    else:
        likelihood = -100.0 * np.log(cost / 200.0)
        assert found == pytest.approx(5.0 * np.log(200.0) - 2.0 * likelihood)


def test_a_row_of_the_candidate_table_has_percentages_and_model_sizes() -> None:
    form = Form(3, (2, 1), (1, 4))
    one: Any = SimpleNamespace(form=form, held_back=0.25, bic=-7.0, aic=-9.0, doubt="")
    assert linear_row(one) == {
        "structure": "output-error",
        "order": 3,
        "numerator": [2, 1],
        "delay": [1, 4],
        "held_back_percent": 75.0,
        "bic": -7.0,
        "aic": -9.0,
        "doubt": None,
    }
    bent: Any = SimpleNamespace(linear=SimpleNamespace(form=form), kind="backlash")
    told = hammerstein_row(HammersteinCandidate(bent, "cancelling", block_errors=(0.1,), bic=-3.0))
    assert (told["held_back_percent"], told["nonlinearity"], told["doubt"]) == (90.0, "backlash", "cancelling")
    assert (told["order"], told["numerator"], told["delay"]) == (3, [2, 1], [1, 4])
    terms = np.array([[0, -1, -1], [0, 0, -1], [0, 1, 1]])
    fit: Any = SimpleNamespace(terms=terms, variables=SimpleNamespace(n_start=2, friction="velocity"))
    rubbing = polynomial_row(SimpleNamespace(fit=fit, held_back=0.5, spread=0.02, bic=1.0))  # type: ignore[arg-type]
    assert (rubbing["order"], rubbing["terms"], rubbing["friction"]) == (2, 2, "velocity")
    assert (rubbing["held_back_percent"], rubbing["spread_percent"]) == (50.0, 2.0)
    fit.variables.friction = ""
    plain = polynomial_row(SimpleNamespace(fit=fit, held_back=0.5, spread=np.inf, bic=1.0))  # type: ignore[arg-type]
    assert plain["spread_percent"] is None
    assert "friction" not in plain
