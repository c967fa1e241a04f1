"""Tests of the random, realistic rigs."""

from math import pi

import numpy as np
import pytest

from benchmarks.diagnosis.rig_draws import UNCERTAIN_ENTRIES, Bench, draw_bench, draw_rig, wrong_rig_file
from faults.conditions import CONDITIONS
from plant.eha.circuit_parameters import CircuitParameters
from plant.eha.model import EhaParameters
from plant.eha.scales import natural_frequency
from plant.eha.steady_state import steady_state


@pytest.fixture(scope="module")
def bench() -> Bench:
    return draw_bench(1010)


@pytest.fixture(scope="module")
def rigs() -> list[CircuitParameters]:
    rng = np.random.default_rng(4)
    return [draw_rig(rng) for _ in range(300)]


def velocity_of(p: CircuitParameters) -> float:
    return p.pump_displacement * p.rated_speed / p.piston_area


def test_a_seed_determines_the_rig_and_its_log(bench: Bench) -> None:
    again, other = draw_bench(1010), draw_bench(1016)
    assert again.true == bench.true
    assert np.array_equal(again.record["position_m"], bench.record["position_m"])
    assert other.true.piston_area != bench.true.piston_area


def test_drawn_rigs_fill_the_ranges_of_built_actuators(rigs: list[CircuitParameters]) -> None:
    ranges = {
        "piston area [cm2]": ([1e4 * p.piston_area for p in rigs], 3.0, 80.0),
        "velocity [m/s]": ([velocity_of(p) for p in rigs], 0.03, 0.4),
        "displacement a turn [cm3]": ([2e6 * pi * p.pump_displacement for p in rigs], 0.1, 200.0),
        "relief pressure [bar]": ([1e-5 * p.relief_pressure for p in rigs], 35.0, 250.0),
        "natural frequency [Hz]": ([natural_frequency(p) for p in rigs], 15.0, 350.0),
        "motor lag [ms]": ([1e3 * p.motor_lag for p in rigs], 3.0, 20.0),
    }
    for name, (values, least, most) in ranges.items():
        assert least <= min(values), name
        assert max(values) <= most, name
        assert max(values) / min(values) > 0.5 * most / least or "turn" in name, name


def test_a_healthy_rig_moves_at_nearly_its_rated_velocity_with_pressure_to_spare(rigs: list[CircuitParameters]) -> None:
    for p in rigs:
        velocity, pressure = steady_state(p.rated_speed, p)
        assert 0.9 < velocity / velocity_of(p) < 1.0
        assert pressure < 0.35 * p.relief_pressure


def test_the_right_rig_file_has_the_true_sizes_but_not_the_circuit_or_the_true_bulk_modulus(bench: Bench) -> None:
    assert type(bench.healthy) is EhaParameters
    assert bench.condition in CONDITIONS
    for name in ("piston_area", "pump_displacement", "chamber_volume", "moving_mass"):
        assert getattr(bench.healthy, name) == getattr(bench.true, name)
    assert bench.healthy.bulk_modulus != bench.true.bulk_modulus


def test_a_wrong_rig_file_has_an_error_of_the_usual_size_in_each_size_entry() -> None:
    right = EhaParameters()
    files = [wrong_rig_file(right, seed) for seed in range(400)]
    off = np.array(
        [[np.log(getattr(file, name) / getattr(right, name)) for name in UNCERTAIN_ENTRIES] for file in files]
    )
    assert np.all(off != 0.0)
    assert np.std(off, axis=0) == pytest.approx([0.03, 0.02, 0.15, 0.1], rel=0.1)
    assert {file.leakage_coefficient for file in files} == {right.leakage_coefficient}
