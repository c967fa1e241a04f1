"""NumPy functions on symbols become operations of the graph, and any other one is refused by name."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from plant.compiled.expression import Expression, symbol
from plant.compiled.numpy_calls import SUPPORTED
from plant.compiled.source import symbols_in
from tests.kernels import computed

X, Y = symbol("x"), symbol("y")
CALLS: dict[str, Callable[[Any, Any], Any]] = {
    "abs": lambda x, y: np.abs(x),  # noqa: ARG005 -- all take two
    "sign": lambda x, y: np.sign(y),  # noqa: ARG005
    "sqrt": lambda x, y: np.sqrt(x * x + 1.0) + y,
    "square": lambda x, y: np.square(x) - y,
    "exp": lambda x, y: np.exp(x * y),
    "log": lambda x, y: np.log(x * x + y * y),
    "sin": lambda x, y: np.sin(x) * y,
    "cos": lambda x, y: np.cos(x) / y,
    "tan": lambda x, y: np.tan(x) - y,
    "arctan": lambda x, y: np.arctan(x / y),
    "sinh": lambda x, y: np.sinh(x) + y,
    "cosh": lambda x, y: np.cosh(y) * x,
    "tanh": lambda x, y: np.tanh(x + y),
    "minimum": lambda x, y: np.minimum(x, y),
    "maximum": lambda x, y: np.maximum(x, 0.5) + y,
    "clip": lambda x, y: np.clip(x, -0.25, 0.25) + np.clip(y, None, 0.1),
    "where": lambda x, y: np.where(x > y, x, 2.0 * y),
}


@pytest.mark.parametrize("name", CALLS)
@pytest.mark.parametrize(("x", "y"), [(0.7, -1.2), (-0.3, 0.4), (2.0, 1.5)])
def test_a_numpy_call_on_symbols_computes_the_same_as_on_numbers(name: str, x: float, y: float) -> None:
    made = CALLS[name](X, Y)
    assert isinstance(made, Expression)
    needed = {one: value for one, value in (("x", x), ("y", y)) if one in symbols_in([made])}
    assert computed({"z": made}, **needed)["z"] == pytest.approx(float(CALLS[name](x, y)), rel=1e-14)


def test_every_supported_numpy_function_is_tested() -> None:
    assert set(CALLS) == set(SUPPORTED.split(", "))


@pytest.mark.parametrize("operation", [np.add, np.subtract, np.multiply, np.divide])
def test_a_numpy_number_may_be_the_left_operand(operation: Any) -> None:
    made = operation(np.float64(3.0), X)
    assert computed({"z": made}, x=2.0)["z"] == operation(3.0, 2.0)


def test_whole_powers_comparisons_and_unary_signs_are_traced() -> None:
    assert computed({"z": np.power(X, 3)}, x=2.0)["z"] == 8.0
    assert computed({"z": np.where(np.less_equal(X, 2.0), 1.0, -np.positive(X))}, x=2.0)["z"] == 1.0
    assert math.isclose(computed({"z": np.negative(X)}, x=2.0)["z"], -2.0)


@pytest.mark.parametrize("comparison", [np.less, np.less_equal, np.greater, np.greater_equal])
@pytest.mark.parametrize("value", [1.9, 2.0, 2.1])
def test_a_numpy_comparison_is_right_below_at_and_above_the_limit(comparison: Any, value: float) -> None:
    made = np.where(comparison(X, 2.0), 1.0, 0.0)
    assert computed({"z": made}, x=value)["z"] == float(comparison(value, 2.0))


@pytest.mark.parametrize(
    "call",
    [
        lambda: np.arcsin(X),
        lambda: np.interp(X, [0.0, 1.0], [0.0, 1.0]),
        lambda: np.add.reduce(X),
        lambda: np.add(X, X, out=np.zeros(1)),
        lambda: np.sum(X),
    ],
)
def test_an_unsupported_numpy_function_is_refused_by_name(call: Callable[[], object]) -> None:
    with pytest.raises(TypeError, match=r"np\.\w+ cannot be traced; a model may call abs, sign"):
        call()


def test_an_array_of_several_numbers_is_refused() -> None:
    with pytest.raises(TypeError, match=r"single numbers, got an array of shape \(2,\)"):
        np.add(np.zeros(2), X)
