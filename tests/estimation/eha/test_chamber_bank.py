"""A bank of filters as one estimate: moments of a mixture, filters that count as one, ends of blocks."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.eha.chamber_bank import Member, _block_ends, _distinct_filters, _mixture_moments, _weights, run_bank  # pyright: ignore[reportPrivateUsage]
from estimation.engine.contract import FilterProblem
from estimation.filters.ekf import ekf
from estimation.filters.run import filter_problem
from estimation.models.gaussian import Gaussian
from estimation.models.model import ProcessModel
from plant.eha.model import EhaParameters
from plant.log.record import Record

PRIOR = Gaussian(np.array([0.0, 0.0, 5.0]), np.diag([1e-8, 1e-4, 4.0]))


@pytest.fixture(scope="module")
def task(linear: ProcessModel) -> FilterProblem:
    rng = np.random.default_rng(4)
    speed = rng.normal(0.0, 10.0, 300)
    channels = {"motor_speed_rad_s": speed, "position_m": rng.normal(0.0, 1e-3, 300)}
    variances = {"position_m": 1e-6}
    return filter_problem(linear, PRIOR, Record(0.01, channels), EhaParameters(), variances=variances)


def member(task: FilterProblem, mean: float, deviation: float = 1.0, score: float = 0.0) -> Member:
    return Member(task, np.array([mean]), np.array([[deviation**2]]), score)


def test_a_mixture_has_the_moments_of_its_parts() -> None:
    mean, variance = _mixture_moments(np.array([0.5, 0.5]), np.array([[[0.0]], [[4.0]]]), np.array([[[1.0]], [[3.0]]]))
    assert (float(mean[0, 0]), float(variance[0, 0])) == pytest.approx((2.0, 2.0 + 4.0))


def test_a_diverged_filter_has_no_weight_in_the_mixture(task: FilterProblem) -> None:
    parts = [member(task, 0.0, score=-1e4), member(task, 1.0, score=-1e4 + np.log(3.0))]
    np.testing.assert_allclose(_weights(parts), [0.25, 0.75])
    mean, _ = _mixture_moments(np.array([0.5, 0.5]), np.array([[[np.nan]], [[4.0]]]), np.ones((2, 1, 1)))
    assert float(mean[0, 0]) == 4.0


def test_of_two_filters_with_nearly_equal_means_the_first_is_kept(task: FilterProblem) -> None:
    parts = [member(task, 0.0), member(task, 0.5), member(task, 3.0)]
    assert _distinct_filters(parts, (0,)) == [parts[0], parts[2]]
    # a variance that rounding made negative causes no square-root warning
    rounded = replace(parts[1], covariance=np.array([[-1e-30]]))
    assert _distinct_filters([rounded, parts[0]], (0,)) == [rounded, parts[0]]


@pytest.mark.parametrize(("samples", "every"), [(10_000, 1), (100_000, 5), (37, 1), (1, 1)])
def test_blocks_end_at_samples_of_the_track_and_at_the_last_sample(samples: int, every: int) -> None:
    ends = _block_ends(samples, every, 1e-3)
    assert ends == sorted(set(ends))
    assert ends[-1] == samples
    assert all((end - 1) % every == 0 for end in ends[:-1])


def test_a_bank_of_one_filter_on_a_linear_model_equals_that_filter(task: FilterProblem) -> None:
    alone = ekf(task)
    found = run_bank([Member(task, task.mean, task.covariance, 0.0)], (0, 1)).online
    np.testing.assert_allclose(found.track[:-1], alone.track[:-1], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(found.track_variance[:-1], alone.track_variance[:-1], rtol=1e-9)
