"""With its motor at rest a single rod stands, or creeps in balance; a through rod starts as it always did."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from faults.conditions import CONDITIONS, parameters_for
from plant.arrays import Array
from plant.components.oil import ATMOSPHERE
from plant.eha.circuit import circuit_derivative, circuit_pressures, observe_circuit
from plant.eha.circuit_parameters import CircuitParameters, circuit_values
from plant.eha.circuit_start import at_rest, pressure_of_force, push_at_rest, under_pressure
from plant.eha.model import piston_areas
from plant.eha.simulate import CIRCUIT, run_plant, simulate
from plant.solvers.steps import parameter_row

SINGLE = CircuitParameters(
    area_difference=0.2,
    volume_difference=0.15,
    pilot_share=1.0,
    accumulator_pressure=8e5,
    accumulator_gas=0.1,
    accumulator_oil=0.1,
)
RATIOS = {ratio: (ratio - 1.0) / (ratio + 1.0) for ratio in (0.5, 1.2, 1.6, 2.0)}
LOADS = (-3e3, -500.0, 0.0, 500.0, 3e3)
CASES = [
    (name, difference, load, pilot)
    for name, difference, load, pilot in product(
        ("normal", "major_leakage", "minor_friction", "major_leakage_minor_friction"),
        RATIOS.values(),
        LOADS,
        (0.0, 1.0),
    )
]


def rod(name: str, difference: float, load: float, pilot: float) -> CircuitParameters:
    changed = replace(SINGLE, area_difference=difference, load_force=load, pilot_share=pilot)
    p = parameters_for(CONDITIONS[name], changed)
    assert isinstance(p, CircuitParameters)
    return p


def balance_missed(p: CircuitParameters) -> tuple[float, float, float]:
    """Return what force, flow of the high side and flow of the low side lack of a balance, as shares of the largest."""
    state = at_rest(p)
    _, _, x, v, *oil = state
    rates = circuit_derivative(state, 0.0, p)
    pressures = circuit_pressures(x, (oil[0], oil[1], oil[2]), p)
    area_a, area_b = piston_areas(p)
    size = abs(push_at_rest(p)) + p.friction_coulomb
    swept = float(area_a * v), float(-area_b * v)
    wanted = max(abs(swept[0]), abs(swept[1]), 1e-12)
    missed = [abs(float(rates[4 + i]) - swept[i]) / wanted for i in range(2)]
    if pressures.a < pressures.b:
        missed.reverse()
    return abs(float(rates[3])) * p.moving_mass / size, missed[0], missed[1]


@pytest.mark.parametrize(("name", "difference", "load", "pilot"), CASES)
def test_force_and_flows_balance_at_rest(name: str, difference: float, load: float, pilot: float) -> None:
    p = rod(name, difference, load, pilot)
    force, high, low = balance_missed(p)
    state = at_rest(p)
    assert force < 1e-6
    assert high < 0.03
    shown = observe_circuit(state, p)
    raised = min(shown["pressure_a_pa"], shown["pressure_b_pa"]) - p.accumulator_pressure
    # without a pilot, a low side that is smaller is pumped up until nothing more can enter
    assert low < 0.03 or (pilot == 0.0 and raised > 0.99 * p.relief_pressure)
    assert abs(circuit_derivative(state, 0.0, p)[1]) * p.presliding_displacement <= 1e-6 * max(abs(state[3]), 1e-9)


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize(
    ("load", "leakage"),
    [
        pytest.param(0.0, 8e-10, id="the low side is so far below the accumulator that the case floats"),
        pytest.param(-3e3, 8e-10, id="the same under a load"),
        pytest.param(-8e3, 5e-12, id="the relief valve is open"),
    ],
)
def test_flows_balance_in_a_creep_that_opens_more_than_leaks(way: float, load: float, leakage: float) -> None:
    p = rod("normal", way / 3.0, way * load, 0.0)
    p = replace(p, leakage_coefficient=leakage, pump_case_leakage=0.8 * leakage, pump_crossport_leakage=0.0)
    assert max(balance_missed(p)) < 0.02


def settled(p: CircuitParameters, seconds: float) -> tuple[Array, Array]:
    """Return velocity [m/s] and pressures [Pa] after a start with both chambers at the accumulator's pressure."""
    equal = replace(CIRCUIT, start=lambda row: np.array(under_pressure(0.0, 0.0, circuit_values(row)), dtype=float))
    row = parameter_row(p)
    states = run_plant(equal, np.zeros(round(seconds / 1e-3) + 1), 1e-3, row[None, None])[0]
    seen = observe_circuit(tuple(states[-1]), p)
    return states[-1], np.array([seen["pressure_a_pa"], seen["pressure_b_pa"]])


