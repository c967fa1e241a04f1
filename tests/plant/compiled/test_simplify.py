"""A simplified graph gives the same values up to rounding, with fewer operations."""

from collections.abc import Mapping

import numpy as np
import pytest

from plant.compiled.expression import ONE, ZERO, Expression, ordered, symbol
from plant.compiled.functions import absolute, sign, sqrt, where
from plant.compiled.gather import gather_factors
from plant.compiled.simplify import fused, share_ratios, simplified
from tests.kernels import computed

X, Y, K, M = symbol("x"), symbol("y"), symbol("k"), symbol("m")
INPUTS = {"x": 0.7, "y": -1.3, "k": 2.9, "m": 0.0}


def count(outputs: Mapping[str, Expression], operation: str) -> int:
    return sum(item.operation == operation for item in ordered(outputs.values()))


SHARED = K * X / 3.0
OUTPUTS = {
    "sum": 2.0 * X + 0.5 * (K * Y) - (0.0 - X) + 4.0,
    "product": (0.1 * X) * (K * (Y / 7.0)) * 3.0,
    "choice": where(X > Y, 0.2 * X, ZERO) * where(Y > X, ZERO, 5.0 * Y),
    "shared": SHARED * SHARED + sqrt(absolute(-2.0 * SHARED)) * sign(-3.0 * Y),
    "twins": X * Y - Y * X + (X + Y) * (Y + X),
    "fixed": K + 2.0 * K,
    "nothing": 0.0 * X + (X - X),
}


def test_every_rewriting_keeps_the_computed_values() -> None:
    wanted = pytest.approx(computed(OUTPUTS, **INPUTS), rel=1e-14)
    assert computed(gather_factors(OUTPUTS, {"k", "m"}), **INPUTS) == wanted
    assert computed(simplified(OUTPUTS, {"k", "m"}), **INPUTS) == wanted
    assert computed(fused(simplified(OUTPUTS, {"k", "m"})), **INPUTS) == wanted


def test_a_scale_and_its_inverse_cancel() -> None:
    for scale in (0.001, 0.1, 3.0, 1e8):
        assert gather_factors({"a": scale * X / scale, "b": (X / scale) * Y * scale}, ()) == {"a": X, "b": X * Y}


def test_numbers_and_fixed_factors_are_multiplied_once() -> None:
    (found,) = gather_factors({"a": (0.01 * X) * (K * M) / 0.001}, {"k", "m"}).values()
    assert found.arguments[1] is X


def test_products_in_either_order_are_one_node() -> None:
    found = gather_factors({"a": X * Y + 1.0, "b": Y * X + 2.0}, ())
    assert count(found, "*") == 1


def test_a_factor_that_may_be_infinite_stays_within_its_choice() -> None:
    found = simplified({"a": where(M > 0.0, X / M, 0.0) * Y}, {"m"})
    with np.errstate(divide="ignore"):
        assert computed(found, x=0.7, y=-1.3, m=np.float64(0.0)) == {"a": 0.0}


def test_a_product_with_two_uses_is_not_fused() -> None:
    product = X * Y
    assert count(fused({"a": product + 1.0, "b": product + K}), "fma") == 0
    assert count(fused({"a": product + 1.0, "b": K}), "*") == 0


def test_a_fused_sum_is_rounded_once() -> None:
    e = 2.0**-30
    found = computed(fused({"a": X * Y - ONE}), x=1.0 + e, y=1.0 - e)
    assert found == {"a": -(e * e)}
    assert computed({"a": X * Y - ONE}, x=1.0 + e, y=1.0 - e) == {"a": 0.0}


def test_a_ratio_and_its_reverse_take_one_division() -> None:
    outputs = {"ratio": X / (K + Y), "reverse": (K + Y) / X, "other": K / X}
    shared = share_ratios(outputs)
    assert count(shared, "/") == 1
    assert computed(shared, **INPUTS) == pytest.approx(computed(outputs, **INPUTS), rel=1e-14)
