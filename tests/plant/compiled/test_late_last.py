"""Reordered sums and products keep their value, and the last input to arrive passes only one operation of each."""

import numpy as np
import pytest

from plant.compiled.expression import Expression, node, symbol
from plant.compiled.functions import absolute, sqrt, tanh, where
from plant.compiled.late_last import CALL_LATENCY, LATENCY, late_last
from tests.kernels import computed

X, Y, Z, W = (symbol(name) for name in "xyzw")
MIXED: dict[str, Expression] = {
    "signs": (X - (Y - Z * W)) - (W - X * X) * 2.0,
    "negative": (1.0 - X) - (Y + Z),
    "shared": (X * Y + Z) * (X * Y - Z) / (X + Y),
    "chosen": where(X > Y, X * Y * Z - W, absolute(W - Z * X)),
    "called": sqrt(X * X + Y * Y * Z * Z) + tanh(X - W),
    "handed": X,
}


@pytest.mark.parametrize("late", [(), ("x",), ("w", "x"), ("z",)])
def test_reordered_sums_and_products_keep_their_values(late: tuple[str, ...]) -> None:
    made, _ = late_last(MIXED, {name: 10.0 * i for i, name in enumerate(late)})
    for values in np.random.default_rng(2).normal(size=(20, 4)).tolist():
        given = dict(zip("xyzw", values, strict=True))
        assert computed(made, **given) == pytest.approx(computed(MIXED, **given), rel=1e-12)


def test_the_latest_input_passes_at_most_one_product_and_one_sum() -> None:
    for mixed in (((X * Y) * Z + Y) + Z, X * Y + Z * W, (X + Y) * Z - W):
        _, times = late_last({"f": mixed}, {"x": 0.0})
        fused = LATENCY["*"]  # a sum is fused with its product
        assert times["f"] == (fused if mixed.operation == "+" else LATENCY["+"] + fused)


def test_terms_that_cancel_are_not_computed() -> None:
    made, times = late_last({"f": (X + Y) - X}, {"x": 0.0})
    assert made["f"] is Y
    assert times["f"] == -np.inf
    assert computed(late_last({"f": (Y + X) - (X + Y)}, {"x": 0.0})[0], x=0.1, y=1.5) == {"f": 0.0}


def test_a_late_condition_adds_no_latency_and_a_call_adds_its_own() -> None:
    _, times = late_last({"chosen": where(X > Y, Y, Z), "called": tanh(X), "root": sqrt(X)}, {"x": 5.0})
    assert times == {"chosen": -np.inf, "called": 5.0 + CALL_LATENCY, "root": 5.0 + LATENCY["sqrt"]}


def test_a_product_shared_by_two_outputs_stays_shared() -> None:
    product = X * Y
    made, _ = late_last({"a": product * Z, "b": product * W}, {"x": 0.0})
    assert made["a"].arguments[0] is node("*", Y, X) or made["a"].arguments[1] is node("*", Y, X)
