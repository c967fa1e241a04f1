"""Friction opposes motion, and the implicit step solves the force balance with it exactly."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from faults.conditions import FRICTION_TABLE, FrictionLevel
from plant.components.friction import quadratic_friction, sliding, velocity_under_friction

PUSHES = st.floats(-2e4, 2e4)
RESISTANCES = st.floats(1e3, 1e7)
QUADRATICS = st.floats(0.0, 5e6)
COULOMBS = st.floats(0.0, 1e3)


def residual(v: float, push: float, resistance: float, quadratic: float, coulomb: float) -> float:
    """Return the remaining force, relative to the largest force in the balance."""
    direction = np.sign(v)
    left = resistance * v + quadratic_friction(v, direction, quadratic, 0.0, coulomb) - push
    return left / max(abs(push), coulomb)


@given(PUSHES.filter(lambda push: push != 0.0), RESISTANCES, QUADRATICS, COULOMBS)
@example(437.0, 1e3, 4.462e6, 436.0)
@example(2e4, 1e3, 5e6, 0.0)
def test_the_velocity_balances_the_forces_to_rounding_or_is_zero_below_the_coulomb_force(
    push: float, resistance: float, quadratic: float, coulomb: float
) -> None:
    v = float(velocity_under_friction(push, resistance, quadratic, coulomb))
    if abs(push) <= coulomb:
        assert v == 0.0
    else:
        assert v * push >= 0.0
        assert abs(residual(v, push, resistance, quadratic, coulomb)) <= 4.0 * np.finfo(float).eps


@given(PUSHES, RESISTANCES, QUADRATICS, COULOMBS)
def test_the_velocity_is_odd_in_the_driving_force(
    push: float, resistance: float, quadratic: float, coulomb: float
) -> None:
    forth, back = (float(velocity_under_friction(p, resistance, quadratic, coulomb)) for p in (push, -push))
    assert forth == -back


@given(PUSHES, PUSHES, RESISTANCES, QUADRATICS, COULOMBS)
def test_a_larger_push_never_gives_a_smaller_velocity(
    a: float, b: float, resistance: float, quadratic: float, coulomb: float
) -> None:
    low, high = (float(velocity_under_friction(p, resistance, quadratic, coulomb)) for p in sorted((a, b)))
    assert low <= high + np.finfo(float).eps * max(abs(low), abs(high))


def test_the_velocity_is_accurate_at_a_force_barely_above_the_coulomb_force() -> None:
    excess = 1e-9
    v = float(velocity_under_friction(436.0 + excess, 1e6, 6.589e4, 436.0))
    assert v == pytest.approx(((436.0 + excess) - 436.0) / 1e6, rel=1e-12, abs=0.0)


def test_arrays_are_solved_element_by_element() -> None:
    pushes = np.array([-900.0, -100.0, 0.0, 400.0, 900.0])
    many = velocity_under_friction(pushes, 1e4, 6.589e4, 436.0)
    assert many.tolist() == [float(velocity_under_friction(push, 1e4, 6.589e4, 436.0)) for push in pushes]


@pytest.mark.parametrize("level", FRICTION_TABLE.values(), ids=FRICTION_TABLE)
def test_table_4_friction_opposes_motion_at_every_speed(level: FrictionLevel) -> None:
    v = np.linspace(0.0, 0.1, 10_001)
    a1, a2, a3 = level.friction_quadratic, level.friction_linear, level.friction_coulomb
    force = quadratic_friction(v, 1.0, a1, a2, a3)
    assert np.min(force) >= 436.0
    np.testing.assert_array_equal(quadratic_friction(-v, -1.0, a1, a2, a3), -force)


def test_minor_friction_dips_to_488_newton_at_3_millimetres_a_second() -> None:
    level = FRICTION_TABLE["minor"]
    v = np.linspace(0.0, 0.02, 20_001)
    force = quadratic_friction(v, 1.0, level.friction_quadratic, level.friction_linear, level.friction_coulomb)
    assert np.min(force) == pytest.approx(488.1, abs=0.05)  # errata E12
    assert v[np.argmin(force)] == pytest.approx(3.2e-3, abs=5e-5)


@given(PUSHES, RESISTANCES, QUADRATICS, COULOMBS)
def test_sliding_returns_half_the_derivative_of_the_force_by_the_velocity(
    push: float, resistance: float, quadratic: float, coulomb: float
) -> None:
    v, half = (float(one) for one in sliding(push, resistance, quadratic, coulomb))
    if v:
        assert 2.0 * half == pytest.approx(resistance + 2.0 * quadratic * abs(v), rel=1e-12)
