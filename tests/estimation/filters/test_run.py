"""`run_filter` scales, sub-steps, fills gaps, returns SI units, and reports what it cannot use."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from estimation.engine.contract import Method
from estimation.filters.ekf import ekf
from estimation.filters.methods import METHODS
from estimation.filters.run import Estimate, available_channels, run_filter
from estimation.log_checks.first_belief import first_belief
from estimation.models.eha_forms import ACCELERATION_FORM, FORMS, PRESSURE_FORM
from estimation.models.gaussian import Gaussian
from estimation.models.model import ProcessModel, StateVariable
from plant.compiled.functions import Scalar
from plant.eha.drives import sine
from plant.eha.model import EhaParameters, EhaValues
from plant.eha.simulate import LUMPED, simulate
from plant.errors import LogError
from plant.log.record import Record
from plant.sensors.sensors import BENCH

RIG = EhaParameters()
ALL = ("position_m", "velocity_m_s", "differential_pressure_pa")


@pytest.fixture(scope="module")
def record() -> Record:
    drive = sine(1.0, 1e-3, RIG.rated_speed, 2.0)
    return simulate(LUMPED, drive, 1e-3, RIG, sensors=BENCH, rng=np.random.default_rng(0))


def filtered(record: Record, model: ProcessModel = PRESSURE_FORM, **options: object) -> Estimate:
    prior = first_belief(model, record, 2e8, 3e8)
    return run_filter(ekf, model, prior, record, RIG, **options)


def test_the_channels_used_are_those_that_the_model_predicts_and_the_log_has(record: Record) -> None:
    assert available_channels(PRESSURE_FORM, record) == ALL
    assert available_channels(ACCELERATION_FORM, record) == ALL[:2]
    assert available_channels(PRESSURE_FORM, record.replace(position_m=None)) == ("velocity_m_s", *ALL[2:])


def test_a_log_without_any_channel_that_the_model_predicts_is_refused_with_their_names(record: Record) -> None:
    bare = record.replace(position_m=None, velocity_m_s=None, differential_pressure_pa=None)
    with pytest.raises(
        LogError,
        match="pressure form needs position_m or velocity_m_s or differential_pressure_pa, the record has motor",
    ):
        filtered(bare)


def test_the_result_does_not_depend_on_the_scale_of_the_states(record: Record, linear: ProcessModel) -> None:
    other = tuple(replace(state, scale=7.0 * state.scale) for state in linear.states)
    plain, scaled = (
        run_filter(ekf, model, Gaussian(np.zeros(3), np.eye(3)), record, RIG)
        for model in (linear, replace(linear, name="linear_rescaled", states=other))
    )
    np.testing.assert_allclose(scaled.belief.mean, plain.belief.mean, rtol=1e-9)
    np.testing.assert_allclose(scaled.belief.covariance, plain.belief.covariance, rtol=1e-8)
    assert scaled.log_likelihood == pytest.approx(plain.log_likelihood, rel=1e-9)


def test_a_thinned_track_keeps_the_times_of_its_samples(record: Record, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = filtered(record.slice(100))
    np.testing.assert_allclose(whole.time, record.time[100:])
    monkeypatch.setattr("estimation.filters.run.TRACK_ROWS", 225)
    thinned = filtered(record.slice(100))
    np.testing.assert_allclose(thinned.time, record.time[100::4])
    np.testing.assert_array_equal(thinned.mean, whole.mean[::4])


def test_innovations_are_kept_only_when_asked_for(record: Record) -> None:
    assert filtered(record).residuals.shape == (0, 3)
    assert filtered(record, keep_innovations=True).residuals.shape == (1000, 3)


def test_the_given_noise_of_a_state_replaces_that_of_the_model(record: Record) -> None:
    same = filtered(record, noise={"velocity_m_s": 1e-2})
    quieter = filtered(record, noise={"velocity_m_s": 1e-6})
    np.testing.assert_array_equal(same.belief.mean, filtered(record).belief.mean)
    assert quieter.belief.std[1] < 0.5 * same.belief.std[1]


def test_gaps_in_the_drive_are_bridged(record: Record) -> None:
    speed = record["motor_speed_rad_s"].copy()
    speed[500:503] = np.nan
    bridged = filtered(record.replace(motor_speed_rad_s=speed))
    np.testing.assert_allclose(bridged.belief.mean, filtered(record).belief.mean, rtol=1e-3, atol=1e-6)


def test_the_settled_value_is_the_mean_of_the_last_fifth(record: Record) -> None:
    estimate = filtered(record)
    mean, std = estimate.track("bulk_modulus_pa")
    assert estimate.settled("bulk_modulus_pa") == (pytest.approx(np.mean(mean[-200:])), std[-1])
    assert estimate.settled("bulk_modulus_pa", 1.0)[0] == pytest.approx(np.mean(mean))


def test_an_unknown_state_is_refused_and_the_known_ones_are_listed(record: Record) -> None:
    with pytest.raises(KeyError, match="pressure has no state 'viscosity', it has"):
        filtered(record).track("viscosity")


def test_neither_record_nor_prior_is_changed(record: Record) -> None:
    before = {name: record[name].copy() for name in record}
    prior = first_belief(PRESSURE_FORM, record, 2e8, 3e8)
    run_filter(ekf, PRESSURE_FORM, prior, record, RIG)
    for name, values in before.items():
        np.testing.assert_array_equal(record[name], values)
    assert prior.mean[3] == 2e8


@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
def test_an_estimate_at_its_bound_does_not_exceed_it(method: Method, record: Record, linear: ProcessModel) -> None:
    force = replace(linear.states[2], lower=-0.02, upper=0.02)
    model = replace(linear, name="linear_held", states=(*linear.states[:2], force))
    estimate = run_filter(method, model, Gaussian(np.zeros(3), np.eye(3)), record, RIG)
    found, _ = estimate.track("force_n")
    assert np.max(found) == pytest.approx(0.02, rel=1e-15)
    assert np.min(found) == pytest.approx(-0.02, rel=1e-15)


def _explode(state: tuple[Scalar, ...], speeds: tuple[Scalar, Scalar], p: EhaValues, h: Scalar) -> tuple[Scalar, ...]:
    del speeds, p, h
    return (state[0] + 1e6 * state[0] ** 3,)


def _observe(state: tuple[Scalar, ...], p: EhaValues) -> Mapping[str, Scalar]:
    del p
    return {"position_m": state[0]}


def test_the_track_of_a_diverged_filter_is_not_finite() -> None:
    states = (StateVariable("position_m", "m", 1.0, 0.0),)
    model = ProcessModel("explosive", states, _explode, _observe, 2.5e-4, parameters=EhaParameters)
    record = Record(1e-3, {"motor_speed_rad_s": np.zeros(50), "position_m": np.full(50, np.nan)})
    prior = Gaussian(np.ones(1), np.eye(1))
    estimate = run_filter(ekf, model, prior, record, RIG, variances={"position_m": 1.0})
    assert not np.isfinite(estimate.settled("position_m")[0])


def test_forms_are_registered_under_their_names() -> None:
    assert {name: model.name for name, model in FORMS.items()} == {name: name for name in FORMS}
