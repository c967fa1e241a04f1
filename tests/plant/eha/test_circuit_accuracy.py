"""Error-controlled steps agree with scipy's stiff solver at a tight tolerance, in every condition and drive."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from benchmarks.peers.stiff_solvers import Method, reference_trajectory
from faults.conditions import CONDITIONS, parameters_for
from faults.eha.physical import with_throttles
from plant.arrays import Array
from plant.eha.circuit import circuit_derivative, circuit_scales
from plant.eha.circuit_parameters import CircuitParameters, circuit_of
from plant.eha.drives import DRIVES, make_drive
from plant.eha.simulate import CIRCUIT, run_plant
from plant.solvers.adaptive import controlled_run
from plant.solvers.steps import parameter_row
from plant.solvers.trajectory import compile_trajectory
from tests.thinned import thinned

PAPER = CircuitParameters()
CHANNELS = ("motor_speed_rad_s", "position_m", "velocity_m_s", "differential_pressure_pa")


def run(p: CircuitParameters, speed: Array, **options: float) -> Array:
    assert CIRCUIT.control is not None
    row = parameter_row(p)
    starts = CIRCUIT.start(row)[None]
    return controlled_run(
        "circuit", CIRCUIT.control, starts, speed, row[None, None], 1e-4, CircuitParameters, **options
    )[0]


def reference(p: CircuitParameters, speed: Array, method: Method = "LSODA", tolerance: float = 1e-10) -> Array:
    start = CIRCUIT.start(parameter_row(p))
    return reference_trajectory(
        circuit_derivative, start, speed, p, 1e-4, scale=circuit_scales(p), relative_tolerance=tolerance, method=method
    )


def error(states: Array, truth: Array, p: CircuitParameters) -> float:
    """Return the largest relative RMS error over the channels that a bench logs."""
    rows = parameter_row(p)[None]
    found, wanted = CIRCUIT.channels(states, rows), CIRCUIT.channels(truth, rows)
    return max(float(np.sqrt(np.mean((found[n] - wanted[n]) ** 2) / np.mean(wanted[n] ** 2))) for n in CHANNELS)


def case(condition: str, name: str, seconds: float, **changes: float) -> tuple[CircuitParameters, Array]:
    p = parameters_for(CONDITIONS[condition], CircuitParameters(**changes))
    assert isinstance(p, CircuitParameters)
    return p, make_drive(name, seconds, 1e-4, p, np.random.default_rng(5))


@pytest.mark.parametrize(
    ("condition", "name"),
    thinned(
        product(("normal", "major_leakage_minor_friction", "major_friction"), ("sine", "prbs")),
        [("normal", "sine"), ("major_leakage_minor_friction", "prbs"), ("major_friction", "prbs")],
    ),
)
def test_ten_kilohertz_is_within_1e_4_of_the_stiff_solver(condition: str, name: str) -> None:
    p, speed = case(condition, name, 0.4)
    assert error(run(p, speed), reference(p, speed), p) < 1e-4


@pytest.mark.slow
@pytest.mark.parametrize(
    ("condition", "name"),
    [(condition, "multisine") for condition in list(CONDITIONS)[::2]]
    + [("normal", name) for name in DRIVES if name != "multisine"],
)
def test_ten_kilohertz_is_within_1e_4_of_the_stiff_solver_for_seconds_of_every_drive(condition: str, name: str) -> None:
    p, speed = case(condition, name, 4.0)
    assert error(run(p, speed), reference(p, speed, tolerance=1e-9), p) < 1e-4


@pytest.mark.parametrize("air", [0.02, 0.2])
def test_air_costs_no_accuracy(air: float) -> None:
    p, speed = case("minor_leakage", "prbs", 0.4, air_fraction=air)
    assert error(run(p, speed), reference(p, speed), p) < 1e-4


def test_cavitation_costs_little_accuracy() -> None:
    p, speed = case("minor_friction", "prbs", 0.4, makeup_conductance=0.0, accumulator_pressure=1.1e5)
    truth = reference(p, speed)
    assert np.min(CIRCUIT.channels(truth, parameter_row(p)[None])["pressure_b_pa"]) < 1.01 * p.vapour_pressure
    assert error(run(p, speed), truth, p) < 1e-3


def test_an_almost_shut_throttle_costs_no_accuracy() -> None:
    p = with_throttles(PAPER, 10.0, 5.0)
    speed = make_drive("prbs", 0.2, 1e-4, p, np.random.default_rng(5))
    assert error(run(p, speed), run(p, speed, tolerance=1e-9), p) < 1e-4


def test_the_error_falls_with_the_tolerance() -> None:
    p, speed = case("normal", "prbs", 0.5)
    truth = run(p, speed, tolerance=1e-10)
    errors = [error(run(p, speed, tolerance=tolerance), truth, p) for tolerance in (1e-3, 1e-5, 1e-7)]
    assert errors[0] > 20.0 * errors[1]
    assert errors[1] > 20.0 * errors[2]
    assert errors[2] < 1e-6


def test_the_step_is_of_third_order_while_nothing_switches() -> None:
    p = replace(PAPER, friction_linear=0.0)
    row = parameter_row(p)
    settled = run(p, np.full(3_001, p.rated_speed))[-1]
    speed = p.rated_speed * (1.0 + 0.2 * np.sin(2.0 * np.pi * 50.0 * 1e-4 * np.arange(201)))
    control = CIRCUIT.control
    assert control is not None

    def steps_of(size: float) -> Array:
        found = controlled_run(
            "circuit",
            control,
            settled[None],
            speed,
            row[None, None],
            1e-4,
            CircuitParameters,
            tolerance=1e9,
            longest=size,
            drive_tolerance=0.0,
        )
        return found[0]

    truth = steps_of(1e-4 / 64)
    errors = [error(steps_of(1e-4 / n), truth, p) for n in (1, 2, 4, 8)]
    orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert np.mean(orders) == pytest.approx(3.0, abs=0.25)


@pytest.mark.parametrize("name", ["sine", "prbs"])
def test_the_step_is_at_least_of_second_order_with_switching_valves_and_friction(name: str) -> None:
    p, speed = case("normal", name, 0.5)
    fixed = {"tolerance": 1e9, "drive_tolerance": 0.0}
    truth = run(p, speed, longest=1e-4 / 128, **fixed)
    errors = [error(run(p, speed, longest=1e-4 / n, **fixed), truth, p) for n in (1, 2, 4, 8, 16)]
    orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert np.mean(orders) > 1.9


def test_the_independent_second_order_step_agrees() -> None:
    p, speed = case("minor_leakage", "chirp", 0.5)
    step = compile_trajectory(CIRCUIT.name, CIRCUIT.step, 7, CircuitParameters)
    row = parameter_row(p)
    other = step(CIRCUIT.start(row), speed, row[None], 1e-4, 32)
    assert error(run(p, speed), other, p) < 5e-5


def test_runs_side_by_side_agree_with_runs_alone() -> None:
    circuits = [circuit_of(parameters_for(condition, PAPER)) for condition in CONDITIONS.values()]
    speed = make_drive("steps", 0.5, 1e-4, PAPER, np.random.default_rng(5))
    together = run_plant(CIRCUIT, speed, 1e-4, np.array([parameter_row(p) for p in circuits])[None])
    assert together.shape == (len(circuits), len(speed), 7)
    for p, states in zip(circuits, together, strict=True):
        assert error(states, run(p, speed), p) < 1e-4


def test_a_coarse_log_agrees_with_every_tenth_sample_of_a_fine_run() -> None:
    p, knots = case("normal", "sine", 0.5)
    knots = knots[::10]
    fine = np.interp(np.arange(len(knots) * 10 - 9) / 10.0, np.arange(len(knots)), knots)
    row = parameter_row(p)
    coarse = run_plant(CIRCUIT, knots, 1e-3, row[None, None])[0]
    assert error(coarse, run(p, fine)[::10], p) < 1e-4
