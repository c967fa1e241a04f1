"""The propagated derivatives of the innovations agree with high-order differences, for every form."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from estimation.engine.contract import FilterProblem
from estimation.engine.kalman import belief_names
from estimation.engine.layout import layout
from estimation.engine.runner import constant_row
from estimation.filters.ekf import EKF, ekf
from estimation.filters.run import filter_problem
from estimation.log_checks.first_belief import first_belief
from estimation.models.eha_forms import ACCELERATION_FORM, PRESSURE_FORM
from estimation.models.gaussian import Gaussian
from estimation.models.model import ProcessModel
from estimation.tuning import sensitivity
from estimation.tuning.scoring import problem_with
from estimation.tuning.sensitivity import innovation_sensitivity
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH, drop_samples
from tests.estimation.tuning.likelihood_fit import LUMPED_FORM
from tests.kernels import functions_of, text_of

RIG = EhaParameters()
MOVED = ("bulk_modulus", "leakage_coefficient", "flow_bias", "friction_coulomb", "moving_mass", "q1", "q2", "r0", "r1")
EVERY_FORM = pytest.mark.parametrize("model", [LUMPED_FORM, PRESSURE_FORM, ACCELERATION_FORM], ids=lambda m: m.name)


def task(model: ProcessModel) -> FilterProblem:
    rng = np.random.default_rng(3)
    speed = make_drive("steps", 0.6, 1e-3, RIG, rng)
    record = simulate(LUMPED, speed, 1e-3, RIG, sensors=BENCH, rng=rng)
    record = drop_samples(record, 0.05, rng, ["position_m", "velocity_m_s"])
    return filter_problem(model, first_belief(model, record, 1.9e8, 1e8), record, RIG)


def central(value: Callable[[float], float], step: float) -> float:
    """Return the derivative at 0 by the eighth-order central difference."""
    weights = (4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0)
    pairs = (weight * (value(k * step) - value(-k * step)) for k, weight in enumerate(weights, start=1))
    return sum(pairs) / step


@pytest.mark.slow
@EVERY_FORM
def test_the_gradient_of_the_likelihood_is_exact(model: ProcessModel) -> None:
    problem = task(model)
    names, row = layout(EKF, model, problem.channels).rows, constant_row(problem, {})
    places = [names.index(name) for name in MOVED]
    directions = np.zeros((len(row), len(MOVED)))
    directions[places, range(len(MOVED))] = row[places]
    gradient = innovation_sensitivity(problem, directions).scores.sum(axis=0)
    for k, place in enumerate(places):

        def likelihood(u: float, place: int = place) -> float:
            moved = row.copy()
            moved[place] *= np.exp(u)
            return ekf(problem_with(problem, moved)).log_likelihood

        # the likelihood of the lumped form jumps within 2e-5 of these parameters, and not within 1e-5
        assert gradient[k] == pytest.approx(central(likelihood, 2e-6), rel=1e-5, abs=1e-4), MOVED[k]


@pytest.mark.slow
def test_the_gradient_with_respect_to_the_prior_is_exact() -> None:
    problem = task(PRESSURE_FORM)
    belief = np.zeros((len(belief_names(4)), 2))
    belief[3, 0] = 1.0
    belief[belief_names(4).index("P3_3"), 1] = problem.covariance[3, 3]
    rows = np.zeros((len(layout(EKF, PRESSURE_FORM, problem.channels).rows), 2))
    gradient = innovation_sensitivity(problem, rows, belief).scores.sum(axis=0)

    def moved_mean(u: float) -> float:
        return ekf(replace(problem, mean=problem.mean + u * np.array([0.0, 0.0, 0.0, 1.0]))).log_likelihood

    def moved_variance(u: float) -> float:
        factor = np.diag([0.0, 0.0, 0.0, problem.covariance[3, 3] * np.expm1(u)])
        return ekf(replace(problem, covariance=problem.covariance + factor)).log_likelihood

    assert gradient[0] == pytest.approx(central(moved_mean, 2e-5), rel=1e-5)
    assert gradient[1] == pytest.approx(central(moved_variance, 1e-3), rel=1e-5)


@pytest.mark.parametrize(
    "model",
    [pytest.param(LUMPED_FORM, marks=pytest.mark.slow), PRESSURE_FORM, ACCELERATION_FORM],
    ids=lambda m: m.name,
)
def test_the_innovations_are_those_of_the_filter(model: ProcessModel) -> None:
    problem = task(model)
    none = np.zeros((len(layout(EKF, model, problem.channels).rows), 0))
    found, filtered = innovation_sensitivity(problem, none), ekf(replace(problem, keep_innovations=True))
    deviations = np.sqrt(filtered.residual_variances)
    np.testing.assert_allclose(found.residuals / deviations, filtered.residuals / deviations, rtol=1e-9, atol=1e-10)
    np.testing.assert_allclose(found.variances, filtered.residual_variances, rtol=1e-9)
    assert found.log_likelihood == pytest.approx(filtered.log_likelihood, rel=1e-12)


def test_the_information_is_the_covariance_of_the_scores() -> None:
    problem = task(LUMPED_FORM)
    names, row = layout(EKF, LUMPED_FORM, problem.channels).rows, constant_row(problem, {})
    directions = np.zeros((len(row), 2))
    for k, name in enumerate(("r1", "r2")):
        directions[names.index(name), k] = row[names.index(name)]
    found = innovation_sensitivity(problem, directions)
    drawn = np.random.default_rng(0).standard_normal(found.residuals.shape) * np.sqrt(found.variances)
    scores = found._replace(residuals=np.where(np.isnan(found.residuals), np.nan, drawn)).scores
    np.testing.assert_allclose(np.diag(scores.T @ scores), np.diag(found.information), rtol=0.25)


def test_the_loop_in_plain_python_gives_the_same_result_as_its_kernel(
    linear: ProcessModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng(4)
    seen = {name: rng.normal(size=6) for name in ("position_m", "velocity_m_s")}
    seen["velocity_m_s"][3] = np.nan
    record = Record(1e-3, {"motor_speed_rad_s": rng.normal(size=6), **seen})
    prior = Gaussian(np.array([0.1, -0.2, 0.5]), np.diag([1e-4, 1e-3, 1.0]))
    problem = filter_problem(linear, prior, record, RIG, variances={"position_m": 1e-2, "velocity_m_s": 0.1})
    directions = rng.normal(size=(len(constant_row(problem, {})), 2))
    compiled = innovation_sensitivity(problem, directions)
    compile_it = sensitivity._compile.__wrapped__
    kernel = functions_of(text_of(monkeypatch, sensitivity, lambda: compile_it(linear, problem.channels)))
    monkeypatch.setattr(sensitivity, "_compile", lambda *_: kernel)
    plain = innovation_sensitivity(problem, directions)
    for name in ("residuals", "variances", "residual_slopes", "variance_slopes"):
        np.testing.assert_array_equal(getattr(plain, name), getattr(compiled, name), err_msg=name)
