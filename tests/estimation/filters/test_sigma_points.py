"""Sigma-point filters agree with filterpy's, and with the Kalman filter on a linear model."""

from collections.abc import Mapping
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from filterpy.kalman import MerweScaledSigmaPoints, UnscentedKalmanFilter

from estimation.engine.contract import FilterProblem, Trace
from estimation.engine.linearised import compile_step
from estimation.filters.ckf import ckf
from estimation.filters.ekf import ekf
from estimation.filters.run import filter_problem, run_filter
from estimation.filters.ukf import ukf
from estimation.models.eha_forms import FORMS
from estimation.models.gaussian import Gaussian
from estimation.models.model import ProcessModel, StateVariable
from faults.conditions import CONDITIONS, Condition, parameters_for
from plant.arrays import Array
from plant.compiled.functions import Scalar, sqrt
from plant.eha.drives import sine
from plant.eha.model import PARAMETER_NAMES, EhaParameters, EhaValues
from plant.eha.simulate import LUMPED, REDUCED, simulate
from plant.errors import HydrostateError
from plant.log.record import Record
from plant.sensors.sensors import BENCH

STEPS = 5_000
RIG = EhaParameters()


def task(form: str, parameters: EhaParameters, samples: int = STEPS) -> FilterProblem:
    plant = {"acceleration": REDUCED, "pressure": LUMPED}[form]
    drive = sine(samples * 1e-4, 1e-4, parameters.rated_speed, 4.0)
    record = simulate(plant, drive, 1e-4, parameters, sensors=BENCH, rng=np.random.default_rng(2))
    third = {"acceleration": 10.0, "pressure": 1e5}[form]
    prior = Gaussian(np.array([0.0, 0.0, 0.0, 2e8]), np.diag([1e-5, 1e-3, third, 3e8]) ** 2)
    return filter_problem(FORMS[form], prior, record, parameters)


def filterpy_ukf(problem: FilterProblem, alpha: float, beta: float, kappa: float) -> tuple[Array, Array, Trace]:
    """Return means, variances and end of filterpy's filter; the model is evaluated at physical states only."""
    model, n, m = problem.model, problem.model.width, len(problem.channels)
    lower, upper = np.array([state.scaled_bounds for state in model.states]).T
    step, h = compile_step(model).step, problem.sample_time
    parameters = SimpleNamespace(**dict(zip(PARAMETER_NAMES, problem.parameters, strict=True)))
    units = [tuple(s.scale if j == i else 0.0 for j in range(n)) for i, s in enumerate(model.states)]
    H = np.array([[model.observe(unit, parameters)[channel] for unit in units] for channel in problem.channels])
    H /= np.sqrt(problem.variances)[:, None]

    def moved(z: Array, dt: float, before: Array, after: Array) -> Array:
        result, _ = step(np.clip(z, lower, upper), before, after, problem.parameters, dt)
        result[-1] = z[-1]  # bulk modulus is passed through
        return result

    points = MerweScaledSigmaPoints(n, alpha, beta, kappa)
    kalman = UnscentedKalmanFilter(n, m, h, lambda z: H @ z, moved, points)
    kalman.x, kalman.P, kalman.R = problem.mean.copy(), problem.covariance.copy(), np.eye(m)
    kalman.Q = np.diag(problem.noise) * h
    means, variances = np.empty((len(problem.measured), n)), np.empty((len(problem.measured), n))
    for k, y in enumerate(problem.measured):
        if k:
            kalman.predict(before=problem.drives[k - 1], after=problem.drives[k])
        kalman.x = np.clip(kalman.x, lower, upper)
        kalman.sigmas_f = points.sigma_points(kalman.x, kalman.P)
        kalman.update(y / np.sqrt(problem.variances))
        kalman.x = np.clip(kalman.x, lower, upper)
        means[k], variances[k] = kalman.x, np.diag(kalman.P)
    return means, variances, kalman


