"""The piezo-stack actuator: conservation, agreement with a stiff solver, and the flows that the paper quotes."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from benchmarks.peers.stiff_solvers import reference_trajectory
from plant.components.oil import specific_volume
from plant.errors import DriveError, HydrostateError, RigError
from plant.piezo_stack.flow import STAGES, line_reynolds_numbers, mean_flow, output_flow, stages
from plant.piezo_stack.model import OIL, STATES, at_bias, stack_derivative, stack_pressures
from plant.piezo_stack.parameters import PiezoStackParameters, least_port
from plant.piezo_stack.run import FINE_TIME, IDEAL_SENSORS, StackSensors, simulate_stack, sine_drive
from plant.piezo_stack.trajectory import run_stack, run_stacks
from plant.units import LITRE_PER_MINUTE

HEALTHY = PiezoStackParameters()
LOADED = replace(HEALTHY, load_mass=10.0)
PEAK = 275.0
TIME = 0.04
DRIVE = sine_drive(PEAK, 140.0, TIME, FINE_TIME)
SCALE = np.array(
    [1e-5, 0.02, 2e3, 1e-6, 1e-9, 1e-4, 0.1, 1e-4, 0.1, 1e-9, 1e-5, 1e-9, 1e-3, 0.1, 1e-9, 1e-5, 1e-9, 1e-5, 1e-9]
)


def litres(p: PiezoStackParameters, frequency: float = PEAK, voltage: float = 140.0) -> float:
    return output_flow(p, frequency, voltage) / LITRE_PER_MINUTE


@pytest.fixture(scope="module")
def loaded() -> np.ndarray:
    return run_stack(LOADED, DRIVE, FINE_TIME)


@pytest.mark.parametrize("gas", [30e-6, 0.0], ids=["accumulator open", "accumulator shut"])
def test_no_oil_is_lost(gas: float) -> None:
    states = run_stack(replace(LOADED, accumulator_gas=gas, chamber_leakage=1e-11), DRIVE, FINE_TIME)
    oil = states[:, list(OIL)].sum(axis=1)
    assert np.ptp(oil) < 1e-12 * oil[0]


@pytest.mark.parametrize(
    ("leak", "empty", "full"),
    [
        ("chamber_leakage", "oil_chamber_m3", "oil_accumulator_m3"),
        ("crossport_leakage", "oil_low_side_m3", "oil_high_side_m3"),
        ("crossport_leakage", "oil_high_side_m3", "oil_low_side_m3"),
    ],
)
def test_a_leak_has_the_density_of_the_side_that_it_comes_from(leak: str, empty: str, full: str) -> None:
    p = HEALTHY
    state = at_bias(p)
    state[STATES.index(empty)] *= 0.5  # vapour fills the rest
    tight, leaking = (
        np.array(stack_derivative(tuple(state), 0.0, 0.0, replace(p, **{leak: value}))) for value in (0.0, 1e-11)
    )
    density = 1.0 / specific_volume(p.bias_pressure, p.bulk_modulus, p.air_fraction, p.vapour_pressure)
    flow = (leaking - tight)[STATES.index(empty)]
    assert flow == pytest.approx(1e-11 * p.bias_pressure * density, rel=5e-3)
    assert (tight - leaking)[STATES.index(full)] == flow


def test_the_actuator_at_bias_without_drive_only_lets_its_rod_sink_under_gravity() -> None:
    rates = stack_derivative(tuple(at_bias(HEALTHY)), 0.0, 0.0, HEALTHY)
    moving = {name for name, rate in zip(STATES, rates, strict=True) if abs(rate) > 1e-6}
    assert moving == {"velocity_m_s"}


def test_halving_the_step_changes_flow_and_pressure_by_less_than_a_thousandth(loaded: np.ndarray) -> None:
    halved = run_stack(LOADED, DRIVE, FINE_TIME, longest_step=1e-6)
    coarse, fine = (stack_pressures(tuple(states.T), LOADED).chamber for states in (loaded, halved))
    assert np.sqrt(np.mean((coarse - fine) ** 2)) < 1e-3 * np.ptp(fine)
    flows = [mean_flow(states[:, 12], FINE_TIME, PEAK, LOADED.cylinder_area) for states in (loaded, halved)]
    assert flows[0] == pytest.approx(flows[1], rel=1e-3)


@pytest.mark.slow
def test_flow_and_pressure_follow_a_stiff_solver(loaded: np.ndarray) -> None:
    def augmented(state: tuple[Any, ...], rate: Any, p: Any) -> tuple[Any, ...]:
        return (*stack_derivative(state[:-1], state[-1], rate, p), rate)

    time = FINE_TIME * np.arange(len(DRIVE))
    rate = 70.0 * 2.0 * np.pi * PEAK * np.sin(2.0 * np.pi * PEAK * time)
    start = np.append(at_bias(LOADED), 0.0)
    found = reference_trajectory(augmented, start, rate, LOADED, FINE_TIME, scale=np.append(SCALE, 70.0))
    wanted, ours = (stack_pressures(tuple(states.T[:19]), LOADED).chamber for states in (found, loaded))
    assert np.sqrt(np.mean((ours - wanted) ** 2)) < 2e-4 * np.ptp(wanted)
    flows = [mean_flow(states[:, 12], FINE_TIME, PEAK, LOADED.cylinder_area) for states in (loaded, found)]
    assert flows[0] == pytest.approx(flows[1], rel=5e-4)


def test_actuators_run_side_by_side_as_they_run_alone_to_the_bit() -> None:
    many = [replace(HEALTHY, load_mass=mass) for mass in np.linspace(0.0, 20.0, 9)]
    drive = DRIVE[:301]
    together = list(run_stacks(many, drive, FINE_TIME))
    assert len(together) == len(many)
    for place in (0, 4, 8):
        np.testing.assert_array_equal(together[place], run_stack(many[place], drive, FINE_TIME))


def test_a_port_too_small_for_the_step_is_refused() -> None:
    with pytest.raises(RigError, match=r"port_volume must be at least 2\.4e-06"):
        PiezoStackParameters(port_volume=1e-6)
    assert least_port(HEALTHY) < HEALTHY.port_volume


def test_no_pressure_falls_to_vapour_pressure_at_low_bias() -> None:
    starved = replace(HEALTHY, bias_pressure=1.2e5)
    states = run_stack(starved, DRIVE, FINE_TIME)
    assert min(float(p.min()) for p in stack_pressures(tuple(states.T), starved)) > starved.vapour_pressure


def test_the_no_load_flow_has_its_published_peak() -> None:
    flows = {frequency: litres(HEALTHY, frequency) for frequency in np.arange(200.0, 376.0, 25.0)}
    best = max(flows, key=lambda frequency: flows[frequency])
    assert flows[best] == pytest.approx(1.6, abs=0.08)
    assert 250.0 <= best <= 300.0


def test_less_bias_or_less_voltage_pumps_clearly_less_at_the_peak() -> None:
    high = litres(HEALTHY)
    assert litres(replace(HEALTHY, bias_pressure=0.6e6)) < 0.85 * high
    assert litres(HEALTHY, voltage=100.0) < 0.85 * high


def test_the_flow_is_one_litre_a_minute_at_20_kg_and_still_positive_at_50_kg() -> None:
    best = max(litres(replace(HEALTHY, load_mass=20.0), frequency) for frequency in (250.0, 275.0, 300.0))
    assert best == pytest.approx(1.0, abs=0.08)
    assert litres(replace(HEALTHY, load_mass=50.0)) > 0.0


def test_a_cycle_passes_its_four_stages_in_order() -> None:
    heavy = replace(HEALTHY, load_mass=20.0)
    states = run_stack(heavy, sine_drive(50.0, 140.0, 0.08, FINE_TIME), FINE_TIME)
    stage = stages(states, heavy)[-2001:]
    entered = stage[np.flatnonzero(np.diff(stage)) + 1]
    assert {STAGES[i] for i in entered} == set(STAGES)
    compressed = int(np.argmax(stage == 0))
    assert stage[compressed:][stage[compressed:] != 0][0] == 1


def test_the_delivery_line_stays_laminar() -> None:
    states = run_stack(HEALTHY, DRIVE, FINE_TIME)
    assert 0.0 < line_reynolds_numbers(states, HEALTHY).max() < 2300.0


@pytest.mark.parametrize(("voltage", "bias"), [(160.0, None), (140.0, 60.0), (100.0, 110.0)])
def test_a_drive_that_the_stack_does_not_withstand_is_refused(voltage: float, bias: float | None) -> None:
    with pytest.raises(DriveError, match="the stack takes 0 to 150 V"):
        sine_drive(PEAK, voltage, 0.01, FINE_TIME, bias)


@pytest.mark.parametrize("frequency", [0.0, 451.0, np.nan])
def test_a_frequency_beyond_the_amplifier_is_refused(frequency: float) -> None:
    with pytest.raises(DriveError, match="at most 450 Hz"):
        sine_drive(frequency, 140.0, 0.01, FINE_TIME)


def test_sensor_noise_has_its_stated_deviation() -> None:
    sensors = StackSensors(stack_displacement_m=1e-7)
    record = simulate_stack(HEALTHY, DRIVE, FINE_TIME, sensors=sensors, rng=np.random.default_rng(1), keep_truth=True)
    noise = record["stack_displacement_m"] - record["true_stack_displacement_m"]
    assert np.std(noise) == pytest.approx(1e-7, rel=0.05)
    with pytest.raises(HydrostateError, match="needs rng"):
        simulate_stack(HEALTHY, DRIVE, FINE_TIME, sensors=sensors)
    assert simulate_stack(HEALTHY, DRIVE, FINE_TIME, sensors=IDEAL_SENSORS).metadata["plant"] == "piezo-stack"


@pytest.mark.parametrize(("name", "value"), [("piston_area", 0.0), ("air_fraction", -0.1), ("density", np.inf)])
def test_impossible_parameters_are_refused(name: str, value: float) -> None:
    with pytest.raises(RigError, match=f"{name} must"):
        PiezoStackParameters(**{name: value})


def test_a_mean_over_less_than_a_cycle_is_refused() -> None:
    with pytest.raises(DriveError, match=r"half the run must hold a whole cycle of 10.5 Hz, got 0\.05 s"):
        mean_flow(np.zeros(101), 1e-3, 10.5, 3e-4)
    assert mean_flow(1e-3 * np.arange(201.0), 1e-3, 10.0, 3e-4) == pytest.approx(3e-4)
