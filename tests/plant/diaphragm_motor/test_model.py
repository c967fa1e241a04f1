"""The diaphragm motor: balances, energy, agreement with a stiff solver, and the flows that the paper quotes."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from benchmarks.peers.stiff_solvers import reference_trajectory
from plant.diaphragm_motor.flow import operate, pump_alone, tone
from plant.diaphragm_motor.model import (
    FLOWS,
    OPENINGS,
    POSITION,
    PRESSURES,
    SIDE_A,
    SIDE_B,
    STATES,
    VELOCITY,
    MotorRow,
    at_rest,
    deflections,
    motor_derivative,
    motor_row,
    reassemble_rows,
)
from plant.diaphragm_motor.parameters import DiaphragmMotorParameters, with_changed_value
from plant.diaphragm_motor.run import (
    BENCH_SENSORS,
    ELECTRODES,
    IDEAL_SENSORS,
    SAMPLE_TIME,
    electrode_voltages,
    motor_drive,
    run_motor,
    simulate_motor,
)
from plant.errors import DriveError, HydrostateError, RigError

HEALTHY = DiaphragmMotorParameters()
PUMP = pump_alone(HEALTHY)
ML_MIN = 1e-6 / 60.0
PEAK, SWING = 480.0, 200.0


def flow(frequency: float, swing: float = SWING, p: DiaphragmMotorParameters = PUMP) -> float:
    return operate(p, frequency, swing).outlet_flow / ML_MIN


def stored_energy(states: np.ndarray, p: DiaphragmMotorParameters) -> np.ndarray:
    """Return the energy of diaphragms, liquid, gas, ports, lines and piston, relative to rest [J]."""
    n, p0 = p.gas_exponent, p.supply_pressure
    absolute = p0 + states[:, PRESSURES]
    gas = np.array(p.gas_fraction) * p.chamber_volume / n * p0 ** (1.0 / n)
    work = absolute ** (1.0 - 1.0 / n) / (1.0 - 1.0 / n) + n * p0 * absolute ** (-1.0 / n)
    rest = p0 ** (1.0 - 1.0 / n) * (1.0 / (1.0 - 1.0 / n) + n)
    soft = p.diaphragm_compliance + p.chamber_volume / p.bulk_modulus
    side = p.line_compliance + p.cylinder_volume / p.cylinder_bulk_modulus
    held = 0.5 * soft * states[:, PRESSURES] ** 2 + gas * (work - rest)
    moving = 0.5 * p.inertance * states[:, FLOWS] ** 2
    cylinder = 0.5 * side * (states[:, SIDE_A] ** 2 + states[:, SIDE_B] ** 2)
    return held.sum(axis=1) + moving.sum(axis=1) + cylinder + 0.5 * p.moving_mass * states[:, VELOCITY] ** 2


def test_the_motor_at_rest_without_drive_stays_there() -> None:
    assert not np.any(motor_derivative(tuple(at_rest(HEALTHY)), 0.0, HEALTHY))
    np.testing.assert_array_equal(run_motor(HEALTHY, np.zeros(50), 1e-4)[-1], at_rest(HEALTHY))


def test_a_free_response_only_loses_energy() -> None:
    start = at_rest(HEALTHY)
    start[PRESSURES] = 2e4 * np.array([1.0, -1.0, 0.5, 1.0, -0.7, 0.3, 1.0])
    start[SIDE_A], start[VELOCITY] = 3e4, 0.02
    energy = stored_energy(run_motor(HEALTHY, np.zeros(4001), 5e-6, start=start), HEALTHY)
    lost = np.diff(energy[::20])
    assert np.all(lost < 1e-4 * energy[0])
    assert energy[-1] < 0.05 * energy[0]


def test_the_inlet_flow_of_the_pump_equals_its_outlet_flow() -> None:
    point = operate(PUMP, PEAK, SWING)
    assert point.inlet_flow == pytest.approx(point.outlet_flow, rel=2e-3)


def test_the_cylinder_takes_in_what_the_pump_delivers() -> None:
    tight = replace(HEALTHY, crossport_leakage=0.0)
    point = operate(tight, PEAK, SWING)
    assert tight.piston_area * point.velocity == pytest.approx(point.outlet_flow, rel=2e-3)


def test_halving_the_step_changes_the_flow_by_less_than_three_thousandths() -> None:
    halved = operate(PUMP, PEAK, SWING, longest_step=2.5e-6).outlet_flow / ML_MIN
    assert flow(PEAK) == pytest.approx(halved, rel=3e-3)


def test_the_flow_has_its_published_peak_and_the_middle_electrodes_peak_with_it() -> None:
    frequencies = np.arange(440.0, 521.0, 10.0)
    points = [operate(PUMP, frequency, SWING) for frequency in frequencies]
    flows = [point.outlet_flow / ML_MIN for point in points]
    assert max(flows) == pytest.approx(110.0, abs=2.0)
    assert frequencies[int(np.argmax(flows))] == pytest.approx(480.0, abs=10.0)
    middle = np.array([np.abs(point.tones[2:5]) for point in points])
    assert frequencies[middle.argmax(axis=0)] == pytest.approx(480.0, abs=10.0)


def test_flow_rises_with_voltage_and_the_sensed_tone_rises_linearly() -> None:
    swings = np.array([100.0, 150.0, 200.0, 250.0, 300.0])
    points = [operate(PUMP, PEAK, swing) for swing in swings]
    assert np.all(np.diff([point.outlet_flow for point in points]) > 0.0)
    for middle in (2, 3, 4):
        sensed = np.array([abs(point.tones[middle]) for point in points])
        assert np.all(np.diff(sensed) > 0.0)
        assert np.corrcoef(swings, sensed)[0, 1] ** 2 > 0.99


def test_velocity_falls_linearly_with_load() -> None:
    loads = np.linspace(0.0, 25.0, 6)
    speeds = [operate(replace(HEALTHY, load_force=load), PEAK, SWING).velocity for load in loads]
    assert np.corrcoef(loads, speeds)[0, 1] ** 2 > 0.999
    assert np.all(np.diff(speeds) < 0.0)


def test_the_directional_valve_reverses_the_piston() -> None:
    forth, back = (operate(replace(HEALTHY, spool=spool), PEAK, SWING) for spool in (1.0, -1.0))
    assert forth.velocity > 3e-3
    assert back.velocity == pytest.approx(-forth.velocity, rel=1e-9)
    assert abs(operate(replace(HEALTHY, spool=0.0), PEAK, SWING).velocity) < 1e-6


def test_a_cycle_of_the_valve_brings_the_rod_back() -> None:
    drive = motor_drive(PEAK, SWING, 0.3, SAMPLE_TIME)
    schedule = [(0.0, HEALTHY), (0.15, replace(HEALTHY, spool=-1.0))]
    position = simulate_motor(schedule, drive, SAMPLE_TIME)["position_m"]
    assert position.max() > 4e-4
    assert abs(position[-1]) < 0.2 * position.max()


def test_each_fault_costs_at_least_three_percent_of_the_velocity() -> None:
    healthy = operate(HEALTHY, PEAK, SWING).velocity
    faults = (
        replace(HEALTHY, valve_leak=with_changed_value(HEALTHY.valve_leak, 4, 1.0)),
        replace(HEALTHY, valve_lift=with_changed_value(HEALTHY.valve_lift, 4, 0.1)),
        replace(HEALTHY, polarisation=with_changed_value(HEALTHY.polarisation, 4, 0.0)),
        replace(HEALTHY, gas_fraction=(2e-2,) * 7),
        replace(HEALTHY, crossport_leakage=1e-11),
        replace(HEALTHY, port_area=0.7 * HEALTHY.port_area),
        replace(HEALTHY, coulomb_friction=12.0),
        replace(HEALTHY, valve_lag=1.5 * HEALTHY.valve_lag),
    )
    assert all(operate(faulty, PEAK, SWING).velocity < 0.97 * healthy for faulty in faults)


def test_no_chamber_falls_below_the_least_pressure() -> None:
    starved = replace(HEALTHY, supply_pressure=2e4)
    states = run_motor(starved, motor_drive(PEAK, 300.0, 0.05, 1e-5), 1e-5)
    assert states[:, PRESSURES].min() >= starved.least_pressure - starved.supply_pressure
    assert np.all((states[:, OPENINGS] > 0.0) & (states[:, OPENINGS] <= 1.0))


def test_a_pump_that_runs_dry_has_no_flow() -> None:
    starved = pump_alone(replace(HEALTHY, supply_pressure=2e4))
    with pytest.raises(HydrostateError, match=r"chamber \d ran out of liquid; raise supply_pressure, 20000 Pa"):
        operate(starved, PEAK, SWING)
    fed = operate(replace(starved, supply_pressure=5e4), PEAK, SWING)
    assert fed.outlet_flow == pytest.approx(fed.inlet_flow, rel=1e-4)


def test_a_load_that_pulls_a_side_dry_is_no_log() -> None:
    pulled = replace(HEALTHY, load_force=-100.0)
    drive = motor_drive(PEAK, SWING, 0.05, SAMPLE_TIME)
    with pytest.raises(HydrostateError, match=r"stopped at 0\.03\d\d s: side A of the cylinder ran out of liquid"):
        simulate_motor([(0.0, HEALTHY), (0.03, pulled)], drive, SAMPLE_TIME)


def test_electrodes_hold_no_steady_charge() -> None:
    held = electrode_voltages(np.full((2000, 7), 1e-6), HEALTHY, 1e-3)
    assert np.all(np.abs(held[-1]) < 1e-6)


def test_a_tone_is_separated_from_a_harmonic_and_an_offset() -> None:
    time = 1e-4 * np.arange(1000)
    mixed = 2.0 * np.sin(2.0 * np.pi * 50.0 * time + 0.3) + np.cos(2.0 * np.pi * 100.0 * time) + 5.0
    assert tone(mixed, 1e-4, 50.0) == pytest.approx(2.0 * np.exp(0.3j), abs=1e-9)


@pytest.mark.parametrize("swing", [301.0, -310.0])
def test_a_drive_that_depolarises_is_refused(swing: float) -> None:
    with pytest.raises(DriveError, match="take 150 V of either sign"):
        motor_drive(PEAK, swing, 0.1, SAMPLE_TIME)


@pytest.mark.parametrize("frequency", [0.0, 1001.0, np.nan])
def test_a_frequency_out_of_range_is_refused(frequency: float) -> None:
    with pytest.raises(DriveError, match="at most 1000 Hz"):
        motor_drive(frequency, SWING, 0.1, SAMPLE_TIME)


def test_a_sine_of_too_few_samples_is_refused() -> None:
    with pytest.raises(DriveError, match=r"sample_time must be at most 0\.000104 s"):
        motor_drive(PEAK, SWING, 0.1, 1e-3)


def test_an_overrunning_load_pulls_no_liquid_below_the_least_pressure() -> None:
    states = run_motor(replace(HEALTHY, load_force=-500.0), motor_drive(PEAK, SWING, 0.1, SAMPLE_TIME), SAMPLE_TIME)
    lowest = HEALTHY.least_pressure - HEALTHY.supply_pressure
    assert states[:, SIDE_A].min() >= lowest
    assert np.all(np.isfinite(states))


def test_sensor_noise_has_its_stated_deviation_and_follows_the_seed() -> None:
    drive = motor_drive(PEAK, SWING, 0.05, SAMPLE_TIME)

    def noisy(seed: int) -> np.ndarray:
        rng = np.random.default_rng(seed)
        record = simulate_motor(HEALTHY, drive, SAMPLE_TIME, sensors=BENCH_SENSORS, rng=rng, keep_truth=True)
        assert set(record) >= {"drive_voltage_v", *ELECTRODES, "position_m"}
        return record["electrode_4_v"] - record["true_electrode_4_v"]

    assert np.std(noisy(1)) == pytest.approx(0.02, rel=0.05)
    np.testing.assert_array_equal(noisy(1), noisy(1))
    assert simulate_motor(HEALTHY, drive, SAMPLE_TIME, sensors=IDEAL_SENSORS).metadata["plant"] == "diaphragm-motor"
    with pytest.raises(HydrostateError, match="needs rng"):
        simulate_motor(HEALTHY, drive, SAMPLE_TIME, sensors=BENCH_SENSORS)


@pytest.mark.parametrize(
    ("name", "value"),
    [("port_area", 0.0), ("coulomb_friction", -1.0), ("spool", 0.5), ("gas_fraction", (0.0,)), ("load_force", np.nan)],
)
def test_impossible_parameters_are_refused(name: str, value: float | tuple[float, ...]) -> None:
    with pytest.raises(RigError, match=f"{name} must"):
        DiaphragmMotorParameters(**{name: value})  # pyright: ignore[reportArgumentType] - one of each kind of field


def test_a_place_out_of_range_is_refused() -> None:
    with pytest.raises(RigError, match="a place from 1 to 8 is needed, got 9"):
        with_changed_value(HEALTHY.valve_leak, 9, 1.0)


def test_a_schedule_that_does_not_start_at_zero_is_refused() -> None:
    drive = motor_drive(PEAK, SWING, 0.01, SAMPLE_TIME)
    with pytest.raises(DriveError, match="must rise from 0"):
        simulate_motor([(0.005, HEALTHY)], drive, SAMPLE_TIME)


def test_the_states_are_named_once_each_and_the_rod_comes_last() -> None:
    assert len(set(STATES)) == len(STATES) == 28
    assert STATES[POSITION] == "position_m"


@pytest.mark.slow
def test_flow_and_deflections_follow_a_stiff_solver() -> None:
    step, time = 1e-5, 0.06
    drive = motor_drive(PEAK, SWING, time, step)
    rate = np.gradient(drive, step, edge_order=2)
    start = at_rest(HEALTHY)
    start[SIDE_B] = 1.0  # the square root in the return land's flow has no slope at zero
    row = MotorRow(*motor_row(HEALTHY))
    scale = np.array([2e4] * 7 + [10.0] + [2e-6] * 8 + [1.0] * 8 + [1e4, 1e4, 5e-3, 1e-4])

    def rates(state: tuple[Any, ...], slope: Any, flat: Any) -> tuple[Any, ...]:
        return motor_derivative(state, slope, reassemble_rows(flat))

    wanted = reference_trajectory(rates, start, rate, row, step, scale=scale, relative_tolerance=1e-7)
    ours = run_motor(HEALTHY, drive, step, start=start)
    half = len(drive) // 2
    bent, true = (deflections(states, drive, HEALTHY)[half:] for states in (ours, wanted))
    assert np.sqrt(np.mean((bent - true) ** 2)) < 1e-3 * np.ptp(true)
    assert ours[half:, FLOWS].mean() == pytest.approx(wanted[half:, FLOWS].mean(), rel=1e-3)