@pytest.mark.parametrize("pilot", [0.0, 1.0])
@pytest.mark.parametrize(("difference", "load"), [(0.2, 0.0), (0.333, -800.0), (-0.2, 0.0), (0.091, -600.0)])
@pytest.mark.parametrize("name", ["major_leakage", "minor_leakage", "major_leakage_minor_friction"])
def test_a_piston_that_settles_by_itself_ends_in_that_creep(
    name: str, difference: float, load: float, pilot: float
) -> None:
    p = replace(rod(name, difference, load, pilot), chamber_volume=2e-4, stroke=0.05)
    state, pressures = settled(p, 0.3)
    started = at_rest(p)
    shown = observe_circuit(started, p)
    assert state[3] == pytest.approx(started[3], rel=0.03, abs=1e-6)
    largest = abs(pressures[0] - pressures[1])
    expected = [shown["pressure_a_pa"], shown["pressure_b_pa"]]
    np.testing.assert_allclose(pressures, expected, atol=0.03 * largest + 300.0)


@pytest.mark.parametrize("pressure", [2.758e5, 4e5])
def test_a_rod_that_friction_holds_does_not_move_before_its_motor_turns(pressure: float) -> None:
    p = replace(SINGLE, accumulator_pressure=pressure)
    assert 0.0 < push_at_rest(p) < p.friction_coulomb
    record = simulate(CIRCUIT, np.zeros(500), 1e-3, p)
    assert np.max(np.abs(record["position_m"])) < 1e-9
    assert np.max(np.abs(record["differential_pressure_pa"])) < 10.0


def test_a_tight_rod_holds_with_its_small_side_what_friction_does_not() -> None:
    p = replace(
        SINGLE,
        load_force=-3e3,
        leakage_coefficient=0.0,
        pump_crossport_leakage=0.0,
        pump_case_leakage=0.0,
    )
    record = simulate(CIRCUIT, np.zeros(500), 1e-3, p)
    held = push_at_rest(p) - p.friction_coulomb
    assert record["pressure_b_pa"][0] - record["pressure_a_pa"][0] == pytest.approx(held / piston_areas(p)[1], rel=1e-9)
    assert np.max(np.abs(record["position_m"])) < 1e-8


@pytest.mark.parametrize("load", LOADS)
def test_a_through_rod_starts_as_it_did(load: float) -> None:
    p = CircuitParameters(load_force=load)
    shown = observe_circuit(at_rest(p), p)
    assert shown["velocity_m_s"] == 0.0
    assert shown["differential_pressure_pa"] == pytest.approx(load / p.piston_area, rel=1e-9, abs=1e-6)
    assert at_rest(p) == under_pressure(load / p.piston_area, 0.0, p)
    assert pressure_of_force(120.0, p) == (120.0 + load) / p.piston_area


def test_many_circuits_start_as_each_alone() -> None:
    each = [rod(*case) for case in CASES[::7]] + [CircuitParameters(load_force=900.0)]
    rows = np.array([parameter_row(p) for p in each])
    together = np.array([np.broadcast_to(state, len(rows)) for state in at_rest(circuit_values(rows))])
    alone = np.array([at_rest(p) for p in each]).T
    np.testing.assert_allclose(together, alone, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_a_pressure_acts_on_the_side_that_it_is_in(sense: float) -> None:
    p = replace(SINGLE, friction_coulomb=1e4, load_force=200.0)
    area = piston_areas(p)[0 if sense > 0.0 else 1]
    force = sense * 2e5 * area + 2.0 * 0.2 * p.piston_area * (p.accumulator_pressure - ATMOSPHERE) - 200.0
    assert under_pressure(sense * 2e5, 0.0, p)[1] == pytest.approx(force / 1e4, rel=1e-12)
    assert pressure_of_force(force, p) == pytest.approx(sense * 2e5, rel=1e-12)


@pytest.mark.parametrize("load", LOADS)
@pytest.mark.parametrize(("leakage", "pilot"), [(0.0, 0.0), (1e-10, 0.0), (1e-10, 1.0)])
def test_a_rod_without_make_up_valves_or_drain_has_a_finite_start(load: float, leakage: float, pilot: float) -> None:
    p = replace(
        SINGLE,
        load_force=load,
        makeup_conductance=0.0,
        pump_case_leakage=0.0,
        leakage_coefficient=leakage,
        pump_crossport_leakage=0.0,
        pilot_share=pilot,
    )
    assert np.all(np.isfinite(at_rest(p)))
