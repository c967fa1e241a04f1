"""On a linear model, the extended Kalman filter is the Kalman filter; missing samples change nothing."""

import numpy as np
import pytest

from estimation.filters.ekf import ekf
from estimation.filters.run import Estimate, run_filter
from estimation.models.gaussian import Gaussian
from estimation.models.model import ProcessModel
from plant.arrays import Array
from plant.eha.model import EhaParameters
from plant.log.record import Record

SAMPLE_TIME, SUBSTEPS = 0.25, 1000
VARIANCES = {"position_m": 1e-6, "velocity_m_s": 1e-4}
PRIOR = Gaussian(np.array([0.1, -0.2, 0.5]), np.diag([1e-4, 1e-2, 1.0]))


def noisy_record(samples: int = 60) -> Record:
    rng = np.random.default_rng(5)
    names = ("motor_speed_rad_s", "position_m", "velocity_m_s")
    return Record(SAMPLE_TIME, {name: rng.normal(size=samples) for name in names})


def filtered(model: ProcessModel, record: Record) -> Estimate:
    return run_filter(ekf, model, PRIOR, record, EhaParameters(), variances=VARIANCES, keep_innovations=True)


def predicted(mean: Array, P: Array, start: float, end: float, steps: int) -> tuple[Array, Array]:
    """Return the textbook prediction over one sample of the linear model, in sub-steps."""
    h = SAMPLE_TIME / SUBSTEPS
    F = np.array([[1.0, h, 0.0], [0.0, 1.0 - 3.0 * h, h], [0.0, 0.0, 1.0]])
    Q = np.diag([1e-8, 1e-4, 1e-2]) * h
    speeds = np.linspace(start, end, SUBSTEPS + 1)
    for j in range(steps):
        mean = F @ mean + np.array([0.0, h * 0.01 * (speeds[j] + speeds[j + 1]), 0.0])
        P = F @ P @ F.T + Q
    return mean, P


def kalman(record: Record, H: Array) -> tuple[Array, Array, float]:
    """Return the result of a textbook Kalman filter with a joint update by matrix inversion."""
    mean, P, log_likelihood = PRIOR.mean, PRIOR.covariance, 0.0
    speed, R = record["motor_speed_rad_s"], np.diag(list(VARIANCES.values()))
    for k in range(len(record)):
        if k:
            mean, P = predicted(mean, P, speed[k - 1], speed[k], SUBSTEPS)
        S = H @ P @ H.T + R
        residual = np.array([record["position_m"][k], record["velocity_m_s"][k]]) - H @ mean
        K = P @ H.T @ np.linalg.inv(S)
        mean, P = mean + K @ residual, (np.eye(3) - K @ H) @ P
        log_likelihood -= 0.5 * (residual @ np.linalg.inv(S) @ residual + np.log(np.linalg.det(2.0 * np.pi * S)))
    return mean, P, log_likelihood


def test_on_a_linear_model_the_extended_filter_equals_the_textbook_kalman_filter(
    linear: ProcessModel, observation: Array
) -> None:
    record = noisy_record()
    mean, covariance, log_likelihood = kalman(record, observation)
    estimate = filtered(linear, record)
    np.testing.assert_allclose(estimate.belief.mean, mean, rtol=1e-9)
    np.testing.assert_allclose(estimate.belief.covariance, covariance, rtol=1e-7)
    assert estimate.log_likelihood == pytest.approx(log_likelihood, rel=1e-9)


def test_the_log_likelihood_and_nis_are_those_of_the_innovations(linear: ProcessModel) -> None:
    estimate = filtered(linear, noisy_record())
    squares = estimate.residuals**2 / estimate.residual_variances
    densities = -0.5 * (squares + np.log(2.0 * np.pi * estimate.residual_variances))
    assert estimate.log_likelihood == pytest.approx(float(np.sum(densities)), rel=1e-12)
    assert list(estimate.nis.values()) == pytest.approx(np.mean(squares, axis=0).tolist(), rel=1e-12)


def test_the_log_likelihood_is_finite_if_the_product_of_variances_overflows(linear: ProcessModel) -> None:
    noise = dict.fromkeys((state.name for state in linear.states), 1e12)
    estimate = run_filter(
        ekf, linear, PRIOR, noisy_record(), EhaParameters(), variances=VARIANCES, noise=noise, keep_innovations=True
    )
    densities = -0.5 * (
        estimate.residuals**2 / estimate.residual_variances + np.log(2.0 * np.pi * estimate.residual_variances)
    )
    assert np.all(np.sum(np.log10(estimate.residual_variances / list(VARIANCES.values())), axis=0) > 900.0)
    assert estimate.log_likelihood == pytest.approx(float(np.sum(densities)), rel=1e-12)


def test_a_missing_sample_gives_a_prediction_without_update(linear: ProcessModel) -> None:
    record = noisy_record(2)
    gone = {name: np.array([record[name][0], np.nan]) for name in VARIANCES}
    first = filtered(linear, record.slice(0, 1)).belief
    speed = record["motor_speed_rad_s"]
    mean, covariance = predicted(first.mean, first.covariance, speed[0], speed[1], SUBSTEPS)
    estimate = filtered(linear, record.replace(**gone))
    np.testing.assert_allclose(estimate.belief.mean, mean, rtol=1e-10)
    np.testing.assert_allclose(estimate.belief.covariance, covariance, rtol=1e-10)
    assert np.all(np.isnan(estimate.residuals[1]))


def test_a_channel_without_any_sample_has_the_effect_of_an_absent_channel(linear: ProcessModel) -> None:
    record = noisy_record()
    blind = filtered(linear, record.replace(velocity_m_s=np.full(len(record), np.nan)))
    without = filtered(linear, record.replace(velocity_m_s=None))
    np.testing.assert_allclose(blind.belief.mean, without.belief.mean, rtol=1e-12)
    np.testing.assert_allclose(blind.belief.covariance, without.belief.covariance, rtol=1e-12)
    assert blind.log_likelihood == pytest.approx(without.log_likelihood, rel=1e-12)
    assert np.isnan(blind.nis["velocity_m_s"])


def test_with_every_channel_missing_the_belief_is_the_prediction_of_the_model(linear: ProcessModel) -> None:
    record = noisy_record(3)
    nothing = {name: np.full(3, np.nan) for name in VARIANCES}
    mean, covariance = PRIOR.mean, PRIOR.covariance
    speed = record["motor_speed_rad_s"]
    for k in (1, 2):
        mean, covariance = predicted(mean, covariance, speed[k - 1], speed[k], SUBSTEPS)
    estimate = filtered(linear, record.replace(**nothing))
    np.testing.assert_allclose(estimate.belief.mean, mean, rtol=1e-10)
    np.testing.assert_allclose(estimate.belief.covariance, covariance, rtol=1e-10)
    assert estimate.log_likelihood == 0.0
