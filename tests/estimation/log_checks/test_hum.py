"""Tones that a cable picks up are removed from a pressure channel; motion stays."""

import numpy as np
import pytest

from estimation.log_checks import hum
from estimation.log_checks.hum import without_hum
from estimation.notes import SensorCode
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH
from tests.estimation.log_checks.made_logs import circuit_log

PRESSURE = "differential_pressure_pa"


def humming(record: Record, amplitude: float, frequency: float) -> Record:
    time = record.sample_time * np.arange(len(record))
    return record.replace(**{PRESSURE: record[PRESSURE] + amplitude * np.sin(2.0 * np.pi * frequency * time + 1.0)})


@pytest.mark.parametrize("drive", ["steps", "prbs", "multisine", "chirp", "sine"])
def test_a_log_without_hum_is_unchanged(drive: str) -> None:
    record = circuit_log(drive)
    assert without_hum(record) == (record, ())


@pytest.mark.parametrize("frequency", [49.97, 60.0, 150.0])
def test_a_hum_is_named_with_amplitude_and_frequency_and_taken_off(frequency: float) -> None:
    record = circuit_log("steps")
    given = humming(record, 2.5e4, frequency)
    missing = given[PRESSURE].copy()
    missing[1000:1040] = np.nan
    mended, (note,) = without_hum(given.replace(**{PRESSURE: missing}))
    assert note.code is SensorCode.HUM
    assert note.data["frequency_hz"] == pytest.approx(frequency, abs=0.1)
    assert note.data["amplitude_pa"] == pytest.approx(2.5e4, rel=0.05)
    left = mended[PRESSURE] - record[PRESSURE]
    assert np.array_equal(np.isnan(left), np.isnan(missing))
    assert np.nanstd(left) < 0.05 * 2.5e4


def test_the_mains_and_two_harmonics_are_three_tones() -> None:
    record = humming(humming(humming(circuit_log("steps"), 3e4, 50.0), 1e4, 100.0), 2e4, 150.0)
    assert [round(note.data["frequency_hz"]) for note in without_hum(record)[1]] == [50, 150, 100]


def test_a_tone_that_position_has_too_is_motion_and_is_kept() -> None:
    record = humming(circuit_log("steps"), 2.5e4, 50.0)
    time = record.sample_time * np.arange(len(record))
    shaken = record.replace(position_m=record["position_m"] + 1e-4 * np.sin(2.0 * np.pi * 50.0 * time))
    assert without_hum(shaken)[1] == ()


@pytest.mark.parametrize("repeats", [4.9, 10.0, 20.0])
def test_harmonics_of_a_drive_that_repeats_itself_are_no_hum(repeats: float) -> None:
    record = circuit_log("steps")
    time = record.sample_time * np.arange(len(record))
    square = 1e5 * np.sign(np.sin(2.0 * np.pi * repeats * time + 0.3))
    assert without_hum(record.replace(**{PRESSURE: record[PRESSURE] + square}))[1] == ()


def test_a_tone_at_a_harmonic_of_a_fast_drive_is_kept() -> None:
    driven = humming(humming(circuit_log("steps"), 1e6, 20.0), 2.5e4, 60.0)
    assert without_hum(driven)[1] == ()


@pytest.mark.parametrize("repeats", [2.5, 3.4, 6.2])
def test_mains_hum_is_not_taken_for_a_harmonic_of_a_slow_drive(repeats: float) -> None:
    """Every frequency lies within 1 Hz of a harmonic of a drive below 2 Hz, and most of one of 3 Hz."""
    speed = 60.0 * np.sin(2.0 * np.pi * repeats * 1e-3 * np.arange(6000))
    record = simulate(CIRCUIT, speed, 1e-3, EhaParameters(), sensors=BENCH, rng=np.random.default_rng(4))
    assert without_hum(record)[1] == ()
    (note,) = without_hum(humming(record, 2.5e4, 50.0))[1]
    assert note.data["frequency_hz"] == pytest.approx(50.0, abs=0.1)


def test_a_tone_near_half_the_sample_rate_is_no_hum() -> None:
    slow = circuit_log("steps").slice(step=5)
    assert without_hum(humming(slow, 2.5e4, 0.48 / slow.sample_time))[1] == ()


def test_a_log_without_pressure_is_left_as_it_is() -> None:
    record = circuit_log("steps").replace(**{PRESSURE: None})
    assert without_hum(record) == (record, ())


def test_a_hum_beside_the_harmonics_of_a_drive_is_taken_off() -> None:
    driven = humming(humming(circuit_log("steps"), 1e6, 10.0), 2.5e4, 53.0)
    (note,) = without_hum(driven)[1]
    assert note.data["frequency_hz"] == pytest.approx(53.0, abs=0.1)


def test_no_more_than_the_largest_number_of_tones_is_removed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hum, "MOST_TONES", 1)
    record = humming(humming(circuit_log("steps"), 3e4, 50.0), 1e4, 150.0)
    assert [round(note.data["frequency_hz"]) for note in without_hum(record)[1]] == [50]


def test_a_line_at_an_end_of_the_spectrum_is_not_interpolated() -> None:
    frequencies = np.arange(5.0)
    lines = np.array([9.0, 1.0, 2.0, 8.0, 4.0])
    assert [hum._line_frequency(frequencies, lines, place) for place in (0, 4)] == [0.0, 4.0]
    assert 3.0 < hum._line_frequency(frequencies, lines, 3) < 3.5


def test_no_tone_is_fitted_to_a_stretch_with_mostly_missing_pressure() -> None:
    waves = np.column_stack([np.cos(np.arange(20.0)), np.sin(np.arange(20.0))])
    values = 3.0 * waves[:, 0]
    np.testing.assert_allclose(hum._least_squares_fit(waves, values), values)
    values[3:] = np.nan
    assert not hum._least_squares_fit(waves, values).any()


@pytest.mark.parametrize("goes_on", [False, True])
def test_a_tone_is_hum_only_if_it_is_also_there_at_another_motor_speed(goes_on: bool) -> None:
    record = circuit_log("steps")
    time = record.sample_time * np.arange(len(record))
    turning = time > 1.5
    speed = np.where(turning, 130.0, 20.0) + 0.05 * np.random.default_rng(1).standard_normal(len(time))
    tone = 2e4 * np.sin(9.0 * 130.0 * time) * (turning | goes_on)
    given = record.replace(motor_speed_rad_s=speed, **{PRESSURE: record[PRESSURE] + tone})
    assert len(without_hum(given)[1]) == goes_on
