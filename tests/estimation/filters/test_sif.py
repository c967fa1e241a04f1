"""The sliding innovation filter uses a large innovation fully and a small one in proportion."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.engine.contract import FilterProblem
from estimation.filters.run import filter_problem
from estimation.filters.sif import sif
from estimation.models.gaussian import Gaussian
from estimation.models.model import ProcessModel
from plant.eha.model import EhaParameters
from plant.errors import HydrostateError
from plant.log.record import Record

PRIOR = Gaussian(np.array([0.0, 0.0, 0.5]), np.array([[4e-4, 1e-4, 0.0], [1e-4, 1e-2, 1e-3], [0.0, 1e-3, 1.0]]))
NOISE = 1e-4


def task(linear: ProcessModel, position: float, layer: float = 5.0) -> FilterProblem:
    record = Record(0.01, {"motor_speed_rad_s": np.zeros(1), "position_m": np.array([position])})
    problem = filter_problem(linear, PRIOR, record, EhaParameters(), variances={"position_m": NOISE})
    return replace(problem, settings={"boundary_layer": layer})


@pytest.mark.parametrize(("position", "share"), [(0.01, 0.2), (-0.025, 0.5), (0.05, 1.0), (7.0, 1.0)])
def test_mean_and_covariance_follow_from_the_published_gain(
    linear: ProcessModel, position: float, share: float
) -> None:
    H, P = np.array([1.0, 0.0, 0.0]), PRIOR.covariance
    K = share * P @ H / (H @ P @ H)  # the boundary layer is 0.05 m
    kept = np.eye(3) - np.outer(K, H)
    trace, scale = sif(task(linear, position)), np.array([state.scale for state in linear.states])
    np.testing.assert_allclose(trace.mean * scale, PRIOR.mean + K * position, rtol=1e-12)
    expected = kept @ P @ kept.T + NOISE * np.outer(K, K)
    np.testing.assert_allclose(trace.covariance * np.outer(scale, scale), expected, rtol=1e-10, atol=1e-16)


def test_beyond_the_boundary_layer_the_measured_state_equals_the_measurement(linear: ProcessModel) -> None:
    trace, scale = sif(task(linear, 3.0)), linear.states[0].scale
    assert trace.mean[0] * scale == pytest.approx(3.0, rel=1e-12)
    assert trace.covariance[0, 0] * scale**2 == pytest.approx(NOISE, rel=1e-9)


def test_a_missing_sample_leaves_the_belief_unchanged(linear: ProcessModel) -> None:
    problem = task(linear, float("nan"))
    np.testing.assert_array_equal(sif(problem).mean, problem.mean)
    np.testing.assert_array_equal(sif(problem).covariance, problem.covariance)


def test_a_state_without_uncertainty_is_not_updated(linear: ProcessModel) -> None:
    problem = task(linear, 0.02)
    sure = replace(problem, covariance=np.diag([0.0, 1.0, 1.0]))
    np.testing.assert_array_equal(sif(sure).mean, sure.mean)


def test_invalid_settings_and_robust_updates_are_refused(linear: ProcessModel) -> None:
    problem = task(linear, 0.01)
    with pytest.raises(HydrostateError, match=r"boundary_layer must be positive, got -1\.0"):
        sif(replace(problem, settings={"boundary_layer": -1.0}))
    with pytest.raises(HydrostateError, match="sif can be set boundary_layer, got 'gamma'"):
        sif(replace(problem, settings={"gamma": 0.1}))
    with pytest.raises(HydrostateError, match="robust must be none, got 'student-t'"):
        sif(replace(problem, robust="student-t"))
