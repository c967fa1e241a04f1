"""Elimination gives the same Jacobian as forward differentiation, with fewer operations."""

import numpy as np
import pytest

from plant.compiled.elimination import eliminated_jacobian
from plant.compiled.expression import ZERO, Expression, jacobian, ordered, symbol
from plant.compiled.functions import absolute, maximum, sqrt, where
from plant.compiled.simplify import share_reciprocals
from plant.eha.circuit import circuit_derivative
from plant.eha.circuit_parameters import CircuitParameters
from plant.eha.model import EhaParameters, reduced_derivative
from plant.solvers.steps import parameter_symbols
from tests.kernels import computed

X, Y, U = symbol("x"), symbol("y"), symbol("u")


def both(outputs: list[Expression], inputs: list[Expression]) -> tuple[dict[str, Expression], dict[str, Expression]]:
    one, other = (
        {f"j{i}_{j}": slope for i, row in enumerate(rows) for j, slope in enumerate(row)}
        for rows in (eliminated_jacobian(outputs, inputs), jacobian(outputs, inputs))
    )
    return one, other


@pytest.mark.parametrize(("x", "y"), [(0.7, -1.2), (-0.3, 0.4), (2.0, 3.0)])
def test_elimination_gives_the_jacobian_of_forward_differentiation(x: float, y: float) -> None:
    shared = maximum(X * Y, -0.5) / (1.0 + absolute(X))
    outputs = [shared * shared - Y, where(X > Y, sqrt(1.0 + shared * shared), -shared), X, X * 0.0 + 1.0]
    found, wanted = both([o + ZERO for o in outputs], [X, Y, U])
    assert computed(found, x=x, y=y) == pytest.approx(computed(wanted, x=x, y=y), rel=1e-13)


def test_the_slope_of_an_output_that_does_not_depend_on_an_input_is_the_zero_node() -> None:
    rows = eliminated_jacobian([X * X, 2.0 * Y], [X, Y, U])
    assert [[slope is ZERO for slope in row] for row in rows] == [[False, True, True], [True, False, True]]


def test_elimination_selects_the_slope_of_a_choice_instead_of_multiplying_by_zero() -> None:
    ((slope,),) = eliminated_jacobian([where(X > 1.0, 1.0 / X, 0.0) * Y], [X])
    assert slope.operation == "where"
    assert slope.arguments[2] is ZERO
    assert computed({"s": slope}, x=2.0, y=3.0)["s"] == -0.75


def test_elimination_needs_fewer_products_than_forward_differentiation_on_the_circuit() -> None:
    state = x0, x1, x2, x3, x4, x5, x6 = [symbol(f"x{i}") for i in range(7)]
    rates = list(circuit_derivative((x0, x1, x2, x3, x4, x5, x6), U, parameter_symbols(CircuitParameters)))
    counts = [sum(item.operation == "*" for item in ordered(one.values())) for one in both(rates, [*state, U])]
    assert counts[0] < 0.7 * counts[1]


def test_elimination_gives_the_jacobian_of_the_reduced_plant() -> None:
    state = x, v, a = [symbol(f"x{i}") for i in range(3)]
    p = parameter_symbols(EhaParameters)
    found, wanted = both(list(reduced_derivative((x, v, a), U, p)), [*state, U])
    rng = np.random.default_rng(1)
    inputs = {
        name: float(value)
        for name, value in zip([*vars(p), "x0", "x1", "x2", "u"], rng.uniform(0.5, 2.0, 60), strict=False)
    }
    assert computed(found, **inputs) == pytest.approx(computed(wanted, **inputs), rel=1e-12)


def test_shared_reciprocals_change_the_last_digits_only() -> None:
    outputs = {"a": X / Y, "b": (X + 1.0) / Y, "c": X / (Y * Y), "d": Y / 3.0}
    found = computed(share_reciprocals(outputs, ()), x=0.7, y=1.3)
    assert found == pytest.approx(computed(outputs, x=0.7, y=1.3), rel=1e-15)
    counts = [
        sum(item.operation == "/" for item in ordered(one.values()))
        for one in (share_reciprocals(outputs, ()), outputs)
    ]
    assert counts == [3, 4]
