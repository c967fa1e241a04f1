"""The filter of a trend, against closed-form results and against its own claims."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad_vec
from scipy.linalg import expm

from faults.trend.kalman import (
    LEVEL,
    PACES,
    REST_PACES,
    beliefs,
    exponential_growth,
    first_belief,
    moments,
    predict,
    settings,
)
from plant.arrays import Array
from tests.faults.trend.small_beliefs import next_belief, one_setting
from tests.kernels import loops_in_python


def test_without_process_noise_the_filter_is_bayesian_regression_on_a_line() -> None:
    rng = np.random.default_rng(1)
    times, stds = np.sort(rng.uniform(0.0, 20.0, 12)), rng.uniform(0.05, 0.3, 12)
    values = 0.2 + 0.03 * times + stds * rng.standard_normal(12)
    grid = one_setting(slope=0.05)
    *_, last = beliefs(times, values, stds, grid)
    design = np.column_stack([np.ones(12), times - times[0]])
    precision = design.T @ (design / stds[:, None] ** 2) + np.diag([1.0 / LEVEL**2, 1.0 / 0.05**2])
    line = np.linalg.solve(precision, design.T @ (values / stds**2))
    end = np.array([1.0, times[-1] - times[0]])
    assert last.mean[0, :2] == pytest.approx([end @ line, line[1]])
    assert last.covariance[0, 0, 0] == pytest.approx(end @ np.linalg.solve(precision, end))
    marginal = np.diag(stds**2) + design @ np.diag([LEVEL**2, 0.05**2]) @ design.T
    said = -0.5 * (values @ np.linalg.solve(marginal, values) + np.linalg.slogdet(2.0 * np.pi * marginal)[1])
    assert last.evidence[0] == pytest.approx(said)


def test_filtering_a_series_equals_filtering_log_by_log() -> None:
    grid, rng = settings(), np.random.default_rng(5)
    times, values = np.cumsum(rng.uniform(0.0, 3.0, 6)), np.array([0.0, 0.1, 0.0, 9.0, 0.1, 0.2])
    now, *rest = beliefs(times, values, np.full(6, 0.05), grid)
    for step, value, found in zip(np.diff(times, prepend=times[:1]), values, rest, strict=True):
        now = next_belief(now, float(step), float(value), 0.05, grid)
        for one, other in zip(vars(now).values(), vars(found).values(), strict=True):
            assert np.allclose(one, other, rtol=1e-12, atol=0.0)
    with loops_in_python():
        plainly = beliefs(times, values, np.full(6, 0.05), grid)
    assert np.allclose(plainly[-1].covariance, now.covariance, rtol=1e-12, atol=0.0)
    assert np.allclose(plainly[-1].mean, now.mean, rtol=1e-12, atol=0.0)


def test_two_prediction_steps_equal_one_of_their_total_time() -> None:
    grid = settings()
    now = next_belief(first_belief(grid), 0.0, 0.1, 0.05, grid)
    once, twice = predict(now, 3.0, grid), predict(predict(now, 1.2, grid), 1.8, grid)
    assert np.allclose(once.mean, twice.mean)
    assert np.allclose(once.covariance, twice.covariance, rtol=1e-9, atol=1e-18)


@pytest.mark.parametrize("pace", [0.0, 1e-6, *PACES, *REST_PACES, 0.7])
@pytest.mark.parametrize("step", [0.5, 1.0, 8.0])
def test_exponential_growth_follows_its_differential_equation(step: float, pace: float) -> None:
    rates = np.array([[0.0, 1.0], [0.0, pace]])

    def brought(after: float) -> Array:  # covariance from noise on the slope some time ago
        found = expm(rates * after)[:, 1]
        return np.outer(found, found)

    move, covariance = exponential_growth(step, pace)
    # below 1e-4 per step, relative growth is neglected
    assert move == pytest.approx(expm(rates * step)[:, 1], rel=1e-4 if abs(pace) * step < 1e-4 else 1e-12)
    assert covariance == pytest.approx(quad_vec(brought, 0.0, step)[0], rel=1e-4 if abs(pace) * step < 1e-4 else 1e-6)


def test_noise_free_exponential_growth_is_extrapolated() -> None:
    grid = one_setting(pace=0.1, slope=0.03)
    times = np.arange(40.0)
    level = 0.02 * np.expm1(0.1 * times)
    *_, last = beliefs(times, level, np.full(40, 1e-4), grid)
    later = predict(last, 15.0, grid)
    assert later.mean[0, 0] == pytest.approx(0.02 * np.expm1(0.1 * 54.0), rel=1e-3)
    assert later.mean[0, 1] == pytest.approx(0.002 * np.exp(0.1 * 54.0), rel=1e-3)


def test_each_kind_of_growth_has_the_same_prior_probability() -> None:
    grid = settings()
    weights = first_belief(grid).weights(grid)
    curved, bent = grid.curvature > 0.0, (grid.bend > 0.0) & (grid.pace == 0.0)
    steady = grid.growing & ~curved & (grid.bend == 0.0) & (grid.pace == 0.0)
    ways = [grid.pace < 0.0, grid.pace > 0.0, curved, bent & ~curved, steady]
    assert [weights[way].sum() for way in ways] == pytest.approx([0.1] * 5)
    assert list(np.diff(grid.pace) >= 0.0) == [True] * (len(grid.pace) - 1)
    assert sum(own.stop - own.start for _, own in grid.by_pace) == len(grid.pace)


def test_covariances_stay_symmetric_and_positive() -> None:
    rng = np.random.default_rng(2)
    *_, last = beliefs(np.arange(80.0), rng.standard_normal(80), np.full(80, 0.01), settings())
    assert np.allclose(last.covariance, np.swapaxes(last.covariance, 1, 2), atol=1e-12)
    assert np.linalg.eigvalsh(last.covariance).min() > -1e-12


def test_one_grossly_wrong_log_moves_the_level_by_less_than_its_own_standard_deviation() -> None:
    values = np.zeros(30)
    values[-1] = 5.0
    grid = settings()
    *_, before, last = beliefs(np.arange(30.0), values, np.full(30, 0.05), grid)
    assert abs(moments(last, grid)[0] - moments(before, grid)[0]) < 0.05


def test_a_log_with_a_larger_deviation_counts_less() -> None:
    grid = settings()
    moves = []
    for std in (0.02, 0.2):
        *_, last = beliefs(np.arange(9.0), np.array([0.0] * 8 + [0.1]), np.array([0.02] * 8 + [std]), grid)
        moves.append(moments(last, grid)[0])
    assert moves[0] > 2.0 * moves[1] > 0.0


@pytest.mark.parametrize("shared", [-1e4, 0.0, 1e4])
def test_evidence_common_to_all_settings_does_not_change_their_weights(shared: float) -> None:
    grid = settings()
    told = 3.0 * np.sin(np.arange(len(grid.slope)))
    now = first_belief(grid)
    found = replace(now, evidence=told + shared).weights(grid)
    exact = np.exp(told + grid.log_prior)
    assert found == pytest.approx(exact / exact.sum(), rel=1e-9)


def test_weights_sum_to_one_and_half_of_the_prior_is_without_growth() -> None:
    grid = settings()
    weights = first_belief(grid).weights(grid)
    assert weights.sum() == pytest.approx(1.0)
    assert weights[grid.growing].sum() == pytest.approx(0.5)


def test_a_series_without_logs_has_only_the_prior_belief() -> None:
    none = np.empty(0)
    assert len(beliefs(none, none, none, settings())) == 1


def test_a_pause_of_any_length_leaves_finite_beliefs() -> None:
    times = np.concatenate([np.arange(6) * 1e-3, 500.0 + np.arange(6) * 1e-3, [2e6]])
    *_, last = beliefs(times, np.linspace(0.0, 1.2, 13), np.full(13, 0.02), settings())
    assert all(np.all(np.isfinite(each)) for each in (last.mean, last.covariance, last.evidence))
    move, _ = exponential_growth(1e6, 0.1)
    assert move[1] == pytest.approx(1000.0)
