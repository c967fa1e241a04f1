"""The model with the smallest error is that of the actuator's condition."""

from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from estimation.identification.model.linear_model import LinearModel
from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.rmse import Scores, measured_velocity, rmse, score_mathematical, score_transfer_functions
from faults.eha.bank import identify_bank, mathematical_bank
from faults.eha.inject import varied_actuator
from faults.scores import accuracy, confusion_matrix
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, simulate
from plant.errors import LogError
from plant.log.files import read_record
from plant.log.record import Record
from plant.sensors.sensors import BENCH, drop_samples

RIG = EhaParameters()
BANK = mathematical_bank(RIG)
DURATION = 10.0


@cache
def bench_log(name: str, seed: int, drive: str = "steps", varied: bool = False) -> Record:
    rng = np.random.default_rng(seed)
    parameters = parameters_for(CONDITIONS[name])
    if varied:
        parameters = varied_actuator(parameters, rng)
    speed = make_drive(drive, DURATION, 1e-3, parameters, rng)
    return simulate(LUMPED, speed, 1e-3, parameters, sensors=BENCH, rng=rng)


def share_found(seeds: range, *, varied: bool, pressure: bool = True, drive: str = "steps") -> float:
    true = [name for _ in seeds for name in CONDITIONS]
    logs = [bench_log(name, seed, drive, varied) for seed in seeds for name in CONDITIONS]
    found = [score_mathematical(log, BANK, pressure=pressure).condition for log in logs]
    return accuracy(confusion_matrix(true, found))


@pytest.mark.parametrize("drive", ["steps", "prbs"])
@pytest.mark.parametrize("pressure", [True, False], ids=["with pressure", "velocity alone"])
def test_at_nominal_parameters_all_nine_classes_are_found(drive: str, pressure: bool) -> None:
    assert share_found(range(1), varied=False, pressure=pressure, drive=drive) == 1.0


@pytest.mark.slow
@pytest.mark.parametrize("pressure", [True, False], ids=["with pressure", "velocity alone"])
def test_at_nominal_parameters_all_nine_classes_are_found_over_20_seeds(pressure: bool) -> None:
    assert share_found(range(20), varied=False, pressure=pressure) == 1.0


@pytest.mark.slow
@pytest.mark.parametrize("pressure", [True, False], ids=["with pressure", "velocity alone"])
def test_actuators_that_differ_by_ten_percent_are_still_classified(pressure: bool) -> None:
    assert share_found(range(20), varied=True, pressure=pressure) >= 0.95


@pytest.mark.parametrize("name", CONDITIONS)
def test_a_log_of_position_alone_is_enough(name: str) -> None:
    log = bench_log(name, 0).replace(velocity_m_s=None, differential_pressure_pa=None)
    scores = score_mathematical(log, BANK)
    assert scores.channels == ("velocity_m_s",)
    assert scores.condition == name


def test_missing_samples_do_not_count_against_a_condition() -> None:
    log = bench_log("minor_friction", 0)
    gappy = drop_samples(log, 0.05, np.random.default_rng(1), ["velocity_m_s", "differential_pressure_pa"])
    whole, thinned = score_mathematical(log, BANK), score_mathematical(gappy, BANK)
    assert thinned.condition == "minor_friction"
    np.testing.assert_allclose(thinned.table, whole.table, rtol=0.05)
    lost = drop_samples(log, 0.05, np.random.default_rng(1))
    assert score_mathematical(lost, BANK).condition == "minor_friction"


def test_a_position_with_gaps_still_gives_velocity() -> None:
    log = bench_log("normal", 0).replace(velocity_m_s=None)
    gappy = drop_samples(log, 0.05, np.random.default_rng(1), ["position_m"])
    difference = measured_velocity(gappy) - measured_velocity(log)
    assert np.sqrt(np.mean(difference**2)) < 1e-3


@pytest.mark.parametrize("sample_time", [1e-4, 1e-3, 1e-2, 2e-2])
def test_velocity_comes_from_position_at_any_sample_time(sample_time: float) -> None:
    time = sample_time * np.arange(round(1.0 / sample_time))
    log = Record(sample_time, {"motor_speed_rad_s": time, "position_m": 0.04 * time})
    np.testing.assert_allclose(measured_velocity(log), 0.04, rtol=1e-9)


def test_the_smallest_score_gives_the_condition_and_one_channel_can_be_scored_alone() -> None:
    scores = score_mathematical(bench_log("major_leakage", 0), BANK)
    assert scores.channels == ("velocity_m_s", "differential_pressure_pa")
    assert min(scores.by_condition, key=scores.by_condition.__getitem__) == scores.condition == "major_leakage"
    alone = scores.of_one("velocity_m_s")
    np.testing.assert_array_equal(alone.table["score"], scores.table["rmse_velocity_m_s"])
    assert alone.channels == ("velocity_m_s",)


