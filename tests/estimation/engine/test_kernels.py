"""The unrolled covariance algebra equals the matrix algebra."""

import numpy as np
import pytest

from estimation.engine.kalman import scaled_step
from estimation.engine.kernels import LANES, compile_kernel, kernel_source
from estimation.engine.layout import full_sample_update, halves_of, step_at_sample, with_missing_counted
from estimation.engine.rule import Rule
from estimation.filters.ekf import EKF, ekf, ekf_predict, ekf_update
from estimation.filters.run import run_filter
from estimation.filters.ukf import UKF
from estimation.models.eha_forms import ACCELERATION_FORM, FORMS, PRESSURE_FORM
from estimation.models.gaussian import Gaussian
from estimation.models.model import ProcessModel
from plant.compiled.expression import ONE, ZERO, ordered
from plant.compiled.source import symbols_in
from plant.eha.model import EhaParameters
from plant.log.record import Record
from tests.kernels import computed

CHANNELS = ("position_m", "velocity_m_s")


def test_the_constant_bulk_modulus_has_a_unit_row_in_the_jacobian() -> None:
    moved, slopes = scaled_step(PRESSURE_FORM)
    assert moved[3].operation == "symbol"
    assert all(slope is ZERO for slope in slopes[3][:3])
    assert slopes[3][3] is ONE


@pytest.mark.parametrize("model", FORMS.values(), ids=FORMS)
def test_predict_and_update_give_every_mean_and_the_upper_triangle(model: ProcessModel) -> None:
    n = model.width
    wanted = {f"z{i}" for i in range(n)} | {f"P{i}_{j}" for i in range(n) for j in range(i, n)}
    assert set(ekf_predict(model)) == wanted
    assert set(ekf_update(model, ("position_m",))) == wanted | {"e0", "s0"}


def test_no_update_divides_more_often_than_it_has_channels() -> None:
    channels = ("position_m", "velocity_m_s", "differential_pressure_pa")
    items = ordered(halves_of(EKF, PRESSURE_FORM, channels).update.values())
    assert sum(item.operation == "/" for item in items) == len(channels)


def test_one_filter_and_many_have_the_same_branch_free_kernel_source() -> None:
    one, many = (kernel_source(EKF, ACCELERATION_FORM, CHANNELS, lanes) for lanes in (1, LANES))
    lines = one.split("def prepare(")[1].split("SLOTS = ")[0]
    assert lines == many.split("def prepare(")[1].split("SLOTS = ")[0]
    assert not {"for", "if", "while"} & set(lines.split())


def test_an_update_with_all_channels_present_checks_for_no_missing_sample() -> None:
    update = with_missing_counted(halves_of(EKF, ACCELERATION_FORM, CHANNELS).update)
    whole = full_sample_update(update)
    assert update.keys() - whole.keys() == {"count0", "count1"}
    assert "present" in {item.operation for item in ordered(update.values())}
    assert "present" not in {item.operation for item in ordered(whole.values())}


@pytest.mark.parametrize("rule", [EKF, UKF], ids=lambda rule: rule.name)
@pytest.mark.parametrize("model", FORMS.values(), ids=FORMS)
def test_a_step_that_begins_at_a_sample_equals_the_first_sub_step(model: ProcessModel, rule: Rule) -> None:
    predict, rng = halves_of(rule, model, CHANNELS).predict, np.random.default_rng(3)
    begins = step_at_sample(predict)
    assert "j" in symbols_in(list(predict.values()))
    assert "j" not in symbols_in(list(begins.values()))
    values = {name: rng.uniform(0.5, 2.0) for name in symbols_in(list(predict.values()))}
    # small, so that the covariance has a root
    values |= {name: 0.1 for name in values if name[0] == "P" and name[1] != name[3]}
    assert computed(begins, **values) == computed(predict, **{**values, "j": 0.0})


def test_the_same_model_and_channels_are_compiled_once() -> None:
    assert compile_kernel(EKF, PRESSURE_FORM, CHANNELS) is compile_kernel(EKF, PRESSURE_FORM, CHANNELS)


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
