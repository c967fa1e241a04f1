"""A sized cylinder meets its duty, with standard diameters and a rod that does not buckle."""

from dataclasses import replace
from itertools import pairwise
from math import pi

import pytest

from plant.eha.cylinder_sizing import BORES_MM, RODS_MM, Duty, buckling_rod, cylinder_circuit, size_cylinder
from plant.errors import HydrostateError

PRESS = Duty(extend_force=10e3, retract_force=3e3, extend_speed=0.1, retract_speed=0.2, stroke=0.5, supply_pressure=1e7)


def test_a_sized_cylinder_does_its_duty_with_standard_diameters() -> None:
    found = size_cylinder(PRESS)
    assert round(1e3 * found.bore) in BORES_MM
    assert round(1e3 * found.rod) in RODS_MM
    assert found.extend_force >= PRESS.extend_force
    assert found.retract_force >= PRESS.retract_force
    assert found.extend_pressure <= PRESS.supply_pressure * (1.0 - PRESS.valve_drop)


def test_the_next_smaller_bore_does_not_reach_the_forces() -> None:
    found = size_cylinder(PRESS)
    smaller = BORES_MM[BORES_MM.index(round(1e3 * found.bore)) - 1] / 1e3
    weaker = cylinder_circuit(PRESS, smaller, found.rod)
    assert weaker.extend_force < PRESS.extend_force or weaker.retract_force < PRESS.retract_force


def test_the_rod_carries_a_blocked_piston_at_the_relief_setting() -> None:
    found = size_cylinder(PRESS)
    assert found.buckling_force >= 3.5 * found.relief_setting * pi / 4.0 * found.bore**2


def test_port_flows_differ_by_the_rods_area() -> None:
    found = cylinder_circuit(PRESS, 0.05, 0.028)
    assert found.cap_flow - found.rod_flow == pytest.approx(pi / 4.0 * 0.028**2 * PRESS.retract_speed)
    assert found.pump_flow == pytest.approx(pi / 4.0 * (0.05**2 - 0.028**2) * 0.2)


def test_pump_power_is_the_pump_flow_at_the_relief_setting() -> None:
    found = cylinder_circuit(PRESS, 0.05, 0.028)
    assert found.power == pytest.approx(1.1 * PRESS.supply_pressure * found.pump_flow)


def test_valves_pass_the_flow_at_their_drop() -> None:
    found = cylinder_circuit(PRESS, 0.05, 0.028)
    drop = PRESS.valve_drop * PRESS.supply_pressure
    assert found.valve_conductance * drop**0.5 == pytest.approx(found.cap_flow)
    speed = (2.0 * drop / PRESS.density) ** 0.5
    assert PRESS.discharge_coefficient * found.check_valve_area * speed == pytest.approx(found.pump_flow)


def test_a_rod_twice_as_long_is_thicker_by_the_root_of_two() -> None:
    assert buckling_rod(1e3, 1.0) / buckling_rod(1e3, 0.5) == pytest.approx(2.0**0.5)


def test_twice_the_diameters_give_four_times_the_force_and_flow() -> None:
    twice = replace(PRESS, extend_force=4.0 * PRESS.extend_force, retract_force=4.0 * PRESS.retract_force)
    ours, theirs = cylinder_circuit(PRESS, 0.04, 0.02), cylinder_circuit(twice, 0.08, 0.04)
    assert theirs.extend_force == pytest.approx(4.0 * ours.extend_force)
    assert theirs.cap_flow == pytest.approx(4.0 * ours.cap_flow)


def test_the_diaphragm_motors_duty_fits_the_bore_of_its_table_2() -> None:
    motor = Duty(extend_force=40.0, extend_speed=4.2e-3, stroke=0.03, supply_pressure=1.4e5)
    assert cylinder_circuit(motor, 0.022, 0.006).extend_force > 40.0


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"stroke": 0.0}, "stroke must be positive, got 0.0"),
        ({"extend_force": -1.0}, "extend_force must not be negative, got -1.0"),
        ({"efficiency": 1.2}, "efficiency must be at most 1"),
    ],
)
def test_impossible_duties_are_refused(change: dict[str, float], said: str) -> None:
    with pytest.raises(HydrostateError, match=said):
        replace(PRESS, **change)


def test_a_duty_beyond_all_standard_cylinders_is_refused() -> None:
    with pytest.raises(HydrostateError, match=r"no standard cylinder up to 320 mm .* wanted 1e\+07 N out"):
        size_cylinder(replace(PRESS, extend_force=1e7))


def test_a_rod_as_thick_as_its_bore_is_refused() -> None:
    with pytest.raises(HydrostateError, match="rod must be thinner than the bore"):
        cylinder_circuit(PRESS, 0.02, 0.02)


@pytest.mark.parametrize("sizes", [BORES_MM, RODS_MM], ids=["bores", "rods"])
def test_standard_diameters_climb_in_the_steps_of_preferred_numbers(sizes: tuple[int, ...]) -> None:
    assert (sizes[0], sizes[-1]) in ((8, 320), (4, 160))
    steps = [after / before for before, after in pairwise(sizes)]
    assert min(steps) > 10.0 ** (1.0 / 40.0)
    assert max(steps) < 10.0 ** (1.0 / 7.0)


def test_a_free_rod_buckles_at_eulers_load_of_twice_its_length() -> None:
    rod, stiffness = 0.028, 2.1e11
    second_moment = pi * rod**4 / 64.0
    wanted = pi**2 * stiffness * second_moment / (2.0 * 0.8) ** 2
    assert cylinder_circuit(replace(PRESS, stroke=0.8), 0.05, rod).buckling_force == pytest.approx(wanted)


def test_force_reserve_and_needed_pressure_give_the_same_supply_in_both_directions() -> None:
    found = cylinder_circuit(PRESS, 0.05, 0.028)
    cap, ring = pi / 4.0 * 0.05**2, pi / 4.0 * (0.05**2 - 0.028**2)
    pressed = (found.extend_force - PRESS.extend_force) / (PRESS.efficiency * cap) + found.extend_pressure
    again = (found.retract_force - PRESS.retract_force) / (PRESS.efficiency * ring) + found.retract_pressure
    assert pressed == pytest.approx(again)
    assert pressed <= PRESS.supply_pressure


def test_cycle_time_relief_setting_and_pipe_bore_follow_from_the_duty() -> None:
    found = cylinder_circuit(PRESS, 0.05, 0.028)
    assert found.cycle_time == pytest.approx(0.5 / 0.1 + 0.5 / 0.2)
    assert found.relief_setting == pytest.approx(1.1e7)
    assert found.cap_flow / (pi / 4.0 * found.pipe_bore**2) == pytest.approx(PRESS.line_speed)
