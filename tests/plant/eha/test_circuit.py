"""The circuit conserves oil, creates no energy, converges to the lumped plant, and stays within its range."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from faults.conditions import CONDITIONS, Condition, parameters_for
from faults.eha.physical import with_throttles
from plant.arrays import Array
from plant.components.oil import effective_bulk_modulus
from plant.eha.circuit import (
    CircuitState,
    Pressures,
    circuit_derivative,
    circuit_flows,
    circuit_pressures,
    observe_circuit,
)
from plant.eha.circuit_parameters import CircuitParameters
from plant.eha.circuit_start import at_rest, under_pressure
from plant.eha.drives import make_drive
from plant.eha.simulate import CIRCUIT, LUMPED, simulate
from plant.eha.steady_state import steady_state
from plant.log.record import Record
from plant.solvers.steps import parameter_row
from plant.solvers.trajectory import compile_trajectory

PAPER = CircuitParameters()
HARSH = parameters_for(CONDITIONS["major_leakage_minor_friction"], PAPER)
TRUTHS = ("position_m", "velocity_m_s", "differential_pressure_pa")


def states_of(p: CircuitParameters, speed: Array, sample_time: float = 1e-4, initial: Array | None = None) -> Array:
    run = compile_trajectory(CIRCUIT.name, CIRCUIT.step, 7, CircuitParameters)
    row = parameter_row(p)
    return run(CIRCUIT.start(row) if initial is None else initial, speed, row[None], sample_time, CIRCUIT.substeps)


def drive(name: str, seconds: float, seed: int = 0) -> Array:
    return make_drive(name, seconds, 1e-4, PAPER, np.random.default_rng(seed))


def disturbance(record: Record, other: Record) -> float:
    """Return the largest RMS difference, each relative to a scale of the drive: 1 cm, 1 cm/s, 100 kPa."""
    scales = dict(zip(TRUTHS, (1e-2, 1e-2, 1e5), strict=True))
    return max(float(np.sqrt(np.mean((record[n] - other[n]) ** 2))) / scales[n] for n in TRUTHS)


def floating(p: CircuitParameters, size: float) -> CircuitParameters:
    """Return the circuit closer to the lumped plant: larger and equally stiffer, make-up idle, seals stiff."""
    return replace(
        p,
        chamber_volume=p.chamber_volume * size,
        bulk_modulus=p.bulk_modulus * size,
        presliding_displacement=p.presliding_displacement / size,
        motor_lag=p.motor_lag / size,
        makeup_conductance=0.0,
        accumulator_pressure=1e7,
    )


# If friction falls with speed (minor friction), the lumped piston jumps as it breaks loose: half an order less.
@pytest.mark.parametrize(
    ("condition", "share"), [("normal", 0.45), ("major_friction", 0.45), ("major_leakage_minor_friction", 0.7)]
)
@pytest.mark.parametrize("name", ["steps", "sine"])
def test_the_circuit_converges_to_the_lumped_plant(condition: str, share: float, name: str) -> None:
    base = parameters_for(CONDITIONS[condition], PAPER)
    assert isinstance(base, CircuitParameters)
    speed = drive(name, 1.0)
    apart = [
        disturbance(*(simulate(plant, speed, 1e-4, floating(base, size)) for plant in (CIRCUIT, LUMPED)))
        for size in (4.0, 16.0, 64.0, 256.0)
    ]
    assert apart[-1] < 2e-2
    assert all(fine < share * coarse for coarse, fine in pairwise(apart))


def test_a_motor_without_lag_follows_its_command() -> None:
    speed = drive("sine", 0.5)
    quick, none = (simulate(CIRCUIT, speed, 1e-4, replace(PAPER, motor_lag=lag)) for lag in (1e-6, 0.0))
    np.testing.assert_array_equal(none["motor_speed_rad_s"], speed)
    assert disturbance(quick, none) < 1e-3


@pytest.mark.parametrize("drain", [0.0, 1e-12])
def test_pressure_falls_by_the_lumped_leakage_while_both_chambers_float(drain: float) -> None:
    p = replace(PAPER, cylinder_drain_leakage=drain, pump_case_leakage=1e-12, pump_crossport_leakage=5e-13)
    start = list(at_rest(p))
    start[4] *= 1.0 + 1e-4
    start[5] *= 1.0 - 1e-4
    pressures = circuit_pressures(0.0, (start[4], start[5], start[6]), p)
    dp = pressures.a - pressures.b
    rates = circuit_derivative(tuple(start), 0.0, replace(p, makeup_conductance=0.0))  # type: ignore[arg-type]
    stiff = effective_bulk_modulus(pressures.supply, p.bulk_modulus, 0.0, p.vapour_pressure)
    falling = stiff * (rates[4] / start[4] - rates[5] / start[5])
    assert -falling * p.chamber_volume / stiff == pytest.approx(p.leakage_coefficient * dp, rel=1e-3)


DRAINED = replace(PAPER, cylinder_drain_leakage=1e-12, pump_case_leakage=1e-12, makeup_conductance=0.0)


@pytest.mark.parametrize(("a", "b"), [(4e5, 1e5), (1e5, 4e5)])
def test_a_floating_case_drain_passes_no_oil_to_the_accumulator(a: float, b: float) -> None:
    flows = circuit_flows(0.0, (1.02, 0.98), Pressures(a, b, 5e5), DRAINED)
    assert flows.supply == 0.0
    assert flows.a * (a - b) < 0.0


@pytest.mark.parametrize("a_is_higher", [True, False])
def test_a_chamber_above_the_case_drains_oil_of_its_own_density(*, a_is_higher: bool) -> None:
    # half of the drain makes up all of the leakage, so that no oil crosses inside
    only_drained = replace(DRAINED, leakage_coefficient=1e-12, pump_crossport_leakage=0.0)
    supply = only_drained.accumulator_pressure
    high, low = (supply + 4e5, 1.04), (supply + 2e5, 1.01)
    (a, density_a), (b, density_b) = (high, low) if a_is_higher else (low, high)
    found = circuit_flows(0.0, (density_a, density_b), Pressures(a, b, supply), only_drained)
    drain = only_drained.cylinder_drain_leakage + only_drained.pump_case_leakage
    assert found.a == pytest.approx(-drain * (a - supply) * density_a, rel=1e-12)
    assert found.b == pytest.approx(-drain * (b - supply) * density_b, rel=1e-12)
    assert found.a + found.b + found.supply == pytest.approx(0.0, abs=1e-12 * found.supply)


def test_a_drain_takes_oil_from_both_chambers_if_both_exceed_accumulator_pressure() -> None:
    level = circuit_flows(0.0, (1.02, 1.02), Pressures(9e5, 9e5, 5e5), DRAINED)
    drain = DRAINED.cylinder_drain_leakage + DRAINED.pump_case_leakage
    assert level.supply == pytest.approx(2.0 * drain * 4e5 * 1.02)
    assert level.a == pytest.approx(-0.5 * level.supply)
    assert level.b == pytest.approx(-0.5 * level.supply)
    steep = circuit_flows(0.0, (1.02, 1.0), Pressures(9e5, 7e5, 5e5), DRAINED)
    assert steep.supply == pytest.approx(drain * (4e5 + 2e5), rel=0.03)
    assert steep.a + steep.b + steep.supply == pytest.approx(0.0, abs=1e-18)


@pytest.mark.parametrize("condition", CONDITIONS.values(), ids=CONDITIONS)
def test_the_circuit_settles_at_the_analytic_steady_state(condition: Condition) -> None:
    p = parameters_for(condition, replace(PAPER, stroke=1.2))
    assert isinstance(p, CircuitParameters)
    record = simulate(CIRCUIT, np.full(10_000, p.rated_speed), 1e-3, p)
    settled = replace(p, leakage_coefficient=p.settled_leakage)
    velocity, pressure = steady_state(p.rated_speed, settled)
    assert record["velocity_m_s"][-1] == pytest.approx(velocity, rel=2e-3)
    assert record["differential_pressure_pa"][-1] == pytest.approx(pressure, rel=5e-3)


def test_oil_is_conserved_over_a_minute_of_leakage_and_makeup() -> None:
    oil = states_of(HARSH, drive("prbs", 60.0), 1e-4)[:, 4:]
    total = oil.sum(axis=1)
    assert np.ptp(oil[:, 2]) > 1e-6
    assert np.max(np.abs(total / total[0] - 1.0)) < 1e-12


def test_the_bypass_valve_unloads_the_pump() -> None:
    speed = np.full(3_000, PAPER.rated_speed)
    record = simulate(CIRCUIT, speed, 1e-4, replace(PAPER, bypass_conductance=1e-9))
    assert np.max(np.abs(record["differential_pressure_pa"])) < 1.2e5
    assert np.max(np.abs(record["position_m"])) < PAPER.presliding_displacement


def test_make_up_valves_keep_the_low_side_near_accumulator_pressure() -> None:
    speed = drive("prbs", 2.0)
    with_valves, without = (
        simulate(CIRCUIT, speed, 1e-4, replace(PAPER, makeup_conductance=conductance)) for conductance in (1e-8, 0.0)
    )
    low = [min(np.min(r["pressure_a_pa"]), np.min(r["pressure_b_pa"])) for r in (with_valves, without)]
    assert low[0] > 0.9 * PAPER.accumulator_pressure
    assert low[1] < 0.25 * PAPER.accumulator_pressure


def test_the_piston_stops_at_the_end_of_its_stroke() -> None:
    record = simulate(CIRCUIT, np.full(50_000, 251.0), 1e-4, PAPER)
    assert record["position_m"][-1] == pytest.approx(0.5 * PAPER.stroke, abs=2e-4)
    assert record["velocity_m_s"][-1] == pytest.approx(0.0, abs=1e-6)
    assert record["differential_pressure_pa"][-1] == pytest.approx(PAPER.relief_pressure, rel=0.01)


def test_the_relief_valve_holds_the_pressure_at_its_setting() -> None:
    p = replace(with_throttles(PAPER, 10.0, 3.0), relief_pressure=2e6)
    record = simulate(CIRCUIT, np.full(10_000, 251.0), 1e-4, p)
    assert record["differential_pressure_pa"][-1] == pytest.approx(2e6, rel=0.02)


def test_a_small_pressure_moves_the_piston_only_within_its_presliding() -> None:
    start = np.array(at_rest(PAPER), dtype=np.float64)
    start[4] *= 1.0 + 2.5e-4
    start[5] *= 1.0 - 2.5e-4
    states = states_of(PAPER, np.zeros(20_000), initial=start)
    assert 1e-6 < np.max(states[:, 2]) < PAPER.presliding_displacement
    assert abs(states[-1, 1]) < 0.7 * np.max(np.abs(states[:, 1]))


def test_the_plain_function_gives_the_compiled_rates() -> None:
    state: CircuitState = (50.0, 0.5, 1e-3, 0.02, *at_rest(PAPER)[4:])
    step = 1e-9
    row = parameter_row(PAPER)
    run = compile_trajectory(CIRCUIT.name, CIRCUIT.step, 7, CircuitParameters)
    moved = run(np.array(state), np.array([60.0, 60.0]), row[None], step, 1)[1]
    rates = np.array(circuit_derivative(state, 60.0, PAPER), dtype=np.float64)
    np.testing.assert_allclose((moved - np.array(state))[:4] / step, rates[:4], rtol=1e-3)


VOLTS = st.floats(0.0, 10.0) | st.sampled_from([0.0, 10.0])
DRIVES = st.lists(st.floats(-10.0, 10.0), min_size=4, max_size=10)


@settings(max_examples=40)
@given(VOLTS, VOLTS, st.floats(0.0, 0.2), DRIVES, st.sampled_from([0.0, 2e-3]))
def test_pressures_stay_finite_and_above_vapour_pressure_with_any_throttles_air_and_drive(
    a_volts: float, b_volts: float, air: float, levels: list[float], lag: float
) -> None:
    p = with_throttles(replace(PAPER, air_fraction=air, motor_lag=lag), a_volts, b_volts)
    speed = np.repeat(np.array(levels) * PAPER.motor_speed_limit, 20)
    record = simulate(CIRCUIT, speed, 1e-3 if b_volts < 5.0 else 1e-4, p)
    for name in ("pressure_a_pa", "pressure_b_pa"):
        assert np.all(np.isfinite(record[name]))
        assert np.min(record[name]) >= p.vapour_pressure
        assert np.max(record[name]) < 2.0 * p.relief_pressure
    assert np.max(np.abs(record["position_m"])) < 0.5 * p.stroke + 2e-3
    assert np.max(np.abs(record["velocity_m_s"])) < 2.0


@pytest.mark.parametrize("pressure", [-8e5, 0.0, 3e5, 2e6])
def test_under_pressure_sets_the_difference_with_the_lower_chamber_at_accumulator_pressure(pressure: float) -> None:
    p = PAPER
    shown = observe_circuit(under_pressure(pressure, 0.01, p), p)
    assert shown["differential_pressure_pa"] == pytest.approx(pressure, abs=1.0)
    assert min(shown["pressure_a_pa"], shown["pressure_b_pa"]) == pytest.approx(p.accumulator_pressure, rel=1e-9)
    assert shown["velocity_m_s"] == 0.01
