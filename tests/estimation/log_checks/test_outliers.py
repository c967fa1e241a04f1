"""Gross outliers are removed, alone, in threes and at the ends; motion is not."""

import numpy as np
import pytest

from estimation.log_checks.measurement_noise import measurement_variances
from estimation.log_checks.outliers import (
    without_bursts,
    without_gross_outliers,
    without_outliers,
    without_written_for_lost,
)
from estimation.notes import SensorCode
from faults.conditions import CONDITIONS, parameters_for
from plant.eha.circuit_parameters import circuit_of
from plant.eha.drives import make_drive
from plant.eha.simulate import CIRCUIT, LUMPED, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH, RIG, Sensors

CHANNELS = ("motor_speed_rad_s", "position_m", "velocity_m_s", "differential_pressure_pa")


def log(condition: str, drive: str, sample_time: float = 1e-3, sensors: Sensors = BENCH) -> Record:
    p, rng = parameters_for(CONDITIONS[condition]), np.random.default_rng(15)
    speed = make_drive(drive, 5.0, sample_time, p, rng)
    return simulate(LUMPED, speed, sample_time, p, sensors=sensors, rng=rng)


@pytest.mark.parametrize("drive", ["steps", "prbs", "sine"])
@pytest.mark.parametrize("condition", CONDITIONS)
def test_a_sound_log_has_no_outliers(condition: str, drive: str) -> None:
    assert without_gross_outliers(log(condition, drive), CHANNELS)[1] == ()


@pytest.mark.parametrize("sample_time", [2e-3, 1e-4, 5e-5])
def test_a_sound_log_has_no_outliers_at_any_sample_rate(sample_time: float) -> None:
    for condition, drive in (("normal", "prbs"), ("major_friction", "sine"), ("major_leakage", "steps")):
        assert without_gross_outliers(log(condition, drive, sample_time), CHANNELS)[1] == ()


@pytest.mark.parametrize("condition", ["normal", "major_friction"])
def test_a_piston_that_slips_for_a_few_samples_is_no_outlier(condition: str) -> None:
    record = log(condition, "prbs", sensors=RIG)
    noise = measurement_variances(record, ("velocity_m_s",))["velocity_m_s"] ** 0.5
    assert np.any(np.isnan(without_outliers(record["velocity_m_s"], noise)))
    assert without_gross_outliers(record, CHANNELS)[1] == ()


def test_a_sound_log_of_the_circuit_has_no_outliers() -> None:
    p, rng = circuit_of(parameters_for(CONDITIONS["minor_friction"])), np.random.default_rng(6)
    record = simulate(CIRCUIT, make_drive("steps", 5.0, 1e-3, p, rng), 1e-3, p, sensors=BENCH, rng=rng)
    assert without_gross_outliers(record, CHANNELS)[1] == ()


