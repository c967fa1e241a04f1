from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from estimation.models.completed_flow import balances_mass, completed_flow_form
from estimation.models.flow import (
    FLOW_FORM,
    HELD_FLOW_FORM,
    MASS_FLOW_FORM,
    Delivery,
    chamber_rates,
    delivered_flow,
    flow_rates,
    form_with_relief,
)
from estimation.models.greybox import GreyBoxModel
from plant.components.oil import ATMOSPHERE
from plant.eha.model import PARAMETER_NAMES, EhaParameters

P = EhaParameters()


def values(**changes: float) -> SimpleNamespace:
    beside = {"speed_lead": 0.0, "case_leakage": 0.0, "makeup_opening": 1.0, "crack_a": 0.0, "crack_b": 0.0}
    return SimpleNamespace(**{name: getattr(P, name) for name in PARAMETER_NAMES} | beside | changes)


def settle(p: SimpleNamespace, speed: float, seconds: float, step: float = 1e-3) -> tuple[float, float]:
    """Return chamber pressures of a blocked piston by explicit Euler steps, fine enough for the steady state."""
    p1, p2 = P.accumulator_pressure, P.accumulator_pressure
    for _ in range(round(seconds / step)):
        rates = flow_rates((p1, p2), ((speed, speed), (0.0, 0.0), step), p, 0.0)
        p1, p2 = p1 + step * float(rates[0]), p2 + step * float(rates[1])
    return p1, p2


def test_a_blocked_piston_settles_at_the_pressure_at_which_leakage_equals_the_pumped_flow() -> None:
    p = values(relief_pressure=1e9, leakage_coefficient=2.523e-11, flow_bias=1.382e-5)
    p1, p2 = settle(p, 60.0, 6.0)
    assert p1 - p2 == pytest.approx((60.0 * P.pump_displacement - 1.382e-5) / 2.523e-11, rel=1e-6)


def test_chamber_pressures_stay_constant_inside_the_dead_zone_of_the_pump() -> None:
    assert settle(values(flow_bias=1e-5), 10.0, 0.1) == (P.accumulator_pressure, P.accumulator_pressure)


def test_the_relief_valve_limits_the_pressure_either_way() -> None:
    for speed in (200.0, -200.0):
        p1, p2 = settle(values(), speed, 1.0, 1e-4)
        assert P.relief_pressure < abs(p1 - p2) < 1.01 * P.relief_pressure


def test_make_up_holds_the_low_chamber_near_the_inner_circuit() -> None:
    _, with_makeup = settle(values(makeup_conductance=1e-8, leakage_coefficient=2.5e-11), 60.0, 2.0)
    _, without = settle(values(makeup_conductance=0.0, leakage_coefficient=2.5e-11), 60.0, 2.0)
    assert with_makeup > 0.9 * P.accumulator_pressure
    assert without < 0.0


def test_a_make_up_valve_lowers_its_chamber_by_its_cracking_pressure() -> None:
    leaking = {"makeup_conductance": 1e-8, "leakage_coefficient": 2.5e-11}
    _, seated = settle(values(**leaking), 60.0, 2.0)
    _, cracking = settle(values(**leaking, crack_b=2e3), 60.0, 2.0)
    _, other = settle(values(**leaking, crack_a=2e3), 60.0, 2.0)
    assert seated - cracking == pytest.approx(2e3, rel=0.01)
    assert other == pytest.approx(seated, abs=1.0)


def test_the_accumulator_has_the_same_rate_balanced_by_volume_and_by_mass() -> None:
    state, drives = (3e5, 2e5, 2.6e5), ((60.0, 60.0), (0.0, 1e-4), 1e-3)
    p = values(accumulator_stiffness=1e8, case_leakage=1e-13)
    by_volume = completed_flow_form(FLOW_FORM).rates(state, drives, p, 0.0)
    by_mass = MASS_FLOW_FORM.rates(state, drives, p, 0.0)
    assert by_volume[2] == by_mass[2] != 0.0
    fed = values(accumulator_pressure=2.6e5, case_leakage=1e-13)
    assert by_volume[:2] == FLOW_FORM.rates(state[:2], drives, fed, 0.0)


