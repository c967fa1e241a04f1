"""The pump's loss never reverses its flow, and a relief valve flows only above its setting."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from plant.components.valves import pumped_flow, relief_flow

DISPLACEMENT, BIAS = 5.57e-7, 1.382e-5
SPEEDS = st.floats(-300.0, 300.0)
PRESSURES = st.floats(-1e7, 1e7)
SETTING, CONDUCTANCE = 500.0 * 6894.757293168361, 1e-8


@given(SPEEDS)
def test_pumped_flow_never_runs_against_the_speed(speed: float) -> None:
    assert float(pumped_flow(speed, DISPLACEMENT, BIAS)) * speed >= 0.0  # errata E8


@given(SPEEDS)
def test_the_pump_loses_its_flow_bias_but_at_most_its_ideal_flow(speed: float) -> None:
    ideal = abs(DISPLACEMENT * speed)
    assert abs(float(pumped_flow(speed, DISPLACEMENT, BIAS))) == pytest.approx(max(ideal - BIAS, 0.0), abs=1e-20)


@given(SPEEDS)
def test_pumped_flow_is_odd_in_speed(speed: float) -> None:
    assert float(pumped_flow(-speed, DISPLACEMENT, BIAS)) == -float(pumped_flow(speed, DISPLACEMENT, BIAS))


def test_a_pump_without_loss_is_ideal() -> None:
    assert float(pumped_flow(125.66, DISPLACEMENT, 0.0)) == DISPLACEMENT * 125.66


@given(PRESSURES)
def test_relief_flow_is_shut_below_the_setting_and_linear_above(pressure: float) -> None:
    flow = float(relief_flow(pressure, SETTING, CONDUCTANCE))
    assert abs(flow) == pytest.approx(CONDUCTANCE * max(abs(pressure) - SETTING, 0.0), abs=0.0)
    assert flow * pressure >= 0.0


def test_the_relief_valve_passes_the_rated_flow_within_7_kilopascal_of_its_setting() -> None:
    rated = DISPLACEMENT * 125.66
    assert float(relief_flow(SETTING + rated / CONDUCTANCE, SETTING, CONDUCTANCE)) == pytest.approx(rated, rel=1e-6)
    assert rated / CONDUCTANCE == pytest.approx(7e3, rel=0.01)
