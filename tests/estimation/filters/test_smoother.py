"""The smoother equals the textbook's, needs little memory, and is never less certain than the filter."""

import tracemalloc
from dataclasses import dataclass, replace

import numpy as np
import pytest

from estimation.engine.contract import FilterProblem
from estimation.engine.linearised import compile_step
from estimation.filters.ekf import ekf
from estimation.filters.run import filter_problem
from estimation.filters.smoother import _chunks, smoother
from estimation.models.eha_forms import FORMS
from estimation.models.gaussian import Gaussian
from estimation.models.model import ProcessModel
from faults.conditions import CONDITIONS, Condition, parameters_for
from plant.arrays import Array
from plant.eha.drives import sine
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, REDUCED, simulate
from plant.errors import HydrostateError
from plant.log.record import Record
from plant.sensors.sensors import BENCH

RIG = EhaParameters()


@dataclass(frozen=True, eq=False)
class SmoothedStretch:
    """Beliefs at every sample of a stretch of a log, in the filter's units."""

    filtered_mean: Array
    mean: Array
    filtered_covariance: Array
    covariance: Array


def smoothed_stretch(problem: FilterProblem, first: int = 0, stop: int | None = None) -> SmoothedStretch:
    """Return the beliefs at every sample of a stretch, given the whole log."""
    end, n = len(problem.measured) if stop is None else stop, problem.model.width
    width = n + n * (n + 1) // 2
    beliefs = np.empty((2, end - first, width))
    for start, posteriors, smoothed in _chunks(problem):
        low, high = max(start, first), min(start + len(smoothed), end)
        if low < high:
            beliefs[0, low - first : high - first] = posteriors[low - start : high - start]
            beliefs[1, low - first : high - first] = smoothed[low - start : high - start]
        if start <= first:
            break
    return SmoothedStretch(beliefs[0, :, :n], beliefs[1, :, :n], _unpacked(beliefs[0], n), _unpacked(beliefs[1], n))


def _unpacked(beliefs: Array, n: int) -> Array:
    covariance = np.empty((len(beliefs), n, n))
    for (i, j), values in zip(zip(*np.triu_indices(n), strict=True), beliefs[:, n:].T, strict=True):
        covariance[:, i, j] = covariance[:, j, i] = values
    return covariance


def linear_task(linear: ProcessModel, samples: int = 150, missing: float = 0.2) -> FilterProblem:
    rng = np.random.default_rng(4)
    channels = {
        name: np.where(rng.random(samples) < missing, np.nan, rng.normal(size=samples))
        for name in ("position_m", "velocity_m_s")
    }
    record = Record(0.01, {"motor_speed_rad_s": rng.normal(size=samples), **channels})
    prior = Gaussian(np.array([0.1, -0.2, 0.5]), np.diag([1e-4, 1e-2, 1.0]))
    return filter_problem(linear, prior, record, RIG, variances={"position_m": 1e-2, "velocity_m_s": 1e-1})


def bench_task(form: str, parameters: EhaParameters, samples: int = 2000, sample_time: float = 1e-4) -> FilterProblem:
    plant = {"acceleration": REDUCED, "pressure": LUMPED}[form]
    drive = sine(samples * sample_time, sample_time, parameters.rated_speed, 5.0)
    record = simulate(plant, drive, sample_time, parameters, sensors=BENCH, rng=np.random.default_rng(0))
    third = {"acceleration": 10.0, "pressure": 1e5}[form]
    prior = Gaussian(np.array([0.0, 0.0, 0.0, 2e8]), np.diag([1e-5, 1e-3, third, 3e8]) ** 2)
    return filter_problem(FORMS[form], prior, record, parameters)


def inverse(P: Array) -> Array:
    size = np.sqrt(np.diag(P))
    return np.linalg.inv(P / np.outer(size, size)) / np.outer(size, size)


def textbook(problem: FilterProblem, found: SmoothedStretch) -> tuple[Array, Array]:
    """Return the Rauch-Tung-Striebel recursion backwards over the filter's beliefs, with one step for each sample."""
    step, h = compile_step(problem.model).step, problem.sample_time
    means, covariances = found.filtered_mean.copy(), found.filtered_covariance.copy()
    for k in range(len(means) - 2, -1, -1):
        P = found.filtered_covariance[k]
        predicted, F = step(found.filtered_mean[k], problem.drives[k], problem.drives[k + 1], problem.parameters, h)
        ahead = F @ P @ F.T + np.diag(problem.noise) * h
        G = P @ F.T @ inverse(ahead)
        means[k] += G @ (means[k + 1] - predicted)
        covariances[k] += G @ (covariances[k + 1] - ahead) @ G.T
    return means, covariances


def assert_equal(found: SmoothedStretch, means: Array, covariances: Array, tolerance: float) -> None:
    size = np.sqrt(np.einsum("kii->ki", covariances))
    np.testing.assert_allclose((found.mean - means) / size, 0.0, atol=tolerance)
    relative = (found.covariance - covariances) / (size[:, :, None] * size[:, None, :])
    np.testing.assert_allclose(relative, 0.0, atol=tolerance)


def test_on_a_linear_model_with_missing_samples_the_smoother_equals_the_textbook_one(linear: ProcessModel) -> None:
    problem = linear_task(replace(linear, name="one_step", longest_step=1.0))
    found = smoothed_stretch(problem)
    assert_equal(found, *textbook(problem, found), 1e-9)


