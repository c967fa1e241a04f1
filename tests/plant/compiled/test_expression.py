"""Derivatives of a graph agree with calculus, with signs and choices held constant."""

import math
from collections.abc import Callable, Mapping

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from plant.compiled.expression import (
    ONE,
    ZERO,
    Expression,
    constant,
    jacobian,
    node,
    ordered,
    symbol,
)
from plant.compiled.functions import absolute, arctan, cos, exp, log, maximum, minimum, sign, sin, sqrt, tanh, where

X, Y = symbol("x"), symbol("y")

ARITHMETIC: Mapping[str, Callable[..., float]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b,
    "<": lambda a, b: a < b,
    "<=": lambda a, b: a <= b,
    ">": lambda a, b: a > b,
    ">=": lambda a, b: a >= b,
    "abs": abs,
    "sign": lambda a: float((a > 0.0) - (a < 0.0)),
    "sqrt": math.sqrt,
    "exp": math.exp,
    "tanh": math.tanh,
    "sin": math.sin,
    "cos": math.cos,
    "atan": math.atan,
    "where": lambda condition, a, b: a if condition else b,
}


def evaluate(output: Expression, x: float, y: float) -> tuple[float, tuple[float, ...]]:
    """Return the value of a graph, and every decision (comparison, sign) made on the way."""
    values: dict[int, float] = {}
    decisions: list[float] = []
    for item in ordered([output]):
        if item.operation == "symbol":
            values[id(item)] = {"x": x, "y": y}[str(item.value)]
        elif item.operation == "constant":
            values[id(item)] = float(item.value)
        else:
            arguments = [values[id(argument)] for argument in item.arguments]
            values[id(item)] = ARITHMETIC[item.operation](*arguments)
            if item.operation in {"<", "<=", ">", ">="}:
                decisions.append(values[id(item)])
            elif item.operation in {"abs", "sign"}:
                decisions.append(ARITHMETIC["sign"](arguments[0]))
    return values[id(output)], tuple(decisions)


def grow(inner: st.SearchStrategy[Expression]) -> st.SearchStrategy[Expression]:
    pairs = st.tuples(inner, inner)
    return st.one_of(
        pairs.map(lambda p: p[0] + p[1]),
        pairs.map(lambda p: p[0] - p[1]),
        pairs.map(lambda p: p[0] * p[1]),
        pairs.map(lambda p: p[0] / (p[1] * p[1] + 1.0)),
        pairs.map(lambda p: maximum(*p)),
        pairs.map(lambda p: minimum(*p)),
        pairs.map(lambda p: where(p[0] > p[1], p[0] * p[1], p[1] - 2.0)),
        inner.map(lambda a: a**2),
        inner.map(lambda a: -a),
        inner.map(absolute),
        inner.map(lambda a: sign(a) * a),
        inner.map(tanh),
        inner.map(lambda a: sin(a) - cos(2.0 * a)),
        inner.map(arctan),
        inner.map(lambda a: exp(tanh(a))),
        inner.map(lambda a: sqrt(a * a + 1.0)),
    )


LEAVES = st.one_of(st.sampled_from([X, Y]), st.sampled_from([-1.5, 0.5, 2.0]).map(constant))
EXPRESSIONS = st.recursive(LEAVES, grow, max_leaves=6)
POINTS = st.floats(-2.0, 2.0)


@given(EXPRESSIONS, POINTS, POINTS)
def test_a_jacobian_equals_the_numerical_derivative(output: Expression, x: float, y: float) -> None:
    h = 1e-5
    ((by_x, by_y),) = jacobian([output], [X, Y])
    here, decisions = evaluate(output, x, y)
    for slope, (dx, dy) in ((by_x, (h, 0.0)), (by_y, (0.0, h))):
        above, decided_above = evaluate(output, x + dx, y + dy)
        below, decided_below = evaluate(output, x - dx, y - dy)
        assume(decided_above == decisions == decided_below)
        value, _ = evaluate(slope, x, y)
        assert abs(value - (above - below) / (2.0 * h)) <= 1e-5 * (1.0 + abs(value) + abs(here))


def test_a_sign_is_constant_in_derivatives() -> None:
    ((flat,), (slope,)) = jacobian([sign(X), sign(X) * X], [X])
    assert flat is ZERO
    assert slope is sign(X)


def test_the_slope_of_a_choice_is_that_of_the_chosen_side() -> None:
    ((slope,),) = jacobian([where(X > 0.0, X * X, -3.0 * X)], [X])
    assert evaluate(slope, 2.0, 0.0)[0] == 4.0
    assert evaluate(slope, -2.0, 0.0)[0] == -3.0


def test_a_choice_selects_a_slope_and_never_multiplies_the_other_by_zero() -> None:
    ((slope,),) = jacobian([where(X > 1.0, sqrt(X), 5.0 * X)], [X])
    assert all(item.operation != "*" for item in ordered([slope]))
    assert evaluate(slope, 0.25, 0.0)[0] == 5.0


def test_equal_sub_expressions_are_one_node() -> None:
    assert (X + Y) * (X - 2.0) is (X + Y) * (X - 2.0)
    assert symbol("x") is X
    assert X + Y is not Y + X
    squared = (X + Y) * (X + Y)
    assert sum(item.operation == "+" for item in ordered([squared])) == 1


def test_structural_zeros_and_ones_vanish() -> None:
    assert X + 0.0 is X
    assert X * 1.0 is X
    assert X / 1.0 is X
    assert X - X is ZERO
    assert X * 0.0 is ZERO
    assert X**0 is ONE
    ((by_x, by_y),) = jacobian([3.0 * X + 1.0], [X, Y])
    assert by_x is constant(3.0)
    assert by_y is ZERO


def test_ordered_lists_each_node_once_after_its_operands() -> None:
    items = ordered([tanh(X * Y) + X * Y, X])
    seen: set[int] = set()
    for item in items:
        assert all(id(argument) in seen for argument in item.arguments)
        assert id(item) not in seen
        seen.add(id(item))


def test_an_if_on_an_expression_is_refused_with_the_advice_to_use_where() -> None:
    def model(x: Expression) -> Expression:
        return x if x > 0.0 else -x

    with pytest.raises(TypeError, match=r"must choose with where\(condition, a, b\), not with if"):
        model(X)


@pytest.mark.parametrize("compare", [lambda x: x == 0.0, lambda x: x != 0.0], ids=["==", "!="])
def test_an_equality_test_on_an_expression_is_refused(compare: Callable[[Expression], bool]) -> None:
    with pytest.raises(TypeError, match="must compare with <, <=, > or >="):
        compare(X)


def test_powers_are_products() -> None:
    assert X**3 is X * X * X
    assert X**2.0 is X * X
    assert X**-1 is 1.0 / X
    with pytest.raises(TypeError, match=r"whole powers only, beside sqrt and exp, got 0\.5"):
        X**0.5


def test_an_operation_without_a_derivative_is_refused_rather_than_taken_for_constant() -> None:
    with pytest.raises(NotImplementedError, match="'erf' has no derivative"):
        jacobian([node("erf", X)], [X])


def test_a_logarithm_has_the_slope_of_one_over_its_argument() -> None:
    ((slope,),) = jacobian([log(X)], [X])
    assert slope is ONE / X
