"""The circuit through `simulate`: its channels, its sensors, faults that begin during the run, and why it stops."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from faults.conditions import CONDITIONS, parameters_for
from faults.eha.inject import abrupt_fault, growing_fault
from faults.eha.physical import with_throttles
from plant.eha.circuit import circuit_breaches
from plant.eha.circuit_parameters import CircuitParameters
from plant.eha.circuit_start import at_rest
from plant.eha.drives import sine
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, LUMPED, PLANTS, simulate
from plant.errors import HydrostateError
from plant.sensors.sensors import BENCH, PAPER

RIG = CircuitParameters(stroke=0.4)
DRIVE = sine(0.5, 1e-3, RIG.rated_speed, 2.0)
CONSTANT = np.full(3_001, RIG.rated_speed)


def test_the_circuit_is_among_the_plants() -> None:
    assert PLANTS["circuit"] is CIRCUIT


def test_the_circuit_also_logs_chamber_pressures_and_motor_voltage() -> None:
    record = simulate(CIRCUIT, DRIVE, 1e-3, RIG)
    assert set(record) == {*simulate(LUMPED, DRIVE, 1e-3, RIG), "pressure_a_pa", "pressure_b_pa", "motor_voltage_v"}
    difference = record["pressure_a_pa"] - record["pressure_b_pa"]
    np.testing.assert_array_equal(record["differential_pressure_pa"], difference)
    np.testing.assert_allclose(record["motor_voltage_v"] * RIG.motor_speed_per_volt, DRIVE, rtol=1e-12)


def test_the_motor_lags_its_command() -> None:
    record = simulate(CIRCUIT, CONSTANT, 1e-4, RIG)
    reached = record["motor_speed_rad_s"] / RIG.rated_speed
    assert reached[20] == pytest.approx(1.0 - np.exp(-1.0), rel=1e-3)
    assert reached[-1] == pytest.approx(1.0, rel=1e-9)


def test_an_actuator_without_a_circuit_runs_with_the_papers_circuit() -> None:
    plain, whole = (simulate(CIRCUIT, DRIVE, 1e-3, p) for p in (EhaParameters(stroke=0.4), RIG))
    for name in whole:
        np.testing.assert_array_equal(plain[name], whole[name])


def test_chamber_pressure_sensors_add_noise_without_changing_that_of_other_channels() -> None:
    clean = simulate(CIRCUIT, DRIVE, 1e-3, RIG)
    noisy = simulate(CIRCUIT, DRIVE, 1e-3, RIG, sensors=BENCH, rng=np.random.default_rng(4), keep_truth=True)
    for name in ("pressure_a_pa", "pressure_b_pa"):
        error = noisy[name] - clean[name]
        assert np.std(error) == pytest.approx(BENCH.pressure_noise, rel=0.15)
        np.testing.assert_allclose(noisy[name] / BENCH.pressure_quantum % 1.0, 0.0, atol=1e-9)
    np.testing.assert_array_equal(noisy["motor_voltage_v"], clean["motor_voltage_v"])
    lumped = [
        simulate(LUMPED, DRIVE, 1e-3, RIG, sensors=BENCH, rng=np.random.default_rng(4)),
        simulate(LUMPED, DRIVE, 1e-3, RIG),
    ]
    velocity_noise = lumped[0]["velocity_m_s"] - lumped[1]["velocity_m_s"]
    np.testing.assert_allclose(noisy["velocity_m_s"] - clean["velocity_m_s"], velocity_noise, atol=1e-12)


def test_sensors_without_pressure_log_no_pressure_channel() -> None:
    record = simulate(CIRCUIT, DRIVE, 1e-3, RIG, sensors=PAPER, rng=np.random.default_rng(1))
    assert not [name for name in record if "pressure" in name]


def test_an_abrupt_leak_slows_the_piston() -> None:
    leaking = parameters_for(CONDITIONS["major_leakage"], RIG)
    velocity = simulate(CIRCUIT, CONSTANT, 1e-3, abrupt_fault(RIG, leaking, at=1.5))["velocity_m_s"]
    healthy = simulate(CIRCUIT, CONSTANT, 1e-3, RIG)["velocity_m_s"]
    np.testing.assert_allclose(velocity[:1_501], healthy[:1_501], rtol=0.0, atol=1e-6 * np.max(healthy))
    assert velocity[-1] < 0.6 * healthy[-1]


def test_growing_leakage_slows_the_piston_continuously() -> None:
    leaking = parameters_for(CONDITIONS["major_leakage"], RIG)
    velocity = simulate(CIRCUIT, CONSTANT, 1e-3, growing_fault(RIG, leaking, 1.0, 3.0))["velocity_m_s"]
    assert np.all(np.diff(velocity[1_200:2_900:100]) < 0.0)


def test_an_almost_shut_throttle_is_simulated_without_instability() -> None:
    p = with_throttles(RIG, 10.0, 6.0)
    record = simulate(CIRCUIT, np.full(300, p.rated_speed), 1e-3, p)
    assert np.max(np.abs(record["velocity_m_s"])) < 2e-3


def test_a_run_that_leaves_the_models_range_reports_time_and_reason() -> None:
    def late(states: NDArray[np.float64]) -> Mapping[str, NDArray[np.bool_]]:
        return {name: np.arange(len(states)) >= 20 for name in circuit_breaches(states)}

    with pytest.raises(HydrostateError, match=r"the circuit plant stopped at 0\.0200 s: a chamber ran out of oil"):
        simulate(replace(CIRCUIT, breaches=late), DRIVE, 1e-3, RIG)


def test_a_chamber_or_accumulator_without_oil_is_a_breach() -> None:
    states = np.tile(np.array(at_rest(RIG), dtype=np.float64), (3, 1))
    states[1, 5], states[2, 6] = 0.0, -1e-9
    chamber, accumulator = circuit_breaches(states).values()
    assert chamber.tolist() == [False, True, False]
    assert accumulator.tolist() == [False, False, True]
