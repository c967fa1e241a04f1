"""Noise levels are recovered from the log; the published ones are reported beside them and are less likely."""

import numpy as np
import pytest

from estimation.filters.ekf import ekf
from estimation.filters.run import run_filter
from estimation.log_checks.first_belief import PRESSURE_NOISE_LOGGED, first_belief
from estimation.models.eha_forms import BULK_MODULUS, PRESSURE_FORM
from estimation.tuning.scoring import Coordinate
from estimation.tuning.tuning import Tuning, speed_noise, tune
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH

RIG = EhaParameters()


def log_of(sample_time: float, duration: float) -> Record:
    rng = np.random.default_rng(4)
    speed = make_drive("steps", duration, sample_time, RIG, rng)
    return simulate(LUMPED, speed, sample_time, RIG, sensors=BENCH, rng=rng)


def tuned(record: Record) -> Tuning:
    prior = first_belief(PRESSURE_FORM, record, 2e8, 1e8)
    return tune(record, PRESSURE_FORM, prior, RIG, noise={"differential_pressure_pa": PRESSURE_NOISE_LOGGED})


@pytest.fixture(scope="module")
def record() -> Record:
    return log_of(1e-3, 10.0)


@pytest.fixture(scope="module")
def tuning(record: Record) -> Tuning:
    return tuned(record)


def test_the_tuned_variances_are_those_of_the_sensors(tuning: Tuning) -> None:
    found = tuning.tuned.variances
    assert tuning.converged
    assert found["velocity_m_s"] == pytest.approx(BENCH.velocity_noise**2, rel=0.05)
    assert found["differential_pressure_pa"] == pytest.approx(BENCH.pressure_noise**2, rel=0.05)
    assert found["position_m"] == pytest.approx(BENCH.position_quantum**2 / 12.0, rel=0.3, abs=0.0)


def test_tuned_process_noise_is_that_of_the_measured_motor_speed(tuning: Tuning) -> None:
    speed = BENCH.speed_noise**2 * 1e-3 * (RIG.pump_displacement * RIG.bulk_modulus / RIG.chamber_volume) ** 2
    assert 0.2 < tuning.tuned.noise["differential_pressure_pa"] / speed < 5.0
    assert tuning.given.noise["differential_pressure_pa"] == pytest.approx(PRESSURE_NOISE_LOGGED)


def test_a_constant_state_stays_constant(tuning: Tuning) -> None:
    assert tuning.tuned.noise[BULK_MODULUS] == 0.0
    assert tuning.published.noise[BULK_MODULUS] == pytest.approx(1e-8)  # equation 7.6 over 0.1 ms, errata E10


def test_the_published_noise_levels_are_reported_and_less_likely_than_the_tuned_ones(tuning: Tuning) -> None:
    assert tuning.published.variances["velocity_m_s"] == 1e-4
    assert tuning.published.noise["position_m"] == pytest.approx(1e-8)
    assert tuning.tuned.log_likelihood > tuning.given.log_likelihood > tuning.published.log_likelihood
    assert tuning.published.nis["velocity_m_s"] < 0.1  # errata E11: larger than the sensors deserve
    assert all(nis == pytest.approx(1.0, abs=0.1) for nis in tuning.tuned.nis.values())


def test_a_noise_level_that_the_log_does_not_determine_has_a_large_spread(tuning: Tuning) -> None:
    assert tuning.spread["sensor velocity_m_s"] < 0.05
    assert tuning.spread["position_m"] > 1.0


def test_a_filter_with_the_tuned_noise_reproduces_the_reported_likelihood_and_nis(
    tuning: Tuning, record: Record
) -> None:
    found = tuning.tuned
    again = run_filter(ekf, PRESSURE_FORM, tuning.prior, record, RIG, noise=found.noise, variances=found.variances)
    assert again.log_likelihood == pytest.approx(found.log_likelihood, rel=1e-9)
    assert again.nis == pytest.approx(dict(found.nis), rel=1e-9)
    assert again.settled(BULK_MODULUS)[0] == pytest.approx(RIG.bulk_modulus, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("sample_time", "duration"), [(1e-3, 20.0), (1e-4, 10.0)])
def test_long_logs_and_10_khz_logs_are_tuned_to_the_sensors_noise(sample_time: float, duration: float) -> None:
    log = log_of(sample_time, duration)
    tuning = tuned(log)
    chance = (2.0 / len(log)) ** 0.5  # relative deviation of a variance from this number of samples
    assert tuning.tuned.variances["velocity_m_s"] == pytest.approx(BENCH.velocity_noise**2, rel=4.0 * chance)
    assert all(nis == pytest.approx(1.0, abs=0.1) for nis in tuning.tuned.nis.values())


@pytest.mark.slow
@pytest.mark.parametrize("first_guess", [1e8, 3e8])
def test_without_pressure_a_far_first_guess_is_tuned_to_the_same_levels(record: Record, first_guess: float) -> None:
    """Certainty is increased step by step: a filter that was certain at once would lock onto a wrong bulk modulus."""
    prior = first_belief(PRESSURE_FORM, record, first_guess, 3e8)
    tuning = tune(record, PRESSURE_FORM, prior, RIG, channels=("position_m", "velocity_m_s"))
    found = tuning.prior.mean[PRESSURE_FORM.index(BULK_MODULUS)]
    assert found == pytest.approx(RIG.bulk_modulus, rel=1e-3)
    assert tuning.tuned.variances["velocity_m_s"] == pytest.approx(BENCH.velocity_noise**2, rel=0.05)
    assert tuning.tuned.noise["velocity_m_s"] < 1e-3 * PRESSURE_FORM.states[1].noise_density


def test_a_coordinate_stays_above_its_floor_and_is_linear_with_a_given_scale() -> None:
    log_like = Coordinate("r0", 0, 3.0, floor=1.0)
    assert log_like.value(-40.0)[0] == pytest.approx(1.0)
    assert log_like.value(np.log(2.0)) == pytest.approx((5.0, 4.0))
    assert Coordinate("friction_linear", 0, -2.0, scale=10.0).value(0.5) == pytest.approx((3.0, 10.0))


def test_speed_noise_makes_the_pressure_variance_grow_as_equation_5_8_predicts() -> None:
    p, T, deviation = EhaParameters(), 1e-3, 0.5
    noise = deviation * np.random.default_rng(0).standard_normal((1000, 400))  # runs of 400 samples
    record = Record(T, {"motor_speed_rad_s": noise[0], "position_m": np.zeros(400)})
    # the piston is blocked
    pressure = np.cumsum(p.bulk_modulus / p.chamber_volume * p.pump_displacement * noise * T, axis=1)
    density = speed_noise(record, p, deviation**2)
    assert np.var(pressure[:, -1]) == pytest.approx(density * 400 * T, rel=0.15)
    assert speed_noise(record, p) == pytest.approx(density, rel=0.2)  # estimated from the log