@pytest.mark.parametrize("form", [FLOW_FORM, MASS_FLOW_FORM])
def test_a_make_up_valve_like_an_orifice_feeds_half_the_linear_flow_beyond_its_bend(
    form: GreyBoxModel,
) -> None:
    state, drives = (2e5, 1.2e6, 2.6e5), ((60.0, 60.0), (0.0, 1e-4), 1e-3)
    flat, bent = (
        completed_flow_form(form, bent=True).rates(
            state, drives, values(accumulator_stiffness=1e8, makeup_bend=bend), 0.0
        )
        for bend in (0.0, 3.0 / 6e4)
    )
    assert flat == completed_flow_form(form).rates(state, drives, values(accumulator_stiffness=1e8), 0.0)
    assert bent[2] == pytest.approx(0.5 * flat[2], rel=1e-12)  # the inner circuit loses only what the valves feed
    assert bent[1] == flat[1]
    assert completed_flow_form(form, bent=True).unknowns.count("makeup_bend") == 1
    assert balances_mass(completed_flow_form(form, bent=True)) == balances_mass(form) == (form is MASS_FLOW_FORM)


def test_two_chambers_without_make_up_have_the_lumped_capacitance() -> None:
    p = values(makeup_conductance=0.0, leakage_coefficient=0.0, flow_bias=0.0)
    p1, p2 = settle(p, 50.0, 0.01)
    pumped = 50.0 * P.pump_displacement * 0.01
    assert p1 - p2 == pytest.approx(P.bulk_modulus / P.chamber_volume * pumped, rel=1e-9)


@given(pumped=st.floats(-1e-4, 1e-4), velocity=st.floats(-0.1, 0.1), p1=st.floats(3e5, 4e6), p2=st.floats(3e5, 4e6))
def test_without_make_up_one_chamber_gains_the_volume_that_the_other_loses(
    pumped: float, velocity: float, p1: float, p2: float
) -> None:
    a, b = chamber_rates((p1, p2), Delivery(pumped, velocity, 0.01), values(), by_mass=False)
    stored = (2.0 * P.chamber_volume + 0.01 * P.piston_area) * float(a)
    drawn = (2.0 * P.chamber_volume - 0.01 * P.piston_area) * float(b)
    assert abs(stored + drawn) <= 1e-9 * (abs(stored) + abs(drawn))


@given(pumped=st.floats(-1e-4, 1e-4), p1=st.floats(3e5, 2.5e7), p2=st.floats(3e5, 2.5e7))
def test_a_balance_by_mass_conserves_the_oil(pumped: float, p1: float, p2: float) -> None:
    """With plain make-up checks, a single rod pumps both sides up to 250 bar: a tenth of bulk modulus."""
    p = values(relief_conductance=0.0)
    a, b = chamber_rates((p1, p2), Delivery(pumped, 0.0, 0.0), p, by_mass=True)
    densities = [1.0 / (1.0 - (chamber - ATMOSPHERE) / P.bulk_modulus) for chamber in (p1, p2)]
    gained, lost = (float(rate) * density**2 for rate, density in zip((a, b), densities, strict=True))
    flow = pumped - p.leakage_coefficient * (p1 - p2)
    assert abs(gained + lost) <= 1e-9 * (abs(gained) + abs(lost)) + 1e-9 * abs(flow)


def test_a_case_drain_takes_oil_from_both_chambers() -> None:
    p = values(case_leakage=1e-11, leakage_coefficient=0.0)
    a, b = chamber_rates((1e6, 1e6), Delivery(0.0, 0.0, 0.0), p, by_mass=False)
    expected = P.bulk_modulus / (2.0 * P.chamber_volume) * 1e-11 * (1e6 - P.accumulator_pressure)
    assert float(a) == float(b) == pytest.approx(-expected, rel=1e-12)


def test_a_lead_shifts_the_delivered_flow_in_time() -> None:
    ahead = delivered_flow((50.0, 60.0), values(speed_lead=2e-5), 1e-4, 0.5)
    assert float(ahead) == pytest.approx(float(delivered_flow((52.0, 62.0), values(), 1e-4, 0.5)), rel=1e-12)


def test_the_form_for_a_relieving_log_has_the_valve_among_its_unknowns() -> None:
    assert set(form_with_relief(FLOW_FORM).unknowns) - set(FLOW_FORM.unknowns) == {
        "relief_pressure",
        "relief_conductance",
    }


def test_the_form_of_held_volumes_depends_on_the_pistons_motion_and_not_its_position() -> None:
    state, p, step = (1e6, 9e5), values(), 1e-4

    def rates(begin: float, moved: float) -> tuple[float, ...]:
        return tuple(
            float(one) for one in HELD_FLOW_FORM.rates(state, ((50.0, 50.0), (begin, begin + moved), step), p, 0)
        )

    assert rates(0.03, 2e-6) == pytest.approx(rates(-0.01, 2e-6))
    first, second = (moving - still for moving, still in zip(rates(0.0, 2e-6), rates(0.0, 0.0), strict=True))
    displaced = P.piston_area * 2e-6 / step * P.bulk_modulus / P.chamber_volume
    assert first == pytest.approx(-second)
    assert abs(first - second) == pytest.approx(displaced, rel=1e-6)
