"""The unrolled covariance algebra is the matrix algebra."""

import numpy as np
import pytest

from estimation.algebra import EKF, predict_expressions, scaled_step, update_expressions
from estimation.eha import ACCELERATION_FORM, FORMS, PRESSURE_FORM
from estimation.ekf import ekf
from estimation.gaussian import Gaussian
from estimation.kernels import compile_filter, one_source
from estimation.model import ProcessModel
from estimation.run import run_filter
from plant.compiled.expression import ONE, ZERO, ordered
from plant.eha import EhaParameters
from plant.record import Record


def test_bulk_modulus_is_a_constant_row_that_costs_nothing() -> None:
    moved, slopes = scaled_step(PRESSURE_FORM)
    assert moved[3].operation == "symbol"
    assert all(slope is ZERO for slope in slopes[3][:3])
    assert slopes[3][3] is ONE


@pytest.mark.parametrize("model", FORMS.values(), ids=FORMS)
def test_predict_and_update_give_every_mean_and_the_upper_triangle(model: ProcessModel) -> None:
    n = model.width
    wanted = {f"z{i}" for i in range(n)} | {f"P{i}_{j}" for i in range(n) for j in range(i, n)}
    assert set(predict_expressions(model)) == wanted
    assert set(update_expressions(model, ("position_m",))) == wanted | {"e0", "s0"}


def test_no_update_divides_more_often_than_it_has_channels() -> None:
    channels = ("position_m", "velocity_m_s", "differential_pressure_pa")
    items = ordered(update_expressions(PRESSURE_FORM, channels).values())
    assert sum(item.operation == "/" for item in items) == len(channels)


def test_a_kernel_is_straight_lines_within_samples_and_sub_steps() -> None:
    source = one_source(EKF, ACCELERATION_FORM, ("position_m", "velocity_m_s"))
    assert source.count("for ") == 2
    assert "np.linalg" not in source


def test_the_same_model_and_channels_are_compiled_once() -> None:
    channels = ("position_m", "velocity_m_s")
    assert compile_filter(EKF, PRESSURE_FORM, channels) is compile_filter(EKF, PRESSURE_FORM, channels)


def test_the_order_of_channels_does_not_change_the_belief(linear: ProcessModel) -> None:
    rng = np.random.default_rng(0)
    root = 1e-2 * rng.normal(size=(3, 3))
    prior = Gaussian(np.zeros(3), root @ root.T)
    record = Record(1e-2, {n: rng.normal(size=50) for n in ("motor_speed_rad_s", "position_m", "velocity_m_s")})
    variances = {"position_m": 1e-4, "velocity_m_s": 1e-2}
    forth, back = (
        run_filter(ekf, linear, prior, record, EhaParameters(), channels=channels, variances=variances).belief
        for channels in (("position_m", "velocity_m_s"), ("velocity_m_s", "position_m"))
    )
    np.testing.assert_allclose(forth.mean, back.mean, rtol=1e-9)
    np.testing.assert_allclose(forth.covariance, back.covariance, rtol=1e-9)
