"""The fixed step follows scipy's tight-tolerance stiff solver, at second order, in every condition and drive."""

import numpy as np
import pytest
from numpy.typing import NDArray

from faults.conditions import CONDITIONS, parameters_for
from faults.physical import throttled
from plant.circuit import TYPICAL, circuit_derivative
from plant.circuit_parameters import CircuitParameters
from plant.integrate import compile_trajectory, parameter_row
from plant.reference_solver import Method, reference_trajectory
from plant.signals import DRIVES, make_drive
from plant.simulate import CIRCUIT

Array = NDArray[np.float64]
PAPER = CircuitParameters()
CHANNELS = ("motor_speed_rad_s", "position_m", "velocity_m_s", "differential_pressure_pa")


def fixed_step(p: CircuitParameters, speed: Array, substeps: int, sample_time: float = 1e-4) -> Array:
    run = compile_trajectory(CIRCUIT.name, CIRCUIT.step, 7, CircuitParameters)
    row = parameter_row(p)
    return run(CIRCUIT.start(row), speed, row[None], sample_time, substeps)


def reference(p: CircuitParameters, speed: Array, method: Method = "LSODA", tolerance: float = 1e-10) -> Array:
    start = CIRCUIT.start(parameter_row(p))
    return reference_trajectory(
        circuit_derivative, start, speed, p, 1e-4, scale=TYPICAL, relative_tolerance=tolerance, method=method
    )


def error(states: Array, truth: Array, p: CircuitParameters) -> float:
    """Largest relative RMS error over the channels that a bench logs."""
    rows = parameter_row(p)[None]
    found, wanted = CIRCUIT.channels(states, rows), CIRCUIT.channels(truth, rows)
    return max(float(np.sqrt(np.mean((found[n] - wanted[n]) ** 2) / np.mean(wanted[n] ** 2))) for n in CHANNELS)


def case(condition: str, name: str, seconds: float, **changes: float) -> tuple[CircuitParameters, Array]:
    p = parameters_for(CONDITIONS[condition], CircuitParameters(**changes))
    assert isinstance(p, CircuitParameters)
    return p, make_drive(name, seconds, 1e-4, p, np.random.default_rng(5))


@pytest.mark.parametrize("condition", ["normal", "major_leakage_minor_friction", "major_friction"])
@pytest.mark.parametrize("name", ["sine", "prbs"])
def test_ten_kilohertz_is_within_1e_4_of_the_stiff_solver(condition: str, name: str) -> None:
    p, speed = case(condition, name, 0.4)
    assert error(fixed_step(p, speed, CIRCUIT.substeps), reference(p, speed), p) < 5e-5


@pytest.mark.slow
@pytest.mark.parametrize("condition", CONDITIONS)
@pytest.mark.parametrize("name", DRIVES)
def test_ten_kilohertz_is_within_1e_4_of_the_stiff_solver_everywhere(condition: str, name: str) -> None:
    p, speed = case(condition, name, 4.0)
    assert error(fixed_step(p, speed, CIRCUIT.substeps), reference(p, speed, tolerance=1e-9), p) < 5e-5


@pytest.mark.parametrize("air", [0.02, 0.2])
def test_air_costs_no_accuracy(air: float) -> None:
    p, speed = case("minor_leakage", "prbs", 0.4, air_fraction=air)
    assert error(fixed_step(p, speed, CIRCUIT.substeps), reference(p, speed), p) < 5e-5


def test_cavitation_costs_little_accuracy() -> None:
    p, speed = case("minor_friction", "prbs", 0.4, makeup_conductance=0.0, accumulator_pressure=1.1e5)
    truth = reference(p, speed)
    assert np.min(CIRCUIT.channels(truth, parameter_row(p)[None])["pressure_b_pa"]) < 1.01 * p.vapour_pressure
    assert error(fixed_step(p, speed, CIRCUIT.substeps), truth, p) < 1e-3


def test_a_throttle_all_but_shut_is_followed_at_the_rate_it_asks() -> None:
    p = throttled(PAPER, 10.0, 5.0)
    speed = make_drive("prbs", 0.2, 1e-4, p, np.random.default_rng(5))
    substeps = int(np.ceil(1e-4 * CIRCUIT.step_rate(parameter_row(p)[None])))
    assert substeps > CIRCUIT.substeps
    assert error(fixed_step(p, speed, substeps), fixed_step(p, speed, 8 * substeps), p) < 1e-3


@pytest.mark.parametrize("name", ["sine", "prbs"])
def test_the_step_is_of_second_order(name: str) -> None:
    p, speed = case("normal", name, 0.5)
    truth = fixed_step(p, speed, 256)
    errors = [error(fixed_step(p, speed, substeps), truth, p) for substeps in (4, 8, 16, 32)]
    orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert np.mean(orders) == pytest.approx(2.0, abs=0.25)
