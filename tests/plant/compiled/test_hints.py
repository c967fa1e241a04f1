"""Hints change no value: derivatives use what a model knows, and late inputs pass one product and one sum."""

from collections.abc import Callable

import pytest

from plant.compiled.elimination import eliminated_jacobian
from plant.compiled.expression import Expression, jacobian, ordered, symbol
from plant.compiled.functions import absolute, sqrt, where
from plant.compiled.hints import affine_form, frozen, is_waypoint, waypoint, with_derivatives
from tests.kernels import computed

X, A, B = symbol("x"), symbol("a"), symbol("b")
Differentiated = Callable[[list[Expression], list[Expression]], list[list[Expression]]]
BOTH_WAYS = pytest.mark.parametrize("differentiated", [jacobian, eliminated_jacobian])


@BOTH_WAYS
def test_a_frozen_value_is_unchanged_and_constant_in_derivatives(differentiated: Differentiated) -> None:
    y = X * frozen(X)
    [[slope]] = differentiated([y], [X])
    assert computed({"y": y, "slope": slope}, x=3.0) == {"y": 9.0, "slope": 3.0}


@BOTH_WAYS
def test_a_root_that_follows_its_balance_has_the_derivative_of_its_formula(differentiated: Differentiated) -> None:
    root = sqrt(A * A + B)
    known = with_derivatives(root, (A * A + B - frozen(root) * frozen(root), 0.5 / root))
    for output, told in ((root * A, known * A), (where(B > 0.0, root, A), where(B > 0.0, known, A))):
        wanted, found = ({f"j{i}": one for i, one in enumerate(differentiated([y], [A, B])[0])} for y in (output, told))
        assert computed(found, a=0.7, b=1.9) == pytest.approx(computed(wanted, a=0.7, b=1.9), rel=1e-14)


def test_a_choice_with_given_slopes_is_differentiated_by_those_slopes_only() -> None:
    [[slope]] = jacobian([with_derivatives(where(A > 0.0, X, B), (3.0 * X, 2.0))], [X])
    assert computed({"slope": slope}) == {"slope": 6.0}


def test_a_waypoint_is_recognised_and_keeps_its_value_and_derivative() -> None:
    point = waypoint(X * A)
    assert is_waypoint(point)
    assert not any(is_waypoint(one) for one in (X * A, frozen(X * A), with_derivatives(X * A, (X * B, 1.0)), X))
    assert computed({"y": point}, x=2.0, a=5.0) == {"y": 10.0}
    assert computed({"y": jacobian([point], [X])[0][0]}, x=2.0, a=5.0) == {"y": 5.0}


def test_hints_return_plain_numbers_unchanged() -> None:
    assert (frozen(2.0), with_derivatives(2.0, (1.0, 3.0)), waypoint(2.0), affine_form(2.0, 1.0)) == (2.0,) * 4
    assert affine_form(X, None) is X


@pytest.mark.parametrize("x", [-2.0, 0.5])
def test_an_affine_expression_uses_the_late_input_in_one_product_and_one_sum(x: float) -> None:
    y = where(absolute(X) > 1.0, (X - A) / B, A * (B - X * B)) + 3.0 * X
    collected = affine_form(y, X)
    assert computed({"y": collected}, x=x, a=0.3, b=0.7) == pytest.approx(computed({"y": y}, x=x, a=0.3, b=0.7))
    waiting = {id(X)}
    for item in ordered([collected]):
        operands = item.arguments[1:] if item.operation == "where" else item.arguments
        if item.operation not in ("abs", ">") and any(id(one) in waiting for one in operands):
            waiting.add(id(item))
    assert len(waiting) == 3


@pytest.mark.parametrize("y", [X * X, A / X, sqrt(X)], ids=["square", "reciprocal", "root"])
def test_an_expression_that_is_not_affine_in_the_late_input_is_refused(y: Expression) -> None:
    with pytest.raises(ValueError, match="is not affine in what comes late"):
        affine_form(y, X)
