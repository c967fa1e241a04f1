"""Logs whose sensors were zeroed in between have one offset each, and a common gain."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from estimation.arrays import Array
from estimation.identification.free_run.data import Channels, channels_from, scaled
from estimation.identification.free_run.identify import Identified, identify_channels
from estimation.identification.free_run.linear_problem import Form, Problem
from estimation.identification.free_run.log_offsets import logs_at_one_offset
from plant.errors import LogWarning
from tests.thinned import thinned

N, POLE, GAIN = 160, 0.9, 2.0


def logs(offsets: tuple[float, ...], seed: int = 0, noise: float = 0.1) -> Channels:
    """Return logs of a first-order plant, each with its own offset."""
    rng, u, y = np.random.default_rng([seed, 1700]), list[Array](), list[Array]()
    for offset in offsets:
        driven = np.repeat(rng.standard_normal(N // 10), 10)
        answer = np.full(N, GAIN * driven[0])
        for t in range(1, N):
            answer[t] = POLE * answer[t - 1] + (1.0 - POLE) * GAIN * driven[t - 1]
        u.append(driven[:, None])
        y.append(answer + offset + noise * rng.standard_normal(N))
    return channels_from(u, y, 0.1, ["u"], "y")


def identified(data: Channels, structure: str = "output-error") -> Identified:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LogWarning)
        return identify_channels(data, structure=structure, order=1, delay=1)


@pytest.mark.parametrize("structure", thinned(["output-error", "auto"], ["output-error"]))
def test_logs_with_different_offsets_each_get_their_own(structure: str) -> None:
    found = identified(logs((0.0, 1.0, 5.0)), structure)
    assert found.notes[-1].code == "offsets_differ"
    assert found.sound
    linear = found.model.linear
    assert linear is not None
    assert abs(linear.dc_gain - GAIN) < 2.6 * linear.dc_gain_std
    assert linear.dc_gain_std < 0.02 * GAIN
    assert linear.offset == pytest.approx(2.0, abs=0.05)  # their mean
    assert found.quality.rmse == pytest.approx(0.1, rel=0.1)  # the noise


def test_different_offsets_cause_a_warning() -> None:
    with pytest.warns(LogWarning, match=r"differs from log to log \(-0\.\d+, \+0\.\d+ from their mean\)"):
        identify_channels(logs((2.0, 3.0)), order=1, delay=1)


def test_logs_with_the_same_offset_get_one_offset() -> None:
    assert logs_at_one_offset(logs((2.0, 2.0, 2.0)), [1]) is None
    assert logs_at_one_offset(logs((2.0,)), [1]) is None
    assert identified(logs((2.0, 2.0))).notes == ()


def test_logs_without_outputs_or_without_changes_get_no_separate_offsets() -> None:
    data = logs((2.0, 3.0))
    assert logs_at_one_offset(replace(data, y=(data.y[0], np.full(N, np.nan))), [1]) is None
    assert logs_at_one_offset(replace(data, y=(np.zeros(N), np.ones(N))), [1]) is None


def test_derivatives_with_respect_to_offsets_equal_numerical_ones() -> None:
    data = replace(scaled(logs((0.0, 1.0, 5.0)))[0], own_offsets=True)
    problem, rng = Problem(Form(2, (2,), (1,)), data), np.random.default_rng(1)
    theta = np.concatenate([[0.1, 0.2, -1.2, 0.4], rng.standard_normal(1 + 2 * 3 + 2)])
    assert theta.size == problem.n_parameters
    found = problem.jacobian(theta)[1]
    for k in range(theta.size):
        step = 1e-6 * np.eye(theta.size)[k]
        expected = (problem.jacobian(theta + step)[0] - problem.jacobian(theta - step)[0]) / 2e-6
        np.testing.assert_allclose(found[:, k], expected, atol=1e-7)
