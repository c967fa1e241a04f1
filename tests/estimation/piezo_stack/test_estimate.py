"""Estimates from a log of the piezo-stack actuator, and their uncertainty."""

import warnings
from dataclasses import asdict, replace

import numpy as np
import pytest

from estimation.piezo_stack.estimate import covariance, estimate_stack, stack_bounds
from estimation.piezo_stack.unknowns import DEFAULT_UNKNOWNS, UNKNOWNS
from plant.errors import DriveError, HydrostateError, LogError
from plant.log.record import Record
from plant.piezo_stack.parameters import PiezoStackParameters
from plant.piezo_stack.run import BENCH_SENSORS, simulate_stack, sine_drive

HEALTHY = PiezoStackParameters(load_mass=10.0)
WORN = replace(
    HEALTHY,
    air_fraction=2.0 * HEALTHY.air_fraction,
    chamber_leakage=3e-12,
    crossport_leakage=3e-12,
    coulomb_friction=45.0,
)
SAMPLE_TIME = 5e-5
DRIVE = sine_drive(275.0, 140.0, 0.05, SAMPLE_TIME)


def log_of(p: PiezoStackParameters, seed: int) -> Record:
    return simulate_stack(p, DRIVE, SAMPLE_TIME, sensors=BENCH_SENSORS, rng=np.random.default_rng(seed))


@pytest.fixture(scope="module")
def worn() -> Record:
    return log_of(WORN, 3)


def test_air_leaks_and_friction_are_found_together_within_their_intervals(worn: Record) -> None:
    found = estimate_stack(worn, HEALTHY)
    for name, most in (
        ("air_fraction", 0.01),
        ("chamber_leakage", 0.1),
        ("crossport_leakage", 0.1),
        ("coulomb_friction", 0.05),
    ):
        truth = getattr(WORN, name)
        assert found.values[name] == pytest.approx(truth, rel=most, abs=0.0)
        assert abs(found.values[name] - truth) < 4.0 * found.deviations[name]
    assert max(found.misfit.values()) < 1.1
    bounds = stack_bounds(WORN, DRIVE, SAMPLE_TIME)
    friction = found.deviations["coulomb_friction"]
    assert friction == pytest.approx(bounds["coulomb_friction"], rel=0.25)


def test_an_actuator_with_another_delivery_length_leaves_a_misfit() -> None:
    longer = replace(HEALTHY, delivery_length=1.05 * HEALTHY.delivery_length)
    found = estimate_stack(log_of(longer, 4), HEALTHY, unknowns=("coulomb_friction",), starts=({},))
    assert max(found.misfit.values()) > 1.5


def test_position_alone_has_far_larger_bounds_than_stack_displacement() -> None:
    alone, stack = (
        stack_bounds(WORN, DRIVE, SAMPLE_TIME, channels=(channel,))
        for channel in ("position_m", "stack_displacement_m")
    )
    assert all(alone[name] > 10.0 * stack[name] for name in DEFAULT_UNKNOWNS)


def test_every_unknown_is_a_parameter_of_the_model() -> None:
    known = set(asdict(HEALTHY))
    assert all(set(unknown.names) <= known for unknown in UNKNOWNS.values())


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"drive_voltage_v": None}, "drive_voltage_v is needed"),
        ({"stack_displacement_m": np.append(np.nan, np.zeros(len(DRIVE) - 1))}, "must be whole, got 1 missing"),
        ({"position_m": np.repeat(np.arange(11.0), 91)}, "position_m holds one value for 4.55 ms: the sensor froze"),
    ],
)
def test_a_log_with_missing_or_frozen_channels_is_refused(
    worn: Record, change: dict[str, np.ndarray | None], said: str
) -> None:
    with pytest.raises(LogError, match=said):
        estimate_stack(worn.replace(**change), HEALTHY)


def test_noisier_sensors_with_offsets_give_the_same_values_with_larger_deviations(worn: Record) -> None:
    zeros = {"stack_displacement_m": 3e-4, "stack_force_n": -800.0, "position_m": 0.05}
    rng = np.random.default_rng(5)
    noise = {name: 3.0 * value for name, value in asdict(BENCH_SENSORS).items()}
    seen = {
        name: worn[name] + zeros.get(name, 0.0) + rng.normal(0.0, deviation, len(DRIVE))
        for name, deviation in noise.items()
    }
    found, before = (estimate_stack(log, HEALTHY) for log in (worn.replace(**seen), worn))
    assert max(found.misfit.values()) < 1.1
    for name in ("air_fraction", "chamber_leakage", "crossport_leakage", "coulomb_friction"):
        assert abs(found.values[name] - getattr(WORN, name)) < 3.0 * found.deviations[name]
        assert found.deviations[name] == pytest.approx(10.0**0.5 * before.deviations[name], rel=0.2, abs=0.0)


def test_a_measured_drive_may_exceed_the_range_of_the_stack_by_its_noise(worn: Record) -> None:
    found = estimate_stack(worn.replace(drive_voltage_v=DRIVE - 0.02), HEALTHY)
    assert found.values["coulomb_friction"] == pytest.approx(WORN.coulomb_friction, rel=0.05)
    with pytest.raises(DriveError, match="the stack takes 0 to 150 V, got a drive from -4 to 136 V"):
        estimate_stack(worn.replace(drive_voltage_v=DRIVE - 4.0), HEALTHY)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"position_m": 1e3}, "position_m is in mm"),
        ({"stack_force_n": -1e-3}, "stack_force_n has the opposite sign and is in kN"),
        (
            {"chamber_pressure_pa": 1e-5, "position_m": -1.0},
            "position_m has the opposite sign; chamber_pressure_pa is in",
        ),
    ],
)
def test_a_channel_of_another_sign_or_unit_is_named(worn: Record, change: dict[str, float], said: str) -> None:
    with pytest.raises(LogError, match=said):
        estimate_stack(worn.replace(**{name: factor * worn[name] for name, factor in change.items()}), HEALTHY)


def test_an_unknown_that_is_no_parameter_is_refused(worn: Record) -> None:
    with pytest.raises(HydrostateError, match="an unknown must be one of"):
        estimate_stack(worn, HEALTHY, unknowns=("colour",))


def test_a_parameter_that_no_channel_shows_has_a_huge_deviation() -> None:
    slopes = np.random.default_rng(3).standard_normal((50, 3)) * [1.0, 1e-3, 0.0]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        deviations = np.sqrt(np.diag(covariance(slopes)))
    np.testing.assert_allclose(deviations[:2], np.sqrt(np.diag(np.linalg.inv(slopes[:, :2].T @ slopes[:, :2]))))
    assert deviations[2] > 1e12
