"""A bank holds the nine conditions, and its mathematical models predict the plant."""

from dataclasses import replace

import numpy as np
import pytest

from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.rmse import score_mathematical
from faults.eha import bank
from faults.eha.bank import (
    IDENTIFICATION_TIME,
    identification_run,
    identify_bank,
    mathematical_bank,
    predict_run,
    predict_runs,
)
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, LUMPED, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH, IDEAL, drop_samples

RIG = EhaParameters()


def run_of(parameters: EhaParameters) -> Record:
    drive = make_drive("steps", 2.0, 1e-3, parameters, np.random.default_rng(0))
    return simulate(LUMPED, drive, 1e-3, parameters)


def test_the_mathematical_bank_is_the_nine_conditions_of_the_rig() -> None:
    other = replace(RIG, piston_area=3.04e-3)
    found = mathematical_bank(other)
    assert list(found) == list(CONDITIONS)
    assert all(found[name] == parameters_for(condition, other) for name, condition in CONDITIONS.items())


def test_the_bank_of_a_rig_is_cached() -> None:
    assert mathematical_bank(RIG) is mathematical_bank(EhaParameters())


def test_shorter_integration_steps_hardly_change_the_error_of_a_model(monkeypatch: pytest.MonkeyPatch) -> None:
    p = parameters_for(CONDITIONS["minor_friction"])
    drive = make_drive("prbs", 4.0, 1e-3, p, np.random.default_rng(3))
    record = simulate(CIRCUIT, drive, 1e-3, p, sensors=BENCH, rng=np.random.default_rng(4))
    usual = score_mathematical(record, mathematical_bank(RIG)).by_condition
    monkeypatch.setattr(bank, "STEP", 1e-4)
    assert usual == pytest.approx(score_mathematical(record, mathematical_bank(RIG)).by_condition, rel=3e-4)


def test_a_prediction_equals_the_simulated_run() -> None:
    record = run_of(RIG)
    for channel, predicted in predict_run(record, RIG).items():
        np.testing.assert_allclose(predicted, record[channel], atol=1e-3 * np.max(np.abs(record[channel])))


def test_a_prediction_needs_only_the_drive_and_bridges_its_gaps() -> None:
    record = run_of(RIG)
    bare = Record(record.sample_time, {"motor_speed_rad_s": record["motor_speed_rad_s"]})
    gappy = drop_samples(bare, 0.02, np.random.default_rng(1))
    whole, bridged = predict_run(bare, RIG), predict_run(gappy, RIG)
    for channel, values in whole.items():
        assert np.all(np.isfinite(bridged[channel]))
        np.testing.assert_allclose(bridged[channel], values, atol=0.2 * np.max(np.abs(values)))


def test_joint_predictions_equal_those_of_each_model_alone() -> None:
    record, models = run_of(RIG), mathematical_bank(RIG)
    found = predict_runs(record, models)
    assert list(found) == list(models)
    for name, channels in found.items():
        for channel, values in predict_run(record, models[name]).items():
            np.testing.assert_allclose(channels[channel], values, atol=1e-9 * np.max(np.abs(values)))


@pytest.mark.parametrize("name", CONDITIONS)
def test_an_identification_run_has_4_volts_of_either_sign_in_its_condition(name: str) -> None:
    record = identification_run(RIG, CONDITIONS[name], np.random.default_rng(3), sensors=IDEAL, duration=2.0)
    assert record.sample_time == IDENTIFICATION_TIME
    assert set(np.round(record["motor_speed_rad_s"], 6)) == {-125.663706, 125.663706}
    assert record.metadata["parameters"]["leakage_coefficient"] == mathematical_bank(RIG)[name].leakage_coefficient


@pytest.mark.slow
def test_identification_of_every_condition_is_reproducible_from_a_seed() -> None:
    bank, again = (identify_bank(RIG, np.random.default_rng(5), duration=10.0) for _ in range(2))
    assert list(bank) == list(CONDITIONS)
    for name, model in bank.items():
        assert model.sample_time == IDENTIFICATION_TIME
        np.testing.assert_array_equal(model.numerator, again[name].numerator)
        np.testing.assert_array_equal(model.denominator, again[name].denominator)