def assert_agrees(problem: FilterProblem, ours: Trace, alpha: float, beta: float, kappa: float) -> None:
    means, variances, theirs = filterpy_ukf(problem, alpha, beta, kappa)
    np.testing.assert_allclose(ours.track, means[:: problem.every], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(ours.track_variance, variances[:: problem.every], rtol=1e-9)
    deviations = np.sqrt(np.outer(np.diag(theirs.P), np.diag(theirs.P)))
    np.testing.assert_allclose(ours.covariance / deviations, theirs.P / deviations, rtol=0.0, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("condition", CONDITIONS.values(), ids=CONDITIONS)
@pytest.mark.parametrize("form", FORMS)
def test_filterpys_unscented_filter_agrees_over_5000_steps(form: str, condition: Condition) -> None:
    problem = task(form, parameters_for(condition))
    assert_agrees(problem, ukf(problem), 1.0, 2.0, 0.0)


@pytest.mark.parametrize("form", FORMS)
def test_filterpys_unscented_filter_agrees_with_other_settings(form: str) -> None:
    problem = replace(task(form, RIG, 400), settings={"alpha": 0.7, "beta": 1.5, "kappa": 1.0})
    assert_agrees(problem, ukf(problem), 0.7, 1.5, 1.0)


@pytest.mark.parametrize("form", FORMS)
def test_the_cubature_filter_equals_the_unscented_filter_with_alpha_1_beta_0_and_kappa_0(form: str) -> None:
    problem = task(form, RIG, 400)
    assert_agrees(problem, ckf(problem), 1.0, 0.0, 0.0)


def _roundabout_step(
    state: tuple[Scalar, ...], speeds: tuple[Scalar, Scalar], p: EhaValues, h: Scalar
) -> tuple[Scalar, ...]:
    """The step of the fixture's linear model, with each product of a state written so that it does not look linear."""
    del p
    x, v, force = state
    push = 0.01 * (speeds[0] + speeds[1])
    v_again = (v * v + v) / (v + 1.0)
    force_again = (force * (force * force + 1.0)) / (force * force + 1.0)
    return x + h * v_again, v + h * (push + force_again - 3.0 * v_again), force


def noisy_record(samples: int = 300) -> Record:
    rng = np.random.default_rng(5)
    names = ("motor_speed_rad_s", "position_m", "velocity_m_s")
    return Record(0.01, {name: rng.normal(size=samples) for name in names})


PRIOR = Gaussian(np.array([0.1, -0.2, 0.5]), np.diag([1e-4, 1e-2, 1.0]))
VARIANCES = {"position_m": 1e-2, "velocity_m_s": 1e-1}


@pytest.mark.parametrize("method", [ukf, ckf])
@pytest.mark.parametrize("robust", ["none", "student-t"])
def test_on_a_linear_model_sigma_points_equal_the_kalman_filter(
    linear: ProcessModel, method: object, robust: str
) -> None:
    kalman, sigma = (
        run_filter(one, linear, PRIOR, noisy_record(), RIG, variances=VARIANCES, robust=robust) for one in (ekf, method)
    )
    np.testing.assert_allclose(sigma.mean, kalman.mean, rtol=1e-9)
    np.testing.assert_allclose(sigma.belief.covariance, kalman.belief.covariance, rtol=1e-9)
    assert sigma.log_likelihood == pytest.approx(kalman.log_likelihood, rel=1e-9)


@pytest.mark.parametrize("method", [ukf, ckf])
def test_on_a_linear_model_in_nonlinear_notation_sigma_points_equal_the_kalman_filter(
    linear: ProcessModel, method: object
) -> None:
    roundabout = replace(linear, name="roundabout", step=_roundabout_step)
    kalman = run_filter(ekf, linear, PRIOR, noisy_record(), RIG, variances=VARIANCES)
    sigma = run_filter(method, roundabout, PRIOR, noisy_record(), RIG, variances=VARIANCES)
    np.testing.assert_allclose(sigma.mean, kalman.mean, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(sigma.belief.covariance, kalman.belief.covariance, rtol=1e-9)
    assert sigma.log_likelihood == pytest.approx(kalman.log_likelihood, rel=1e-9)


def _still(state: tuple[Scalar, ...], speeds: tuple[Scalar, Scalar], p: EhaValues, h: Scalar) -> tuple[Scalar, ...]:
    del speeds, p, h
    return state


def _square(state: tuple[Scalar, ...], p: EhaValues) -> Mapping[str, Scalar]:
    del p
    return {"position_m": state[0] * state[0]}


def test_a_squared_gaussian_is_predicted_with_its_exact_mean_and_variance() -> None:
    model = ProcessModel(
        "square", (StateVariable("position_m", "m", 0.1, 0.0),), _still, _square, 1.0, parameters=EhaParameters
    )
    record = Record(1e-3, {"motor_speed_rad_s": np.zeros(1), "position_m": np.array([2.0])})
    estimate = run_filter(
        ukf,
        model,
        Gaussian(np.array([1.5]), np.array([[0.25]])),
        record,
        RIG,
        variances={"position_m": 0.01},
        keep_innovations=True,
        settings={"alpha": 1.0, "beta": 0.0, "kappa": 2.0},  # the points then have a Gaussian's fourth moment
    )
    assert estimate.residuals[0, 0] == pytest.approx(2.0 - (1.5**2 + 0.25), rel=1e-12)
    assert estimate.residual_variances[0, 0] == pytest.approx(4.0 * 1.5**2 * 0.25 + 2.0 * 0.25**2 + 0.01, rel=1e-12)


def _root_step(state: tuple[Scalar, ...], speeds: tuple[Scalar, Scalar], p: EhaValues, h: Scalar) -> tuple[Scalar, ...]:
    del speeds, p, h
    return (sqrt(state[0]),)


def _first(state: tuple[Scalar, ...], p: EhaValues) -> Mapping[str, Scalar]:
    del p
    return {"position_m": state[0]}


def test_sigma_points_are_clipped_to_physical_states_before_the_model_is_evaluated() -> None:
    state = StateVariable("position_m", "m", 1.0, 0.0, lower=0.0)
    model = ProcessModel("root", (state,), _root_step, _first, 1.0, parameters=EhaParameters)
    record = Record(1e-3, {"motor_speed_rad_s": np.zeros(2), "position_m": np.full(2, np.nan)})
    prior = Gaussian(np.array([0.1]), np.array([[1.0]]))  # the lower point is far below zero
    estimate = run_filter(ckf, model, prior, record, RIG, variances={"position_m": 1.0})
    assert estimate.belief.mean[0] == pytest.approx(0.5 * np.sqrt(1.1), rel=1e-12)


def test_unknown_settings_and_a_kappa_that_leaves_no_spread_of_points_are_refused() -> None:
    problem = task("acceleration", RIG, 10)
    with pytest.raises(HydrostateError, match="ukf can be set alpha, beta, kappa, got 'gamma'"):
        ukf(replace(problem, settings={"gamma": 1.0}))
    with pytest.raises(HydrostateError, match="ckf can be set nothing, got 'alpha'"):
        ckf(replace(problem, settings={"alpha": 1.0}))
    with pytest.raises(HydrostateError, match="kappa must be above -4"):
        ukf(replace(problem, settings={"kappa": -4.0}))
