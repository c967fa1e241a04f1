"""The contract of every plant of `PLANTS`."""

from dataclasses import asdict

import numpy as np
import pytest

from faults.conditions import CONDITIONS, Condition, parameters_for
from plant.eha.drives import sine
from plant.eha.model import EhaParameters
from plant.eha.parameter_path import ParameterPath
from plant.eha.simulate import PLANTS, Plant, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH

EVERY_PLANT = pytest.mark.parametrize("plant", PLANTS.values(), ids=PLANTS)
CHANNELS = ("motor_speed_rad_s", "position_m", "velocity_m_s", "differential_pressure_pa")
RIG = EhaParameters()
DRIVE = sine(0.5, 1e-3, RIG.rated_speed, 2.0)


def run(plant: Plant, drive: np.ndarray = DRIVE, parameters: EhaParameters | ParameterPath = RIG) -> Record:
    return simulate(plant, drive, 1e-3, parameters)


def test_plants_are_registered_under_their_names() -> None:
    assert [plant.name for plant in PLANTS.values()] == list(PLANTS)


@EVERY_PLANT
@pytest.mark.parametrize("condition", CONDITIONS.values(), ids=CONDITIONS)
def test_velocity_travel_and_pressure_are_plausible_in_every_condition(plant: Plant, condition: Condition) -> None:
    p = parameters_for(condition)
    record = run(plant, parameters=p)
    ideal = p.pump_displacement * p.rated_speed / p.piston_area
    assert 0.1 * ideal < np.max(np.abs(record["velocity_m_s"])) < 1.5 * ideal
    assert np.ptp(record["position_m"]) < ideal * 0.25
    assert np.max(np.abs(record["differential_pressure_pa"])) < 2.0 * p.relief_pressure


@EVERY_PLANT
def test_a_simulation_logs_all_bench_channels_on_the_clock_of_the_drive(plant: Plant) -> None:
    record = run(plant)
    assert set(CHANNELS) <= set(record)
    assert (len(record), record.sample_time) == (len(DRIVE), 1e-3)
    assert all(np.all(np.isfinite(record[name])) for name in record)
    assert record.metadata["plant"] == plant.name
    known = {name: value for name, value in asdict(RIG).items() if value is not None}
    assert known.items() <= dict(record.metadata["parameters"]).items()


@EVERY_PLANT
def test_an_actuator_without_drive_stays_at_rest(plant: Plant) -> None:
    record = run(plant, np.zeros(300))
    assert np.max(np.abs(record["velocity_m_s"])) <= 1e-12
    assert np.max(np.abs(record["position_m"])) <= 1e-12
    assert np.max(np.abs(record["differential_pressure_pa"])) <= 1e-6 * RIG.relief_pressure


@EVERY_PLANT
def test_a_reversed_drive_reverses_the_sign_of_every_channel(plant: Plant) -> None:
    forth, back = run(plant), run(plant, -DRIVE)
    for name in CHANNELS:
        np.testing.assert_allclose(back[name], -forth[name], atol=1e-6 * np.max(np.abs(forth[name])))


@EVERY_PLANT
def test_a_simulation_begins_at_rest(plant: Plant) -> None:
    record = run(plant)
    assert record["position_m"][0] == record["velocity_m_s"][0] == 0.0


@EVERY_PLANT
def test_velocity_is_the_rate_of_position(plant: Plant) -> None:
    record = simulate(plant, np.repeat(DRIVE, 10)[:2_000], 1e-4, RIG)
    moved = np.cumsum(0.5 * (record["velocity_m_s"][1:] + record["velocity_m_s"][:-1])) * 1e-4
    np.testing.assert_allclose(record["position_m"][1:], moved, atol=1e-3 * np.ptp(moved))


@EVERY_PLANT
def test_a_constant_parameter_path_gives_the_same_log_as_constant_parameters(plant: Plant) -> None:
    path = ParameterPath((0.0, 0.2), (RIG, RIG), "linear")
    constant, along = run(plant), run(plant, parameters=path)
    for name in constant:
        np.testing.assert_array_equal(along[name], constant[name])


@EVERY_PLANT
def test_the_same_seed_gives_the_same_log(plant: Plant) -> None:
    first, again = (simulate(plant, DRIVE, 1e-3, RIG, sensors=BENCH, rng=np.random.default_rng(3)) for _ in range(2))
    for name in first:
        np.testing.assert_array_equal(first[name], again[name])


@EVERY_PLANT
def test_state_names_are_unique_and_there_is_at_least_one_substep(plant: Plant) -> None:
    assert len(set(plant.states)) == len(plant.states)
    assert plant.substeps >= 1
