from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from faults.conditions import (
    CONDITIONS,
    FRICTION_TABLE,
    HIGHEST_SEVERITY,
    LEAKAGE_TABLE,
    LEVELS,
    Condition,
    find_condition,
    parameters_for,
    severity,
)
from plant.eha.model import EhaParameters
from plant.eha.steady_state import steady_state
from plant.errors import HydrostateError

PUBLISHED = Path(__file__).parents[2] / "experiments" / "published"
RIG = EhaParameters()
SEVERITIES = st.floats(0.0, HIGHEST_SEVERITY)
SHARES = st.floats(0.02, 2.0)
OTHER_RIG = EhaParameters(
    piston_area=3.04e-3,
    pump_displacement=1.4e-6,
    motor_speed_per_volt=25.0,
    leakage_coefficient=9e-12,
    flow_bias=5e-6,
    friction_coulomb=700.0,
)


def test_the_nine_conditions_cannot_be_changed() -> None:
    with pytest.raises(TypeError):
        CONDITIONS["normal"] = CONDITIONS["major_leakage"]  # pyright: ignore[reportIndexIssue] - read-only is the claim


def rated_flow(p: EhaParameters) -> float:
    return p.pump_displacement * p.rated_speed


def ideal_velocity(p: EhaParameters) -> float:
    return rated_flow(p) / p.piston_area


def friction_force(p: EhaParameters, velocity: float) -> float:
    return p.friction_quadratic * velocity**2 + p.friction_linear * velocity + p.friction_coulomb


def steady_velocity(p: EhaParameters) -> float:
    """Return the positive root of the flow balance 5.8 with the force balance 5.11, at rated speed."""
    A, L = p.piston_area, p.leakage_coefficient
    quadratic = L * p.friction_quadratic / A
    linear = A + L * p.friction_linear / A
    constant = L * p.friction_coulomb / A - (rated_flow(p) - p.flow_bias)
    return (-linear + np.sqrt(linear**2 - 4.0 * quadratic * constant)) / (2.0 * quadratic)


def steady_pressure(p: EhaParameters) -> float:
    return friction_force(p, steady_velocity(p)) / p.piston_area


def test_the_nine_conditions_are_table_1_by_name_level_and_order() -> None:
    table = pd.read_csv(PUBLISHED / "eha_table1_conditions.csv", keep_default_na=False)
    found = [(c.name, c.leakage, c.friction) for c in CONDITIONS.values()]
    assert found == list(zip(table["condition"], table["leakage"], table["friction"], strict=True))
    assert list(CONDITIONS) == [c.name for c in CONDITIONS.values()]


def test_the_leakage_table_is_the_published_table_3() -> None:
    table = pd.read_csv(PUBLISHED / "eha_table3_leakage.csv", keep_default_na=False).set_index("leakage")
    assert list(table.index) == list(LEVELS)
    for level, row in LEAKAGE_TABLE.items():
        assert list(asdict(row).values()) == table.loc[level].tolist()


def test_the_friction_table_is_the_published_table_4() -> None:
    table = pd.read_csv(PUBLISHED / "eha_table4_friction.csv", keep_default_na=False).set_index("friction")
    assert list(table.index) == list(LEVELS)
    for level, row in FRICTION_TABLE.items():
        assert list(asdict(row).values()) == table.loc[level].tolist()


def test_the_papers_rig_is_the_normal_condition() -> None:
    assert parameters_for(CONDITIONS["normal"]) == RIG


@pytest.mark.parametrize("condition", CONDITIONS.values(), ids=lambda c: c.name)
def test_on_the_papers_rig_every_condition_has_exactly_the_values_of_the_tables(condition: Condition) -> None:
    wanted = replace(RIG, **asdict(LEAKAGE_TABLE[condition.leakage]), **asdict(FRICTION_TABLE[condition.friction]))
    assert parameters_for(condition) == wanted


def test_leakage_at_4_volts_leaves_71_and_53_percent_of_the_velocity() -> None:
    normal = steady_velocity(RIG)
    minor = steady_velocity(parameters_for(CONDITIONS["minor_leakage"])) / normal
    major = steady_velocity(parameters_for(CONDITIONS["major_leakage"])) / normal
    assert minor == pytest.approx(0.71, abs=0.005)
    assert major == pytest.approx(0.53, abs=0.005)


def test_at_4_volts_minor_friction_needs_320_percent_pressure_and_major_the_relief_pressure() -> None:
    normal = steady_pressure(RIG)
    minor = steady_pressure(parameters_for(CONDITIONS["minor_friction"]))
    major = steady_pressure(parameters_for(CONDITIONS["major_friction"]))
    assert minor / normal == pytest.approx(3.2, abs=0.05)
    assert major > RIG.relief_pressure


@given(a=SEVERITIES, b=SEVERITIES)
def test_leakage_rises_with_its_severity_and_friction_does_not_change(a: float, b: float) -> None:
    less, more = severity(min(a, b), 0.0), severity(max(a, b), 0.0)
    assert less.leakage_coefficient <= more.leakage_coefficient
    assert less.flow_bias <= more.flow_bias
    assert (more.friction_quadratic, more.friction_linear) == (RIG.friction_quadratic, RIG.friction_linear)


@given(a=SEVERITIES, b=SEVERITIES, share=SHARES)
def test_friction_force_rises_with_its_severity_at_every_velocity(a: float, b: float, share: float) -> None:
    velocity = share * ideal_velocity(RIG)
    less, more = (friction_force(severity(0.0, s), velocity) for s in (min(a, b), max(a, b)))
    assert less <= more * (1.0 + 1e-12)
    assert less >= RIG.friction_coulomb


