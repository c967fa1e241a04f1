"""Rows that a logger repeated because it had none are left out; a rest is not, nor is a single held channel."""

import numpy as np
import pytest

from estimation.log_checks.clean import clean_log
from estimation.log_checks.dropout import FEWEST_ROWS, LONG_GAP, long_gaps, without_dropouts, without_pauses
from estimation.notes import SensorCode
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH, IDEAL, Sensors
from tests.estimation.log_checks.made_logs import circuit_log

SPEED, POSITION, PRESSURE = "motor_speed_rad_s", "position_m", "differential_pressure_pa"


def repeated(record: Record, first: int, behind: int, *names: str) -> Record:
    """Return a log in which some channels, or all, repeat the row before ``first`` up to ``behind``."""
    source = np.arange(len(record))
    source[first:behind] = first - 1
    return record.replace(**{name: record[name][source] for name in names or tuple(record)})


@pytest.mark.parametrize("sensors", [BENCH, IDEAL])
@pytest.mark.parametrize("drive", ["steps", "prbs", "multisine", "sine"])
def test_a_log_without_repeated_rows_has_no_dropout(drive: str, sensors: Sensors) -> None:
    record = circuit_log(drive, sensors)
    assert without_dropouts(record) == (record, ())


def test_repeated_rows_are_left_out_of_all_channels_and_noted() -> None:
    record = circuit_log("multisine")
    clean = clean_log(repeated(record, 1500, 1700), EhaParameters())
    assert {note.code for note in clean.left_out} == {SensorCode.DROPOUT}
    assert {note.data["rows"] for note in clean.left_out} == {200}
    for name in (SPEED, POSITION, PRESSURE):
        assert np.flatnonzero(np.isnan(clean.record[name])).tolist() == list(range(1500, 1700))


def test_a_few_repeated_rows_or_a_single_held_channel_are_no_dropout() -> None:
    record = circuit_log("multisine")
    assert without_dropouts(repeated(record, 1500, 1500 + FEWEST_ROWS - 1))[1] == ()
    assert without_dropouts(repeated(record, 1500, 1700, SPEED))[1] == ()


def test_a_machine_that_rests_and_moves_on_from_the_same_place_is_no_dropout() -> None:
    time = 1e-3 * np.arange(3000)
    moved = np.clip(time, 0.0, 1.0) + np.clip(time - 2.0, 0.0, 1.0)  # rests from 1 to 2 s, without any noise
    record = Record(1e-3, {SPEED: 100.0 * moved, POSITION: 0.05 * moved, PRESSURE: 1e6 * moved})
    assert without_dropouts(record) == (record, ())
    beyond = np.where(time > 1.5, moved + 0.5, moved)
    assert without_dropouts(Record(1e-3, {name: record[name] + beyond for name in record}))[1] != ()


def test_a_motor_that_leaves_rest_from_one_row_to_the_next_is_no_dropout() -> None:
    """A simulated log without noise begins like this; its rest was called a dropout."""
    speed = np.where(np.arange(2000) < 1000, 0.0, 60.0)
    record = simulate(LUMPED, speed, 1e-3, EhaParameters(), sensors=IDEAL)
    assert without_dropouts(record) == (record, ())


@pytest.mark.parametrize("channel", [SPEED, POSITION])
def test_a_long_gap_of_speed_or_position_removes_all_channels_there(channel: str) -> None:
    record = circuit_log("multisine")
    gone = record[channel].copy()
    gone[1000 : 1000 + LONG_GAP] = gone[2000 : 2000 + LONG_GAP - 1] = np.nan
    found = without_pauses(record.replace(**{channel: gone}))
    for name in (SPEED, POSITION, PRESSURE):
        missing = np.flatnonzero(np.isnan(found[name]))
        assert missing[:LONG_GAP].tolist() == list(range(1000, 1000 + LONG_GAP))
        assert len(missing) == (2 * LONG_GAP - 1 if name == channel else LONG_GAP)


def test_rows_between_the_samples_of_a_slow_channel_are_no_gap() -> None:
    slow = np.full(1000, np.nan)
    slow[::10] = 1.0
    assert not np.any(long_gaps(slow))
    slow[500:600] = np.nan
    assert np.flatnonzero(long_gaps(slow)).tolist() == list(range(491, 600))
