"""`simulate` gives the same record for the same seed, shows faults from their time on, and states what it cannot do."""

from dataclasses import asdict, replace

import numpy as np
import pytest

from faults.conditions import CONDITIONS, parameters_for
from faults.eha.inject import abrupt_fault, growing_fault
from plant.eha.drives import sine
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, REDUCED, simulate
from plant.errors import DriveError, HydrostateError
from plant.sensors.sensors import BENCH, IDEAL

RIG = EhaParameters()
LEAKING = parameters_for(CONDITIONS["major_leakage"])
DRIVE = sine(1.0, 1e-3, RIG.rated_speed, 2.0)
CONSTANT = np.full(3_001, RIG.rated_speed)


def test_the_seed_determines_the_record() -> None:
    first, again, other = (
        simulate(LUMPED, DRIVE, 1e-3, RIG, sensors=BENCH, rng=np.random.default_rng(seed)) for seed in (7, 7, 8)
    )
    for name in first:
        np.testing.assert_array_equal(first[name], again[name])
    for name in ("motor_speed_rad_s", "velocity_m_s", "differential_pressure_pa"):
        assert not np.array_equal(first[name], other[name])


def test_the_noise_does_not_touch_the_truth() -> None:
    clean = simulate(LUMPED, DRIVE, 1e-3, RIG)
    noisy = simulate(LUMPED, DRIVE, 1e-3, RIG, sensors=BENCH, rng=np.random.default_rng(1), keep_truth=True)
    for name in clean:
        np.testing.assert_array_equal(noisy[f"true_{name}"], clean[name])


def test_truth_is_kept_when_asked_for_and_only_then() -> None:
    rng = np.random.default_rng(1)
    assert not any(name.startswith("true_") for name in simulate(LUMPED, DRIVE, 1e-3, RIG, sensors=BENCH, rng=rng))
    ideal = simulate(LUMPED, DRIVE, 1e-3, RIG, keep_truth=True)
    np.testing.assert_array_equal(ideal["true_position_m"], ideal["position_m"])


def test_the_record_states_its_plant_parameters_and_sensors() -> None:
    record = simulate(REDUCED, DRIVE, 1e-3, LEAKING, sensors=BENCH, rng=np.random.default_rng(1))
    assert record.metadata["plant"] == "reduced"
    assert record.metadata["parameters"] == asdict(LEAKING)
    assert record.metadata["sensors"] == asdict(BENCH)
    assert (record.sample_time, len(record)) == (1e-3, len(DRIVE))


def test_an_abrupt_leak_changes_the_record_only_from_its_start() -> None:
    record = simulate(LUMPED, CONSTANT, 1e-3, abrupt_fault(RIG, LEAKING, at=1.5))
    healthy, leaking = (simulate(LUMPED, CONSTANT, 1e-3, p)["velocity_m_s"][-1] for p in (RIG, LEAKING))
    velocity = record["velocity_m_s"]
    np.testing.assert_array_equal(velocity[:1_501], simulate(LUMPED, CONSTANT, 1e-3, RIG)["velocity_m_s"][:1_501])
    assert velocity[1_500] == pytest.approx(healthy, rel=1e-3)
    assert velocity[-1] == pytest.approx(leaking, rel=1e-3)
    assert leaking < 0.6 * healthy


def test_a_growing_leak_slows_the_piston_steadily() -> None:
    velocity = simulate(LUMPED, CONSTANT, 1e-3, growing_fault(RIG, LEAKING, start=1.0, end=2.8))["velocity_m_s"]
    during = velocity[1_000:2_800:100]
    assert np.all(np.diff(during) < 0.0)
    steps = np.diff(during)[2:]
    np.testing.assert_allclose(steps, np.mean(steps), rtol=0.3)


def test_the_reduced_plant_reports_the_pressure_of_its_force_balance() -> None:
    settled = simulate(REDUCED, np.full(2_001, RIG.rated_speed), 1e-3, RIG)
    wanted = simulate(LUMPED, np.full(2_001, RIG.rated_speed), 1e-3, RIG)
    for name in ("velocity_m_s", "differential_pressure_pa"):
        assert settled[name][-1] == pytest.approx(wanted[name][-1], rel=1e-4)


def test_the_motion_does_not_depend_on_the_sample_time() -> None:
    coarse = simulate(LUMPED, DRIVE, 1e-3, RIG)
    dense = np.interp(0.1 * np.arange(9_991), np.arange(1_000), DRIVE)
    fine = simulate(LUMPED, dense, 1e-4, RIG)
    for name in coarse:
        peak = np.max(np.abs(coarse[name]))
        np.testing.assert_allclose(fine[name][::10], coarse[name], atol=1e-5 * peak)


def test_simulate_does_not_modify_the_drive() -> None:
    drive = DRIVE.copy()
    simulate(LUMPED, drive, 1e-3, RIG, sensors=BENCH, rng=np.random.default_rng(1))
    np.testing.assert_array_equal(drive, DRIVE)
    assert drive.flags.writeable


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_drive_that_is_not_finite_is_refused_with_its_sample(value: float) -> None:
    drive = DRIVE.copy()
    drive[3] = value
    with pytest.raises(DriveError, match=f"a drive must be finite, got {value} at sample 3"):
        simulate(LUMPED, drive, 1e-3, RIG)


@pytest.mark.parametrize("drive", [np.zeros(1), np.zeros(0), np.zeros((5, 2))])
def test_a_drive_without_two_samples_is_refused(drive: np.ndarray) -> None:
    with pytest.raises(DriveError, match="a series of at least 2 samples, got shape"):
        simulate(LUMPED, drive, 1e-3, RIG)


def test_noisy_sensors_without_a_generator_are_refused() -> None:
    with pytest.raises(HydrostateError, match="needs rng for sensors with noise"):
        simulate(LUMPED, DRIVE, 1e-3, RIG, sensors=replace(IDEAL, speed_noise=0.1))


def test_a_plant_that_stops_being_finite_says_when() -> None:
    with pytest.raises(HydrostateError, match=r"the reduced plant stopped being finite at 0\.0010 s"):
        simulate(REDUCED, np.full(10, 1e300), 1e-3, RIG)
