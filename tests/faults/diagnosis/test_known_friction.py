"""Friction from the force balance, on records that are made from Newton's second law alone."""

from dataclasses import replace

import numpy as np
import pytest

from faults.diagnosis.circuits.actuator import actuator_of
from faults.diagnosis.known_friction import FEWEST, friction_by_forces
from faults.diagnosis.severity import severities
from plant.eha.model import EhaParameters
from plant.log.record import Record
from tests.faults.diagnosis.test_severity import ACTUATOR, NARROW, extent, fits

RIG = EhaParameters()
RATED = actuator_of(RIG).rated
REST, BENT, WHOLE = 480.0, 900.0, 2300.0
STEP = 1e-3


def record(
    seed: int = 0,
    *,
    mass: float = RIG.moving_mass,
    load: float = 0.0,
    by_place: float = 0.0,
    rings: float = 0.0,
    quantum: float = 1e-6,
    step: float = STEP,
) -> Record:
    """Return a piston under two sines of at most rated velocity and a ringing, with the noise of a bench."""
    rng, time = np.random.default_rng(seed), np.arange(0.0, 6.0, step)
    pace = np.array([0.7, 2.0, 55.0]) * 2.0 * np.pi
    sizes = np.array([0.5 * RATED, 0.5 * RATED, rings]) / pace
    position = sizes @ (1.0 - np.cos(np.outer(pace, time)))
    velocity = (sizes * pace) @ np.sin(np.outer(pace, time))
    acceleration = (sizes * pace**2) @ np.cos(np.outer(pace, time))
    speed = np.abs(velocity) / RATED
    friction = REST + (WHOLE - REST - BENT) * speed + BENT * speed**2
    friction *= 1.0 + by_place * np.sin(2.0 * np.pi * position / 0.02)
    force = mass * acceleration + np.sign(velocity) * friction + load
    noise = rng.standard_normal(len(time))
    channels = {
        "position_m": np.round(position / quantum) * quantum,
        "differential_pressure_pa": force / RIG.piston_area + 5e3 * noise,
    }
    return Record(step, channels)


@pytest.mark.parametrize("load", [0.0, 200.0])
def test_the_stated_deviation_of_friction_at_rated_velocity_matches_its_errors(load: float) -> None:
    found = [friction_by_forces(record(seed, load=load), RIG, RATED) for seed in range(40)]
    z = [(one.forces[2] - WHOLE) / one.covariance[2, 2] ** 0.5 for one in found if one is not None]
    assert len(z) == len(found)
    assert 0.7 < np.sqrt(np.mean(np.square(z))) < 1.25
    assert all(one is not None and one.covariance[2, 2] ** 0.5 < 5.0 for one in found)


def test_ringing_and_a_coarse_encoder_do_not_bias_friction() -> None:
    """At 55 Hz, a straight line over 2 ms lost 2 % of the velocity, and noise from rounding was taken for velocity."""
    found = [friction_by_forces(record(seed, rings=6e-3, quantum=3e-6, step=1e-4), RIG, RATED) for seed in range(6)]
    off = np.mean([one.forces - (REST, BENT, WHOLE) for one in found if one is not None], axis=0)
    left = np.mean([np.diag(one.covariance) for one in found if one is not None], axis=0) ** 0.5
    assert all(found)
    assert np.all(np.abs(off) < 1.3 * left)  # three standard deviations of a mean of six logs


def test_a_moving_mass_off_by_a_tenth_does_not_bias_friction() -> None:
    found = friction_by_forces(record(mass=1.1 * RIG.moving_mass), RIG, RATED)
    assert found is not None
    assert abs(found.forces[2] - WHOLE) < 3.0 * found.covariance[2, 2] ** 0.5


def test_residuals_that_last_widen_the_deviations_by_more_than_their_size() -> None:
    """Friction that varies along the stroke doubles the residuals' power, and lasts for many windows."""
    even, uneven = (friction_by_forces(record(by_place=by_place), RIG, RATED) for by_place in (0.0, 0.003))
    assert even is not None
    assert uneven is not None
    assert np.all(np.diag(uneven.covariance) > 3.5 * np.diag(even.covariance))


def test_an_unknown_shape_of_the_friction_law_widens_the_covariance() -> None:
    found = friction_by_forces(record(), RIG, RATED)
    assert found is not None
    assert np.all(np.diag(found.bent_covariance) > np.diag(found.covariance))


def test_no_friction_is_returned_if_the_law_fails_or_the_log_does_not_show_it() -> None:
    one = record()
    for other in (
        record(by_place=0.2),
        Record(STEP, {"position_m": one["position_m"]}),
        Record(STEP, {**one.channels, "position_m": 1e-3 * one["position_m"]}),
        Record(STEP, {name: one[name][: FEWEST * 20] for name in one.channels}),
        Record(10.0 * STEP, {name: one[name][::10] for name in one.channels}),
    ):
        assert friction_by_forces(other, RIG, RATED) is None
    assert friction_by_forces(one, replace(RIG, area_difference=0.1), RATED) is None


@pytest.mark.parametrize(("step", "told"), [(2e3, True), (2e4, False)])
def test_no_friction_is_returned_if_pressure_is_rounded_more_coarsely_than_its_noise(step: float, told: bool) -> None:
    one = record()
    rounded = np.round(one["differential_pressure_pa"] / step) * step
    found = friction_by_forces(Record(STEP, {**one.channels, "differential_pressure_pa": rounded}), RIG, RATED)
    assert (found is not None) is told


@pytest.mark.parametrize("channel", ["differential_pressure_pa", "position_m"])
def test_missing_samples_are_left_out(channel: str) -> None:
    one, whole = record(), friction_by_forces(record(), RIG, RATED)
    holed = np.where(np.arange(len(one)) % 500 < 100, np.nan, one[channel])
    found = friction_by_forces(Record(STEP, {**one.channels, channel: holed}), RIG, RATED)
    assert whole is not None
    assert found is not None
    assert found.forces[2] == pytest.approx(whole.forces[2], abs=5.0 * found.covariance[2, 2] ** 0.5)
    assert found.covariance[2, 2] > whole.covariance[2, 2]


def test_severities_use_the_friction_of_the_force_balance_and_keep_leakage() -> None:
    known = friction_by_forces(record(), RIG, RATED)
    circuit, told = severities(fits(NARROW), ACTUATOR), severities(fits(NARROW), ACTUATOR, rubbing=known)
    assert known is not None
    healthy = RIG.friction_coulomb + RIG.friction_linear * RATED + RIG.friction_quadratic * RATED**2
    assert told["added_friction"].value == pytest.approx(known.forces[2] - healthy)
    assert extent(told["added_friction"]) == pytest.approx(2.0 * 1.96 * known.covariance[2, 2] ** 0.5, rel=0.1)
    assert (
        severities(fits(NARROW), ACTUATOR, {"added_friction": 2.0}, rubbing=known)["added_friction"]
        == told["added_friction"]
    )  # calibration factors were fitted to circuits, and do not apply
    assert told["leakage_flow"] == circuit["leakage_flow"]
