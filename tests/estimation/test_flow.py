from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from estimation.flow import FLOW_FORM, RELIEVING_FLOW_FORM, flow_step
from plant.eha import EhaParameters
from plant.integrate import PARAMETER_NAMES

P = EhaParameters()


def values(**changes: float) -> SimpleNamespace:
    return SimpleNamespace(**{name: getattr(P, name) for name in PARAMETER_NAMES} | {"speed_lead": 0.0} | changes)


def settle(p: SimpleNamespace, speed: float, seconds: float) -> tuple[float, float]:
    state = (P.accumulator_pressure, P.accumulator_pressure)
    for _ in range(round(seconds / 1e-4)):
        state = flow_step(state, ((speed, speed), (0.0, 0.0)), p, 1e-4)
    return float(state[0]), float(state[1])


def test_a_blocked_piston_settles_where_leakage_takes_the_pumped_flow() -> None:
    p = values(relief_pressure=1e9, leakage_coefficient=2.523e-11, flow_bias=1.382e-5)
    p1, p2 = settle(p, 60.0, 6.0)
    assert p1 - p2 == pytest.approx((60.0 * P.pump_displacement - 1.382e-5) / 2.523e-11, rel=1e-6)


def test_nothing_moves_inside_the_dead_zone() -> None:
    assert settle(values(flow_bias=1e-5), 10.0, 0.1) == (P.accumulator_pressure, P.accumulator_pressure)


def test_the_relief_valve_limits_the_pressure_either_way() -> None:
    for speed in (200.0, -200.0):
        p1, p2 = settle(values(), speed, 1.0)
        assert P.relief_pressure < abs(p1 - p2) < 1.01 * P.relief_pressure


def test_make_up_holds_the_low_chamber_near_the_inner_circuit() -> None:
    _, with_makeup = settle(values(makeup_conductance=1e-8, leakage_coefficient=2.5e-11), 60.0, 2.0)
    _, without = settle(values(makeup_conductance=0.0, leakage_coefficient=2.5e-11), 60.0, 2.0)
    assert with_makeup > 0.9 * P.accumulator_pressure
    assert without < 0.0


def test_two_chambers_without_make_up_are_the_lumped_capacitance() -> None:
    p = values(makeup_conductance=0.0, leakage_coefficient=0.0, flow_bias=0.0)
    p1, p2 = settle(p, 50.0, 0.01)
    pumped = 50.0 * P.pump_displacement * 0.01
    assert p1 - p2 == pytest.approx(P.bulk_modulus / P.chamber_volume * pumped, rel=1e-9)


@given(speed=st.floats(-250.0, 250.0), moved=st.floats(-1e-4, 1e-4), p1=st.floats(0.0, 4e6), p2=st.floats(0.0, 4e6))
def test_without_make_up_one_chamber_gains_what_the_other_loses(
    speed: float, moved: float, p1: float, p2: float
) -> None:
    p = values(makeup_conductance=0.0)
    new = flow_step((p1, p2), ((speed, speed), (0.0, moved)), p, 1e-4)
    volumes = 2.0 * P.chamber_volume + 0.5 * P.piston_area * moved, 2.0 * P.chamber_volume - 0.5 * P.piston_area * moved
    stored = volumes[0] * (float(new[0]) - p1) + volumes[1] * (float(new[1]) - p2)
    assert abs(stored) < 1e-9 * P.chamber_volume * 4e6


def test_a_lead_shifts_the_delivered_flow_in_time() -> None:
    lead = 2e-5
    ahead = flow_step((0.0, 0.0), ((50.0, 60.0), (0.0, 0.0)), values(speed_lead=lead), 1e-4)
    shifted = flow_step((0.0, 0.0), ((52.0, 62.0), (0.0, 0.0)), values(), 1e-4)
    np.testing.assert_allclose(ahead, shifted, rtol=1e-12)


def test_the_form_for_a_relieving_log_has_the_valve_among_its_unknowns() -> None:
    assert set(RELIEVING_FLOW_FORM.unknowns) - set(FLOW_FORM.unknowns) == {"relief_pressure", "relief_conductance"}
    assert replace(RELIEVING_FLOW_FORM, name="flow", unknowns=FLOW_FORM.unknowns) == FLOW_FORM