def test_the_rmse_of_the_right_model_is_the_noise_of_the_sensor() -> None:
    table = score_mathematical(bench_log("normal", 0), BANK).table
    assert table.loc["normal", "rmse_velocity_m_s"] == pytest.approx(BENCH.velocity_noise, rel=0.05)
    assert table.loc["normal", "rmse_differential_pressure_pa"] == pytest.approx(BENCH.pressure_noise, rel=0.05)


def test_two_channels_are_weighted_by_their_own_size() -> None:
    log = bench_log("normal", 0)
    table = score_mathematical(log, BANK).table
    shares = [table[f"rmse_{c}"] / np.sqrt(np.mean(log[c] ** 2)) for c in ("velocity_m_s", "differential_pressure_pa")]
    np.testing.assert_allclose(table["score"], np.sqrt(0.5 * (shares[0] ** 2 + shares[1] ** 2)))


def test_a_channel_that_is_0_throughout_has_no_part_in_the_score() -> None:
    log = bench_log("normal", 0).slice(0, 200)
    still = np.zeros(len(log))
    table = score_mathematical(log.replace(differential_pressure_pa=still), BANK).table
    size = np.sqrt(np.mean(log["velocity_m_s"] ** 2))
    np.testing.assert_allclose(table["score"], table["rmse_velocity_m_s"] / size)
    nothing = log.replace(differential_pressure_pa=still, velocity_m_s=still)
    assert not score_mathematical(nothing, BANK).table["score"].any()


def test_a_log_without_motion_is_refused() -> None:
    bare = bench_log("normal", 0).replace(velocity_m_s=None, position_m=None)
    with pytest.raises(LogError, match="velocity_m_s or position_m is needed; the log has motor_speed_rad_s"):
        score_mathematical(bare, BANK)


def test_rmse_ignores_missing_samples() -> None:
    assert rmse(np.array([1.0, np.nan, 3.0]), np.array([0.0, 5.0, 4.0])) == 1.0


@pytest.fixture(scope="module")
def linear_bank() -> dict[str, LinearModel]:
    """Return discrete lags of different gain, in place of identified transfer functions."""
    return {
        name: LinearModel(
            np.array([0.0, 0.1 * gain]), np.array([1.0, -0.9]), 1e-3, "motor_speed_rad_s", "velocity_m_s", delay=1
        )
        for name, gain in (("normal", 3.4e-4), ("major_leakage", 1.8e-4))
    }


@pytest.mark.parametrize("sample_time", [1e-3, 5e-4], ids=["at the models' rate", "faster"])
def test_transfer_functions_are_scored_at_their_own_sample_time(
    sample_time: float, linear_bank: dict[str, LinearModel]
) -> None:
    speed = 100.0 * np.sin(2.0 * np.pi * sample_time * np.arange(round(2.0 / sample_time)))
    lag = np.exp(-sample_time / 0.0095)
    velocity = np.zeros_like(speed)
    for k in range(1, len(speed)):
        velocity[k] = lag * velocity[k - 1] + (1.0 - lag) * 3.4e-4 * speed[k - 1]
    log = Record(sample_time, {"motor_speed_rad_s": speed, "velocity_m_s": velocity})
    scores = score_transfer_functions(log, linear_bank)
    assert isinstance(scores, Scores)
    assert scores.condition == "normal"
    assert scores.by_condition["normal"] < 0.05 * scores.by_condition["major_leakage"]


@pytest.mark.slow
def test_the_mathematical_model_errs_less_than_the_transfer_function_in_eight_of_nine() -> None:
    functions = identify_bank(RIG, np.random.default_rng(2024))
    better = 0
    for name in CONDITIONS:
        log = bench_log(name, 0)
        mathematical = score_mathematical(log, BANK, pressure=False).by_condition[name]
        better += mathematical < score_transfer_functions(log, functions).by_condition[name]
    assert better >= 8  # Table 5


def test_all_18_foreign_logs_get_their_class(shared: Path) -> None:
    truth = pd.read_csv(shared / "bench" / "truth.csv")
    by_levels = {(condition.leakage, condition.friction): name for name, condition in CONDITIONS.items()}
    true = [by_levels[row] for row in zip(truth["leakage"], truth["friction"], strict=True)]
    logs = [read_record(shared / "bench" / str(file)) for file in truth["file"]]
    assert len(logs) == 18
    assert [score_mathematical(log, BANK).condition for log in logs] == true


def test_one_channel_is_scored_in_its_own_unit_and_two_as_shares() -> None:
    log = bench_log("normal", 0)
    alone, both = (score_mathematical(log, {"normal": BANK["normal"]}, pressure=pressure) for pressure in (False, True))
    assert alone.by_condition == alone.rmse["velocity_m_s"]
    sizes = {channel: float(np.sqrt(np.nanmean(log[channel] ** 2))) for channel in both.channels}
    shares = [both.rmse[channel]["normal"] / sizes[channel] for channel in both.channels]
    assert both.by_condition["normal"] == pytest.approx(float(np.sqrt(np.mean(np.square(shares)))))


def test_a_diverged_model_has_an_infinite_rmse() -> None:
    assert rmse(np.array([1.0, np.nan, 2.0]), np.array([1.0, np.nan, 2.0])) == np.inf
