"""If the Kalman filter is exact, particles agree with it to the accuracy that their number allows."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

from estimation.engine.contract import FilterProblem
from estimation.filters.ekf import ekf
from estimation.filters.methods import METHODS
from estimation.filters.particle import gather, particle, particle_filter, predicted, resample, weigh
from estimation.filters.run import filter_problem
from estimation.models.gaussian import Gaussian
from estimation.models.model import ProcessModel
from plant.eha.model import EhaParameters
from plant.errors import HydrostateError
from plant.log.record import Record

SEEDS, PARTICLES = 12, 1000


def task(linear: ProcessModel, samples: int = 40) -> FilterProblem:
    """Return a problem of the linear model with enough noise in every state; one sample in five is missing."""
    rng = np.random.default_rng(4)
    channels = {
        name: np.where(rng.random(samples) < 0.2, np.nan, rng.normal(0.0, size, samples))
        for name, size in (("position_m", 0.05), ("velocity_m_s", 0.3))
    }
    model = replace(linear, name="coarse", longest_step=0.005)
    speed = rng.normal(0.0, 1e3, samples)
    speed[samples // 2 : samples // 2 + 3] = np.nan
    record = Record(0.01, {"motor_speed_rad_s": speed, **channels})
    prior = Gaussian(np.array([0.0, 0.0, 0.5]), np.diag([1e-3, 1e-2, 1.0]))
    problem = filter_problem(
        model,
        prior,
        record,
        EhaParameters(),
        variances={"position_m": 2e-3, "velocity_m_s": 0.1},
        noise={"position_m": 1e-2, "velocity_m_s": 1e-1, "force_n": 10.0},
    )
    return replace(problem, keep_innovations=True)


def test_the_particle_filter_agrees_with_the_kalman_filter_within_monte_carlo_error(linear: ProcessModel) -> None:
    problem = task(linear)
    exact = ekf(problem)
    runs = [particle_filter(problem, PARTICLES, np.random.default_rng(seed)) for seed in range(SEEDS)]
    for name in ("track", "track_variance"):
        values = np.array([getattr(run, name) for run in runs])
        error = np.std(values, axis=0, ddof=1) / np.sqrt(SEEDS)
        off = (np.mean(values, axis=0) - getattr(exact, name)) / error
        assert np.mean(off**2) < 3.0, name  # 1.2 is expected of a t statistic with 11 degrees of freedom
    likelihoods = np.array([run.log_likelihood for run in runs])
    error = np.std(likelihoods, ddof=1) / np.sqrt(SEEDS)
    assert abs(np.mean(likelihoods) - exact.log_likelihood) < 5.0 * error
    assert np.std(likelihoods) < 2.0


def test_the_error_falls_with_the_square_root_of_the_number_of_particles(linear: ProcessModel) -> None:
    problem = task(linear, 20)
    exact = ekf(problem).track

    def error(particles: int) -> float:
        tracks = [particle_filter(problem, particles, np.random.default_rng(seed)).track for seed in range(SEEDS)]
        return float(np.sqrt(np.mean(((np.array(tracks) - exact) / np.std(exact, axis=0)) ** 2)))

    assert 2.0 < error(100) / error(1600) < 8.0  # 4 is expected


def test_the_same_random_stream_gives_the_same_result(linear: ProcessModel) -> None:
    problem = task(linear)
    first, again, other = (particle_filter(problem, 50, np.random.default_rng(seed)) for seed in (7, 7, 8))
    np.testing.assert_array_equal(first.track, again.track)
    assert not np.array_equal(first.track, other.track)


def test_missing_samples_have_no_innovation_and_are_not_counted(linear: ProcessModel) -> None:
    problem = task(linear)
    trace = particle_filter(problem, 50, np.random.default_rng(0))
    np.testing.assert_array_equal(np.isnan(trace.residuals), np.isnan(problem.measured))
    assert trace.count.tolist() == np.sum(np.isfinite(problem.measured), axis=0).tolist()


def test_particles_stay_within_the_physical_bounds(linear: ProcessModel) -> None:
    force = replace(linear.states[2], lower=0.0, upper=1.0)
    held = replace(linear, states=(*linear.states[:2], force))
    problem = task(held)
    trace = particle_filter(problem, 200, np.random.default_rng(0))
    low, high = force.scaled_bounds
    assert np.all((trace.track[:, 2] >= low) & (trace.track[:, 2] <= high))
    assert trace.mean[2] > low


def test_a_single_particle_and_a_robust_update_are_refused(linear: ProcessModel) -> None:
    with pytest.raises(HydrostateError, match="at least 2 particles, got 1"):
        particle_filter(task(linear), 1, np.random.default_rng(0))
    with pytest.raises(HydrostateError, match="no robust update, got robust 'huber'"):
        particle_filter(replace(task(linear), robust="huber"), 10, np.random.default_rng(0))


def test_the_seed_setting_determines_the_result(linear: ProcessModel) -> None:
    problem = task(linear)
    first, again, other = (
        METHODS["particle"](replace(problem, settings={"particles": 50.0, "seed": seed})) for seed in (7.0, 7.0, 8.0)
    )
    np.testing.assert_array_equal(first.track, again.track)
    assert not np.array_equal(first.track, other.track)
    drawn = particle_filter(problem, 50, np.random.default_rng(7))
    np.testing.assert_array_equal(first.track, drawn.track)  # every state of this model has process noise


def test_the_cloud_of_a_constant_collapses_without_a_random_walk(linear: ProcessModel) -> None:
    still = replace(task(linear, 200), noise=np.array([1e4, 1e2, 0.0]))
    alive, collapsed = (particle(replace(still, settings={"walk": walk})).track_variance[-1, 2] for walk in (0.1, 0.0))
    assert alive > 1e-3 * still.covariance[2, 2]
    assert collapsed < 0.1 * alive


def test_without_measurements_the_cloud_stays_the_prior_clipped_to_its_bounds(linear: ProcessModel) -> None:
    force = replace(linear.states[2], lower=0.0)
    problem = task(replace(linear, states=(*linear.states[:2], force)))
    blind = replace(problem, measured=np.full_like(problem.measured, np.nan), settings={"walk": 0.0})
    trace = particle(replace(blind, noise=np.array([*blind.noise[:2], 0.0])))
    m, s = blind.mean[2], np.sqrt(blind.covariance[2, 2])
    believed = m * norm.cdf(m / s) + s * norm.pdf(m / s)  # the part below zero is clipped to zero
    assert trace.mean[2] == pytest.approx(believed, abs=5.0 * s / np.sqrt(1000.0))
    assert trace.log_likelihood == 0.0


def test_invalid_settings_are_refused(linear: ProcessModel) -> None:
    for settings, message in (
        ({"particles": 1.5}, r"particles must be a whole number, 2 or more, got 1\.5"),
        ({"seed": -1.0}, r"seed must be a whole number, 0 or more, got -1\.0"),
        ({"count": 5.0}, "particle can be set particles, seed, walk, got 'count'"),
    ):
        with pytest.raises(HydrostateError, match=message):
            particle(replace(task(linear), settings=settings))


def test_prediction_weights_and_moments_of_a_cloud_equal_weighted_sums() -> None:
    rng = np.random.default_rng(5)
    cloud, weights = rng.standard_normal((40, 3)), rng.dirichlet(np.ones(40))
    seen, y, r = cloud[:, 1] - 0.3, 0.4, 0.05
    middle, s = predicted(weights, seen, r)
    assert middle == pytest.approx(np.average(seen, weights=weights))
    assert s == pytest.approx(r + np.cov(seen, aweights=weights, ddof=0))
    likely, after = weights * norm.pdf(y, seen, r**0.5), weights.copy()
    assert weigh(after, seen, y, r) == pytest.approx(np.log(likely.sum()))
    assert after == pytest.approx(likely / likely.sum())
    mean, covariance = np.empty(3), np.empty((3, 3))
    gather(cloud, weights, mean, covariance, WIDTH=3)
    assert mean == pytest.approx(weights @ cloud)
    assert covariance == pytest.approx(np.cov(cloud.T, aweights=weights, ddof=0))


@pytest.mark.parametrize("place", [0.0, 0.3, 0.999])
def test_resampling_draws_particles_in_proportion_to_their_weights(place: float) -> None:
    weights = np.random.default_rng(6).dirichlet(np.ones(25))
    cloud = np.arange(25.0)[:, None]
    resample(place, cloud, weights, np.empty_like(cloud))
    edges = np.cumsum(weights)
    wanted = np.minimum(np.searchsorted(edges, (place + np.arange(25)) / 25), 24)
    assert cloud[:, 0].tolist() == wanted.tolist()
    assert np.abs(np.bincount(wanted, minlength=25) - 25 * weights).max() < 1.0
