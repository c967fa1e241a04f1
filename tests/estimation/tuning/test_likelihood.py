"""Maximum-likelihood estimates are close to the true parameters, as close as their intervals say."""

from dataclasses import replace
from math import exp

import numpy as np
import pytest

from estimation.finding import NORMAL_95
from faults.conditions import CONDITIONS, parameters_for
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, simulate
from plant.errors import HydrostateError, LogError
from plant.log.record import Record
from plant.sensors.sensors import BENCH
from tests.estimation.tuning.likelihood_fit import FITTED, LikelihoodFit, fit_likelihood

WRONG = dict(zip(FITTED, (1.6, 0.5, 1.4, 0.7, 1.0, 1.3), strict=True))
"""Factors by which the first guesses are off."""

UNQUANTISED = replace(BENCH, position_noise=1e-6, position_quantum=0.0)


def log_of(parameters: EhaParameters, seed: int, drive: str = "steps", duration: float = 10.0) -> Record:
    rng = np.random.default_rng(seed)
    speed = make_drive(drive, duration, 1e-3, parameters, rng)
    return simulate(LUMPED, speed, 1e-3, parameters, sensors=UNQUANTISED, rng=rng)


def off(parameters: EhaParameters) -> EhaParameters:
    return replace(parameters, **{name: WRONG[name] * getattr(parameters, name) for name in FITTED})


def deviations(fit: LikelihoodFit, truth: EhaParameters) -> list[float]:
    return [(value - getattr(truth, name)) / std for name, (value, std) in fit.parameters.items()]


@pytest.mark.slow
@pytest.mark.parametrize("condition", ["normal", "major_leakage_minor_friction", "minor_leakage_major_friction"])
def test_condition_and_bulk_modulus_are_found_together_from_wrong_first_guesses(condition: str) -> None:
    truth = parameters_for(CONDITIONS[condition])
    fit = fit_likelihood(log_of(truth, 1), off(truth))
    assert fit.converged
    assert fit.parameters["bulk_modulus"][0] == pytest.approx(truth.bulk_modulus, rel=1e-3)
    assert fit.parameters["leakage_coefficient"][0] == pytest.approx(truth.leakage_coefficient, rel=1e-2, abs=0.0)
    assert max(map(abs, deviations(fit, truth))) < 4.0
    assert all(nis == pytest.approx(1.0, abs=0.05) for nis in fit.nis.values())


@pytest.mark.slow
def test_without_pressure_all_parameters_are_found_to_one_percent() -> None:
    truth = EhaParameters()
    fit = fit_likelihood(log_of(truth, 2).replace(differential_pressure_pa=None), off(truth))
    for name, (value, _) in fit.parameters.items():
        assert value == pytest.approx(getattr(truth, name), rel=1e-2), name


@pytest.mark.slow
def test_intervals_are_calibrated_over_seeds() -> None:
    truth = EhaParameters()
    found = np.array([deviations(fit_likelihood(log_of(truth, seed), truth), truth) for seed in range(10, 18)])
    assert 0.7 < np.sqrt(np.mean(found**2)) < 1.3
    assert np.mean(np.abs(found) < NORMAL_95) > 0.88


@pytest.mark.slow
def test_the_noise_levels_found_are_the_sensors_own() -> None:
    truth = EhaParameters()
    fit = fit_likelihood(log_of(truth, 3), truth, ["bulk_modulus"])
    assert fit.variances["velocity_m_s"] == pytest.approx(BENCH.velocity_noise**2, rel=0.05)
    assert fit.variances["differential_pressure_pa"] == pytest.approx(BENCH.pressure_noise**2, rel=0.05)
    speed = BENCH.speed_noise**2 * 1e-3 * (truth.pump_displacement * truth.bulk_modulus / truth.chamber_volume) ** 2
    assert 0.3 < fit.noise["differential_pressure_pa"] / speed < 3.0


@pytest.mark.slow
def test_a_parameter_fitted_alone_has_a_smaller_deviation_than_among_all() -> None:
    truth = EhaParameters()
    record = log_of(truth, 4)
    alone, among = fit_likelihood(record, truth, ["flow_bias"]), fit_likelihood(record, truth)
    assert list(alone.parameters) == ["flow_bias"]
    assert alone.parameters["flow_bias"][1] < among.parameters["flow_bias"][1]


def a_fit(**parameters: tuple[float, float]) -> LikelihoodFit:
    covariance = np.diag([0.01, 0.04])
    return LikelihoodFit(parameters, covariance, 4.0 * covariance, 1.0, {}, {}, {}, 0.0, True)


def test_intervals_are_symmetric_in_ratio_and_that_of_linear_friction_in_difference() -> None:
    fit = a_fit(bulk_modulus=(2e8, 4e7), friction_linear=(-100.0, 10.0))
    low, high = fit.interval("bulk_modulus")
    assert (high / 2e8, 2e8 / low) == pytest.approx([exp(0.2 * NORMAL_95)] * 2)
    assert fit.interval("friction_linear") == pytest.approx((-100.0 - 10.0 * NORMAL_95, -100.0 + 10.0 * NORMAL_95))
    assert fit.inflation == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("unknowns", "said"),
    [
        ([], "something must be unknown"),
        (["piston_area"], "an unknown must be one of bulk_modulus, .* got 'piston_area'"),
        (["flow_bias", "flow_bias"], "once, got 'flow_bias'"),
    ],
)
def test_unknowns_that_cannot_be_fitted_are_refused(unknowns: list[str], said: str) -> None:
    with pytest.raises(HydrostateError, match=said):
        fit_likelihood(Record(1e-3, {"position_m": np.zeros(9)}), EhaParameters(), unknowns)


def test_a_first_guess_of_zero_is_refused() -> None:
    record = Record(1e-3, {"motor_speed_rad_s": np.zeros(9), "position_m": np.zeros(9)})
    with pytest.raises(HydrostateError, match=r"the first guess of flow_bias must be positive, got 0\.0"):
        fit_likelihood(record, EhaParameters(flow_bias=0.0))


def test_a_log_without_motor_speed_is_refused() -> None:
    with pytest.raises(LogError, match="motor_speed_rad_s"):
        fit_likelihood(Record(1e-3, {"position_m": np.zeros(9)}), EhaParameters())