@given(a=SEVERITIES, b=SEVERITIES)
def test_velocity_at_rated_speed_falls_with_leakage_severity(a: float, b: float) -> None:
    less, more = (steady_velocity(severity(s, 0.0)) for s in (min(a, b), max(a, b)))
    assert less >= more * (1.0 - 1e-12)


def test_at_the_highest_leakage_severity_the_rig_still_moves_and_a_little_beyond_it_does_not() -> None:
    def lost_before_moving(p: EhaParameters) -> float:
        return p.flow_bias + p.leakage_coefficient * p.friction_coulomb / p.piston_area

    one_less, highest = (lost_before_moving(severity(s, 0.0)) for s in (HIGHEST_SEVERITY - 1.0, HIGHEST_SEVERITY))
    assert highest < rated_flow(RIG)
    assert highest + 0.6 * (highest - one_less) > rated_flow(RIG)


def test_parameters_are_linear_in_severity_between_and_beyond_the_levels() -> None:
    halfway = severity(1.5, 0.5)
    assert halfway.leakage_coefficient == pytest.approx(0.5 * (2.523e-11 + 6.006e-11), rel=1e-12, abs=0.0)
    assert halfway.friction_linear == pytest.approx(0.5 * (2.144e3 - 7.44e3), rel=1e-12)
    assert severity(0.0, 3.0).friction_coulomb == pytest.approx(551.0 + 51.0, rel=1e-12)


@given(a=SEVERITIES)
def test_a_rig_without_any_leakage_or_coulomb_friction_can_be_made_faulty(a: float) -> None:
    ideal = EhaParameters(leakage_coefficient=0.0, flow_bias=0.0, friction_coulomb=0.0, friction_quadratic=0.0)
    faulty = severity(a, a, ideal)
    worse = severity(a + 0.5, a + 0.5, ideal) if a < 4.5 else faulty
    assert 0.0 <= faulty.leakage_coefficient <= worse.leakage_coefficient
    assert 0.0 <= faulty.friction_coulomb <= worse.friction_coulomb


def test_a_rig_without_friction_gets_the_papers_increments_of_leakage() -> None:
    ideal = EhaParameters(friction_coulomb=0.0, friction_quadratic=0.0, friction_linear=0.0)
    added = severity(1.0, 0.0, ideal).leakage_coefficient - ideal.leakage_coefficient
    assert added == pytest.approx(2.523e-11 - 4.784e-12, rel=1e-12, abs=0.0)


@given(a=SEVERITIES, b=SEVERITIES)
@settings(max_examples=30)
def test_a_fault_changes_leakage_and_friction_and_nothing_else(a: float, b: float) -> None:
    faulty = asdict(severity(a, b, OTHER_RIG))
    may_change = {*asdict(LEAKAGE_TABLE["none"]), *asdict(FRICTION_TABLE["none"])}
    for name, value in asdict(OTHER_RIG).items():
        assert faulty[name] == value or name in may_change


def test_another_rig_keeps_its_own_values_without_a_fault() -> None:
    assert parameters_for(CONDITIONS["normal"], OTHER_RIG) == OTHER_RIG
    leaking = parameters_for(CONDITIONS["minor_leakage"], OTHER_RIG)
    assert leaking.friction_coulomb == OTHER_RIG.friction_coulomb


@pytest.mark.parametrize("level", [1.0, 2.0, 3.5])
def test_on_another_rig_a_leakage_fault_loses_the_same_share_of_the_pump_flow(level: float) -> None:
    def share_lost(base: EhaParameters) -> float:
        faulty = severity(level, 0.0, base)
        added = faulty.leakage_coefficient - base.leakage_coefficient
        _, normal_pressure = steady_state(base.rated_speed, base)
        return (faulty.flow_bias - base.flow_bias + added * normal_pressure) / rated_flow(base)

    assert share_lost(OTHER_RIG) == pytest.approx(share_lost(RIG), rel=1e-12)


@given(level=st.floats(0.1, 3.0), share=SHARES)
def test_on_another_rig_a_friction_fault_adds_the_same_share_of_pressure_at_the_same_share_of_velocity(
    level: float, share: float
) -> None:
    def pressure_added(base: EhaParameters) -> float:
        velocity = share * ideal_velocity(base)
        added = friction_force(severity(0.0, level, base), velocity) - friction_force(base, velocity)
        _, normal_pressure = steady_state(base.rated_speed, base)
        return added / base.piston_area / normal_pressure

    assert pressure_added(OTHER_RIG) == pytest.approx(pressure_added(RIG), rel=1e-9)


def test_on_another_rig_leakage_levels_leave_about_three_quarters_and_half_of_the_velocity() -> None:
    normal = steady_velocity(OTHER_RIG)
    minor, major = (
        steady_velocity(parameters_for(CONDITIONS[name], OTHER_RIG)) / normal
        for name in ("minor_leakage", "major_leakage")
    )
    assert 0.70 < minor < 0.74
    assert 0.49 < major < 0.55


@pytest.mark.parametrize("value", [-1e-9, 5.1, np.nan, np.inf])
def test_a_severity_out_of_range_is_refused_and_named(value: float) -> None:
    with pytest.raises(HydrostateError, match="leakage severity must be between 0 and 5"):
        severity(value, 0.0)
    with pytest.raises(HydrostateError, match="friction severity must be between 0 and 5"):
        severity(0.0, value)


def test_an_unknown_condition_or_level_is_refused_with_a_list_of_known_ones() -> None:
    with pytest.raises(HydrostateError, match=r"one of normal, minor_leakage, .*, got 'broken'"):
        find_condition("broken")
    with pytest.raises(HydrostateError, match="friction level must be one of none, minor, major, got 'huge'"):
        Condition("odd", "none", "huge")  # pyright: ignore[reportArgumentType]
    assert find_condition("major_friction") == Condition("major_friction", "none", "major")
