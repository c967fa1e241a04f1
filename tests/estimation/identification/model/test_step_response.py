"""The step response is that of the model, and its deviation follows from the covariance."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.identification.model.linear_model import LinearModel
from estimation.identification.model.step_response import step_response

SPREAD = np.array([[4e-4, 1e-4, 0.0], [1e-4, 9e-4, 2e-4], [0.0, 2e-4, 1e-4]])


def test_a_discrete_step_response_begins_after_the_dead_time_without_offset_and_initial_state() -> None:
    model = LinearModel([0.0, 0.0, 0.3, 0.1], [1.0, -0.6], 0.01, "u", "y", delay=2, offset=5.0, initial_state=[1, 2, 3])
    found = step_response(model, 40)
    assert found.response[:3].tolist() == [0.0, 0.0, pytest.approx(0.3)]
    assert found.response[-1] == pytest.approx(1.0)
    assert np.isnan(found.std[1:]).all()  # the covariance is not known
    assert found.time[-1] == pytest.approx(0.39)


def test_the_deviation_equals_the_spread_of_models_drawn_from_the_covariance() -> None:
    model = LinearModel([0.3, 0.1], [1.0, -0.6], 0.01, "u", "y", covariance=1e-3 * SPREAD)
    rng = np.random.default_rng(3)
    drawn = rng.multivariate_normal([0.3, 0.1, -0.6], 1e-3 * SPREAD, 4000)
    runs = [LinearModel([a, b], [1.0, f], 0.01, "u", "y").simulate(np.ones(30)) for a, b, f in drawn]
    assert step_response(model, 30).std == pytest.approx(np.std(runs, axis=0), rel=0.06)


def test_in_continuous_time_the_deviation_is_the_analytic_one() -> None:
    spread = np.diag([1e-4, 4e-4])
    model = LinearModel([2.0], [1.0, 2.0], 0.05, "u", "y", continuous=True, covariance=spread)
    found = step_response(model, 60)
    t = found.time
    by_b, by_a = (1.0 - np.exp(-2.0 * t)) / 2.0, t * np.exp(-2.0 * t) - (1.0 - np.exp(-2.0 * t)) / 2.0
    assert found.response == pytest.approx(1.0 - np.exp(-2.0 * t), abs=1e-9)
    assert found.std == pytest.approx(np.sqrt(1e-4 * by_b**2 + 4e-4 * by_a**2), rel=1e-3, abs=1e-9)
    low, high = found.band95
    assert ((low < 1.0) | (t > 0.0)).all()
    assert (high - low)[-1] == pytest.approx(2.0 * 1.96 * found.std[-1], rel=1e-3)
    alone = step_response(replace(model, covariance=np.diag([0.0, 4e-4])), 60)
    assert alone.std == pytest.approx(np.abs(2e-2 * by_a), rel=1e-3, abs=1e-9)
