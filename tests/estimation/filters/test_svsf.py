"""Smooth variable structure filter: the Kalman gain within its limit, the robust one beyond, always a covariance."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.engine.contract import FilterProblem
from estimation.filters.ekf import ekf
from estimation.filters.run import filter_problem
from estimation.filters.svsf import svsf
from estimation.models.gaussian import Gaussian
from estimation.models.model import ProcessModel
from plant.arrays import Array
from plant.eha.model import EhaParameters
from plant.errors import HydrostateError
from plant.log.record import Record

RIG = EhaParameters()
PRIOR = Gaussian(np.array([0.0, 0.0, 0.5]), np.array([[4e-4, 1e-4, 0.0], [1e-4, 1e-2, 1e-3], [0.0, 1e-3, 1.0]]))
VARIANCES = {"position_m": 1e-4, "velocity_m_s": 1e-2}


def task(linear: ProcessModel, position: Array, **settings: float) -> FilterProblem:
    record = Record(0.01, {"motor_speed_rad_s": np.zeros(len(position)), "position_m": position})
    problem = filter_problem(linear, PRIOR, record, RIG, variances=VARIANCES)
    return replace(problem, settings=settings, keep_innovations=True)


def by_hand(first: float, second: float, gamma: float, limit: float) -> tuple[Array, Array]:
    """Return mean and covariance in SI after two consecutive samples of the position, from the published matrices."""
    H, r = np.array([1.0, 0.0, 0.0]), VARIANCES["position_m"]
    mean, P, last = PRIOR.mean, PRIOR.covariance, 0.0
    for k, y in enumerate((first, second)):
        if k:
            for _ in range(40):
                h = 0.01 / 40
                F = np.array([[1.0, h, 0.0], [0.0, 1.0 - 3.0 * h, h], [0.0, 0.0, 1.0]])
                mean, P = F @ mean, F @ P @ F.T + np.diag([1e-8, 1e-4, 1e-2]) * h
        e, spread = y - H @ mean, H @ P @ H
        magnitude = abs(e) + gamma * abs(last)
        share = spread / (spread + r)
        if magnitude / share > limit:  # the optimal layer is thicker than allowed
            share = magnitude * min(abs(e) / limit, 1.0) / abs(e)
        K = P @ H / spread * share
        mean = mean + K * e
        P = (np.eye(3) - np.outer(K, H)) @ P @ (np.eye(3) - np.outer(K, H)).T + r * np.outer(K, K)
        last = y - H @ mean
    return mean, P


@pytest.mark.parametrize("jump", [0.002, 0.03, 0.3])
def test_the_smooth_variable_structure_filter_agrees_with_its_publication(linear: ProcessModel, jump: float) -> None:
    problem = task(linear, np.array([0.01, 0.01 + jump]), gamma=0.4, boundary_layer=3.0)
    trace = svsf(problem)
    mean, P = by_hand(0.01, 0.01 + jump, 0.4, 3.0 * 0.01)
    scale = np.array([state.scale for state in linear.states])
    np.testing.assert_allclose(trace.mean * scale, mean, rtol=1e-9)
    np.testing.assert_allclose(trace.covariance * np.outer(scale, scale), P, rtol=1e-8, atol=1e-12)


def test_with_a_boundary_layer_that_is_never_reached_it_equals_the_kalman_filter(linear: ProcessModel) -> None:
    problem = task(linear, np.random.default_rng(0).normal(0.0, 0.02, 200), boundary_layer=1e9)
    np.testing.assert_allclose(svsf(problem).track, ekf(replace(problem, settings={})).track, rtol=1e-9, atol=1e-12)


def test_it_follows_a_jump_that_an_overconfident_kalman_filter_misses(linear: ProcessModel) -> None:
    position = np.concatenate([np.zeros(2000), np.full(20, 0.5)]) + np.random.default_rng(1).normal(0.0, 0.01, 2020)
    problem = task(linear, position, boundary_layer=10.0)
    problem = replace(problem, noise=np.zeros(3))  # assumes that nothing but the model moves the state
    late = 0.5 / linear.states[0].scale
    assert abs(svsf(problem).mean[0] - late) < 0.1 * late
    assert abs(ekf(replace(problem, settings={})).mean[0] - late) > 0.5 * late


def test_missing_samples_give_predictions_without_update(linear: ProcessModel) -> None:
    gone = task(linear, np.array([0.01, np.nan, np.nan]), boundary_layer=3.0)
    speed = gone.drives
    alone = replace(gone, measured=gone.measured[:1], drives=speed[:1])
    after = svsf(gone)
    blind = replace(gone, measured=np.full((3, 1), np.nan), mean=svsf(alone).mean, covariance=svsf(alone).covariance)
    np.testing.assert_allclose(after.mean, svsf(blind).mean, rtol=1e-12)
    assert after.count.tolist() == [1.0]


def test_invalid_settings_and_robust_updates_are_refused(linear: ProcessModel) -> None:
    problem = task(linear, np.zeros(3))
    for settings, message in (
        ({"gamma": 1.0}, "gamma must be 0 or more and below 1, got 1.0"),
        ({"boundary_layer": 0.0}, "boundary_layer must be positive, got 0.0"),
        ({"layer": 1.0}, "svsf can be set gamma, boundary_layer, got 'layer'"),
    ):
        with pytest.raises(HydrostateError, match=message):
            svsf(replace(problem, settings=settings))
    with pytest.raises(HydrostateError, match="robust must be none, got 'huber'"):
        svsf(replace(problem, robust="huber"))