@pytest.mark.parametrize("form", FORMS)
def test_on_every_form_the_smoother_equals_the_textbook_one_started_from_the_filtered_beliefs(form: str) -> None:
    problem = bench_task(form, RIG)
    found = smoothed_stretch(problem)
    assert np.min(found.filtered_mean[:, 3]) == 0.0 or form == "acceleration"  # a bound was reached on the way
    assert_equal(found, *textbook(problem, found), 1e-6)


@pytest.mark.parametrize("condition", CONDITIONS.values(), ids=CONDITIONS)
@pytest.mark.parametrize("form", FORMS)
def test_the_smoothed_covariance_is_positive_semidefinite_and_never_above_the_filtered_one(
    form: str, condition: Condition
) -> None:
    found = smoothed_stretch(bench_task(form, parameters_for(condition)))
    for matrices, sizes in (
        (found.filtered_covariance - found.covariance, found.filtered_covariance),
        (found.covariance, found.covariance),
    ):
        size = np.sqrt(np.einsum("kii->ki", sizes))
        assert np.min(np.linalg.eigvalsh(matrices / (size[:, :, None] * size[:, None, :]))) > -1e-12


def test_the_last_belief_log_likelihood_and_innovations_equal_those_of_the_filter(linear: ProcessModel) -> None:
    problem = linear_task(linear)
    smooth, plain = smoother(problem), ekf(problem)
    for name in ("mean", "covariance", "nis", "count"):
        np.testing.assert_array_equal(getattr(smooth, name), getattr(plain, name))
    assert smooth.log_likelihood == plain.log_likelihood
    np.testing.assert_array_equal(smooth.track[-1], plain.track[-1])


def test_a_constant_has_the_same_value_and_deviation_along_the_whole_track() -> None:
    trace = smoother(bench_task("pressure", RIG))
    np.testing.assert_allclose(trace.track[:, 3], trace.mean[3], rtol=1e-9)
    np.testing.assert_allclose(trace.track_variance[:, 3], trace.covariance[3, 3], rtol=1e-6)


def test_the_smoother_bridges_gaps_better_than_the_filter() -> None:
    problem = bench_task("pressure", RIG)
    gone = np.where((np.arange(2000)[:, None] // 100) % 4 == 3, np.nan, problem.measured)
    gappy = replace(problem, measured=gone)
    truth = smoothed_stretch(problem).mean[:, 0]
    blind = np.isnan(gone[:, 0])
    smooth, plain = (np.abs(track[blind, 0] - truth[blind]) for track in (smoother(gappy).track, ekf(gappy).track))
    assert np.mean(smooth) < 0.5 * np.mean(plain)


def test_smoothing_in_chunks_or_of_a_part_gives_the_same_bits_as_of_the_whole_log(linear: ProcessModel) -> None:
    problem = replace(linear_task(linear, 403), every=7)
    whole, part = smoothed_stretch(problem), smoothed_stretch(problem, 101, 260)
    np.testing.assert_array_equal(part.mean, whole.mean[101:260])
    np.testing.assert_array_equal(part.covariance, whole.covariance[101:260])
    np.testing.assert_array_equal(part.filtered_mean, whole.filtered_mean[101:260])
    trace = smoother(problem)
    np.testing.assert_array_equal(trace.track, whole.mean[::7])
    np.testing.assert_array_equal(trace.track_variance, np.einsum("kii->ki", whole.covariance)[::7])


def test_the_backward_pass_weights_outliers_as_the_forward_pass_did(linear: ProcessModel) -> None:
    problem = linear_task(replace(linear, name="one_step", longest_step=1.0))
    problem.measured[70] = 300.0
    robust = replace(problem, robust="student-t")
    found = smoothed_stretch(robust)
    assert_equal(found, *textbook(robust, found), 1e-9)
    np.testing.assert_array_equal(found.filtered_mean[-1], ekf(robust).mean)


def test_substeps_are_smoothed_like_samples_without_measurements(linear: ProcessModel) -> None:
    slow = linear_task(replace(linear, name="four_steps", longest_step=0.0025))
    count = 4 * (len(slow.measured) - 1) + 1
    measured = np.full((count, 2), np.nan)
    measured[::4] = slow.measured
    speed = np.interp(np.arange(count), np.arange(0, count, 4), slow.drives[:, 0])
    quick = replace(slow, measured=measured, drives=speed[:, None], sample_time=0.0025, substeps=1)
    assert slow.substeps == 4
    np.testing.assert_allclose(smoother(slow).track, smoother(quick).track[::4], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(smoother(slow).track_variance, smoother(quick).track_variance[::4], rtol=1e-9)


def test_a_long_log_needs_little_memory() -> None:
    problem = bench_task("acceleration", RIG, 200_000)
    problem = replace(problem, every=10_000)
    smoother(bench_task("acceleration", RIG, 100))
    tracemalloc.start()
    smoother(problem)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 1e6  # the beliefs of all samples would take 45e6


def test_a_log_of_one_sample_gives_the_filtered_estimate(linear: ProcessModel) -> None:
    problem = linear_task(linear, 1)
    np.testing.assert_array_equal(smoother(problem).track, ekf(problem).track)


def test_the_smoother_refuses_any_setting(linear: ProcessModel) -> None:
    with pytest.raises(HydrostateError, match="smoother can be set nothing, got 'lag'"):
        smoother(replace(linear_task(linear), settings={"lag": 5.0}))
