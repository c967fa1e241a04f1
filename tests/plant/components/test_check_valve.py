"""A check valve passes no backward flow, and opens without a step in its flow or slope."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from plant.components.check_valve import check_valve_flow, make_up_flow

OPENING = 7e3


@given(st.floats(-1e7, 0.0))
def test_a_check_valve_passes_no_backward_flow(drop: float) -> None:
    assert float(check_valve_flow(drop, 1e-9, OPENING)) == 0.0


@given(st.floats(0.0, 1e7), st.floats(1.0, 1e6))
def test_flow_rises_with_the_drop_and_stays_below_the_open_valve(drop: float, more: float) -> None:
    low, high = (float(check_valve_flow(d, 1e-9, OPENING)) for d in (drop, drop + more))
    assert low <= high <= 1e-9 * (drop + more)


def test_a_check_valve_is_wide_open_at_a_large_drop() -> None:
    assert float(check_valve_flow(1e3 * OPENING, 1e-9, OPENING)) == pytest.approx(1e-9 * 1e3 * OPENING, rel=2e-3)


def test_the_slope_at_the_seat_is_zero() -> None:
    assert float(check_valve_flow(1e-3 * OPENING, 1e-9, OPENING)) < 2e-3 * 1e-9 * 1e-3 * OPENING


def test_a_piloted_valve_lets_oil_back_only_while_the_other_side_is_higher() -> None:
    assert make_up_flow(5e5, 9e5, 3e5, 1e-9, OPENING, 1.0) == pytest.approx(-2e5 * 1e-9)
    assert make_up_flow(5e5, 4e5, 3e5, 1e-9, OPENING, 1.0) == 0.0
    assert make_up_flow(5e5, 9e5, 3e5, 1e-9, OPENING, 0.0) == 0.0