@pytest.mark.parametrize("seed", range(3))
def test_every_gross_outlier_is_taken_out_and_nothing_else(seed: int) -> None:
    record, rng = log("normal", "prbs"), np.random.default_rng(seed)
    hits = {name: rng.choice(len(record), len(record) // 100, replace=False) for name in CHANNELS}
    spoilt = {name: record[name].copy() for name in CHANNELS}
    for name, hit in hits.items():
        spoilt[name][hit] += 20.0 * np.std(record[name]) * rng.choice((-1.0, 1.0), len(hit))
    cleaned, said = without_gross_outliers(record.replace(**spoilt), CHANNELS)
    for name, hit in hits.items():
        assert set(np.flatnonzero(np.isnan(cleaned[name]))) == set(hit), name
    assert [note.code for note in said] == [SensorCode.OUTLIERS_LEFT_OUT] * len(CHANNELS)
    assert [dict(note.data) for note in said] == [{"channel": name, "count": 50, "total": 5000} for name in CHANNELS]


def test_three_outliers_among_four_samples_are_no_step() -> None:
    speed = log("normal", "prbs")["motor_speed_rad_s"].copy()
    speed[[1000, 1001, 1003]] += 2500.0
    assert np.flatnonzero(np.isnan(without_outliers(speed))).tolist() == [1000, 1001, 1003]


@pytest.mark.parametrize("place", [0, 2, -3, -1])
def test_an_outlier_at_an_end_is_found_there(place: int) -> None:
    position = log("normal", "steps")["position_m"].copy()
    position[place] -= 1.0
    assert np.flatnonzero(np.isnan(without_outliers(position))).tolist() == [place % len(position)]


@pytest.mark.parametrize("backward", [False, True])
def test_a_run_up_from_rest_to_constant_speed_has_no_outliers(backward: bool) -> None:
    """A motor that a load holds at its full speed had its first two samples left out, 0 and 22 rad/s."""
    rng = np.random.default_rng(3)
    speed = np.full(2000, 125.6) + rng.normal(0.0, 0.05, 2000)
    speed[:9] = [0.0, 22.0, 43.8, 65.0, 81.4, 93.4, 102.0, 108.5, 113.1]
    log = speed[::-1].copy() if backward else speed
    assert not np.any(np.isnan(without_outliers(log, 0.05)))
    log[-1 if backward else 0] = -400.0
    assert np.flatnonzero(np.isnan(without_outliers(log, 0.05))).tolist() == [1999 if backward else 0]


def test_missing_samples_stay_missing_and_are_not_counted() -> None:
    record = log("normal", "steps")
    speed = record["motor_speed_rad_s"].copy()
    speed[100:200] = np.nan
    cleaned, said = without_gross_outliers(record.replace(motor_speed_rad_s=speed), CHANNELS)
    assert said == ()
    np.testing.assert_array_equal(cleaned["motor_speed_rad_s"], speed)


def test_a_few_samples_have_no_outliers() -> None:
    few = np.array([0.0, 1e9, np.nan, 0.0])
    np.testing.assert_array_equal(without_outliers(few), few)


def test_the_ringing_after_a_gross_pressure_outlier_is_removed_with_it() -> None:
    record = log("normal", "sine")
    ringing = 3e5 * np.exp(-0.5 * np.arange(8)) * np.cos(2.2 * np.arange(8))
    burst = np.zeros(len(record))
    for place in range(300, len(record) - 300, 400):
        burst[place : place + 8] = ringing
    spoilt = record.replace(differential_pressure_pa=record["differential_pressure_pa"] + burst)
    cleaned, (said,) = without_gross_outliers(spoilt, CHANNELS)
    left = np.where(np.isnan(cleaned["differential_pressure_pa"]), 0.0, burst)
    assert np.max(np.abs(left)) < 4e4  # the ringing reaches 180 kPa
    taken = np.flatnonzero(np.isnan(cleaned["differential_pressure_pa"]))
    assert np.all(np.abs(burst[taken]) > 0.0)
    assert said.data["count"] == len(taken)


def test_samples_beside_an_outlier_without_ringing_are_kept() -> None:
    values = np.random.default_rng(2).normal(0.0, 1.0, 2000)
    values[::100] += 40.0
    sound = without_outliers(values, 1.0)
    assert np.array_equal(without_bursts(values, sound, 1.0), sound, equal_nan=True)


@pytest.mark.parametrize("written", [0.0, -9999.0])
def test_a_loggers_placeholder_for_lost_samples_is_removed_near_the_signal_too(written: float) -> None:
    sound = log("minor_leakage", "prbs")
    rng = np.random.default_rng(7)
    changes, lost = {}, {}
    for name in ("motor_speed_rad_s", "position_m", "differential_pressure_pa"):
        lost[name] = rng.random(len(sound)) < 3e-3
        changes[name] = np.where(lost[name], written, sound[name])
    mended, notes = without_gross_outliers(sound.replace(**changes), CHANNELS)
    assert {str(note.data["channel"]) for note in notes} == set(changes)
    for name, gone in lost.items():
        noise = measurement_variances(sound, (name,))[name] ** 0.5
        wrong = np.abs(mended[name] - sound[name])[gone & np.isfinite(mended[name])]
        assert np.max(wrong, initial=0.0) < 6.0 * noise
        assert np.count_nonzero(np.isnan(mended[name]) & ~gone) == 0


def test_gross_outliers_remove_no_samples_of_other_values() -> None:
    values = np.random.default_rng(8).normal(0.0, 1.0, 400)
    values[[50, 150, 250, 350]] = 100.0, -90.0, 80.0, 100.0
    values[200] = 5.0
    sound = without_outliers(values, 1.0)
    np.testing.assert_array_equal(without_written_for_lost(values, sound, 1.0), sound)
    values[[50, 150, 250, 350]] = 100.0
    sound = without_outliers(values, 1.0)
    np.testing.assert_array_equal(without_written_for_lost(values, sound, 1.0), sound)
