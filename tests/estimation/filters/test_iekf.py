"""The iterated filter is the plain one if the sensors are linear, and otherwise finds the most probable state."""

from collections.abc import Mapping

import numpy as np
import pytest
from scipy.optimize import minimize

from estimation.engine.contract import Method
from estimation.engine.rule import weighing
from estimation.filters.ekf import EKF, ekf
from estimation.filters.iekf import IEKF, iekf
from estimation.filters.run import Estimate, run_filter
from estimation.models.eha_forms import FORMS
from estimation.models.gaussian import Gaussian
from estimation.models.model import ProcessModel, StateVariable
from plant.arrays import Array
from plant.compiled.functions import Scalar, sqrt
from plant.eha.model import EhaParameters, EhaValues
from plant.log.record import Record

CHANNELS = ("position_m", "velocity_m_s")
PRIOR = Gaussian(np.array([0.5, 2.0]), np.array([[1.0, 0.3], [0.3, 1.0]]))
VARIANCES = {"position_m": 1e-2, "velocity_m_s": 4e-2}
MEASURED = np.array([2.2, 0.4])


def _still(state: tuple[Scalar, ...], speeds: tuple[Scalar, Scalar], p: EhaValues, h: Scalar) -> tuple[Scalar, ...]:
    del speeds, p, h
    return state


def _range_and_product(state: tuple[Scalar, ...], p: EhaValues) -> Mapping[str, Scalar]:
    del p
    return {"position_m": sqrt(state[0] ** 2 + state[1] ** 2), "velocity_m_s": state[0] * state[1]}


BENT = ProcessModel(
    "bent",
    (StateVariable("position_m", "m", 0.5, 0.0), StateVariable("velocity_m_s", "m/s", 2.0, 0.0)),
    _still,
    _range_and_product,
    1.0,
    parameters=EhaParameters,
)


def updated(method: Method, measured: Array, robust: str = "none") -> Estimate:
    channels = {name: measured[i : i + 1] for i, name in enumerate(CHANNELS)}
    record = Record(1e-3, {"motor_speed_rad_s": np.zeros(1), **channels})
    return run_filter(method, BENT, PRIOR, record, EhaParameters(), variances=VARIANCES, robust=robust)


def most_probable() -> Array:
    def cost(state: Array) -> float:
        predicted = np.array([np.hypot(*state), np.prod(state)])
        off = state - PRIOR.mean
        return float(off @ np.linalg.solve(PRIOR.covariance, off) + np.sum((MEASURED - predicted) ** 2 / [1e-2, 4e-2]))

    return minimize(cost, PRIOR.mean, method="Nelder-Mead", options={"xatol": 1e-12, "fatol": 1e-15}).x


@pytest.mark.parametrize("robust", ["none", "huber"])
@pytest.mark.parametrize("model", FORMS.values(), ids=FORMS)
def test_with_linear_sensors_the_update_has_the_same_expressions_as_the_extended_filter(
    model: ProcessModel, robust: str
) -> None:
    plain, iterated = (weighing(rule, robust).update(model, CHANNELS) for rule in (EKF, IEKF))
    assert plain.keys() == iterated.keys()
    assert all(plain[name] is iterated[name] for name in plain)


def test_with_nonlinear_sensors_the_iterated_filter_finds_the_most_probable_state() -> None:
    found = updated(iekf, MEASURED).belief.mean
    np.testing.assert_allclose(found, most_probable(), rtol=2e-3)
    off = np.abs(updated(ekf, MEASURED).belief.mean - most_probable())
    assert np.max(off) > 20.0 * np.max(np.abs(found - most_probable()))


def test_innovations_are_computed_from_the_prediction() -> None:
    assert updated(iekf, MEASURED).log_likelihood == pytest.approx(updated(ekf, MEASURED).log_likelihood, rel=1e-12)


def test_missing_samples_leave_the_belief_unchanged() -> None:
    belief = updated(iekf, np.full(2, np.nan)).belief
    np.testing.assert_allclose(belief.mean, PRIOR.mean, rtol=1e-15)
    np.testing.assert_allclose(belief.covariance, PRIOR.covariance, rtol=1e-15)


def test_a_robust_update_reduces_the_effect_of_a_gross_outlier() -> None:
    outlier = np.array([40.0, 0.4])
    plain, robust = (updated(iekf, outlier, robust).belief.mean for robust in ("none", "student-t"))
    assert np.linalg.norm(robust) < 0.9 * np.linalg.norm(plain)


def test_weighting_without_robust_updates_returns_the_plain_rule() -> None:
    assert weighing(IEKF, "none") is IEKF
    assert IEKF.predict is EKF.predict
