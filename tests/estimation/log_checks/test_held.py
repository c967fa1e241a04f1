"""Values that a logger only repeated are left out; a channel that rests or is coarse keeps all its values."""

import numpy as np
import pytest

from estimation.log_checks.clean import clean_log
from estimation.log_checks.held import held_rows, without_held_values
from estimation.notes import SensorCode
from plant.eha.model import EhaParameters
from plant.log.record import Record
from plant.sensors.sensors import BENCH, IDEAL, Sensors
from tests.estimation.log_checks.made_logs import circuit_log

PRESSURE, POSITION = "differential_pressure_pa", "position_m"


def held(values: np.ndarray, rows: float) -> np.ndarray:
    """Return values that come every ``rows`` rows, on a clock of their own if ``rows`` is not a whole number."""
    at = np.arange(len(values))
    return values[(np.floor(at / rows) * rows).astype(int)]


@pytest.mark.parametrize("sensors", [BENCH, IDEAL])
@pytest.mark.parametrize("drive", ["steps", "prbs", "multisine", "chirp", "sine"])
def test_a_log_sampled_in_every_row_is_unchanged(drive: str, sensors: Sensors) -> None:
    record = circuit_log(drive, sensors)
    assert without_held_values(record) == (record, ())


@pytest.mark.parametrize("quantum", [1e-6, 1e-5, 1e-4])
def test_a_coarse_encoder_is_not_held(quantum: float) -> None:
    record = circuit_log("sine")
    assert held_rows(quantum * np.round(record[POSITION] / quantum)) == 1


@pytest.mark.parametrize("rows", [2, 3, 5, 10, 10.0 / 3.0])
@pytest.mark.parametrize("channel", [PRESSURE, POSITION])
def test_a_held_channel_is_named_and_keeps_only_its_own_samples(channel: str, rows: float) -> None:
    record = circuit_log("multisine")
    given = held(record[channel], rows)
    found, (note,) = without_held_values(record.replace(**{channel: given}))
    there = np.isfinite(found[channel])
    assert note.code is SensorCode.HELD
    assert note.data["channel"] == channel
    assert note.data["rows"] == int(rows)
    moved = np.append(True, np.diff(given) != 0.0)  # a sample equal to the last one has no information
    assert np.array_equal(there, moved)
    assert np.array_equal(found[channel][there], given[there])


def test_a_motor_that_is_driven_in_steps_is_not_held() -> None:
    record = circuit_log("steps")
    stairs = held(100.0 * np.sin(3e-3 * np.arange(len(record))), 10)
    assert "motor_speed_rad_s" not in [
        n.data["channel"] for n in without_held_values(record.replace(motor_speed_rad_s=stairs))[1]
    ]


def test_a_cleaned_log_notes_a_held_channel() -> None:
    record = circuit_log("multisine")
    clean = clean_log(record.replace(**{PRESSURE: held(record[PRESSURE], 7)}), EhaParameters())
    assert [note.code for note in clean.left_out] == [SensorCode.HELD]
    assert np.mean(np.isfinite(clean.record[PRESSURE])) == pytest.approx(1.0 / 7.0, rel=0.1)


def bridged(values: np.ndarray, rows: int, first: int) -> np.ndarray:
    """Return values on straight lines between every ``rows``-th one, rounded as in a file."""
    at = np.arange(len(values))
    there = at[first::rows]
    return np.array([float(f"{one:.9g}") for one in np.interp(at, there, values[there])])


@pytest.mark.parametrize("rows", [2, 5, 10])
@pytest.mark.parametrize("first", [0, 1])
@pytest.mark.parametrize("code", [SensorCode.HELD, SensorCode.BRIDGED])
def test_a_slow_log_written_at_a_faster_rate_gets_its_own_rate_back(code: SensorCode, first: int, rows: int) -> None:
    record = circuit_log("multisine")
    names = ("motor_speed_rad_s", POSITION, "velocity_m_s", PRESSURE)
    late = np.maximum((np.arange(len(record)) - first) // rows * rows + first, 0)
    given = {
        name: record[name][late] if code is SensorCode.HELD else bridged(record[name], rows, first) for name in names
    }
    found, notes = without_held_values(Record(record.sample_time, given))
    assert {(note.code, note.data["channel"], note.data["rows"]) for note in notes} == {(code, n, rows) for n in names}
    assert found.sample_time == pytest.approx(rows * record.sample_time)
    assert found.start_time == pytest.approx(first * record.sample_time)
    for name in names:
        assert found[name] == pytest.approx(record[name][first::rows], rel=1e-8)


def test_a_fast_speed_beside_slow_sensors_keeps_all_its_samples() -> None:
    record = circuit_log("multisine")
    slow = {name: held(record[name], 5) for name in (POSITION, "velocity_m_s", PRESSURE)}
    found, notes = without_held_values(record.replace(**slow))
    assert {note.data["channel"] for note in notes} == set(slow)
    assert found.sample_time == record.sample_time
    assert np.array_equal(found["motor_speed_rad_s"], record["motor_speed_rad_s"])


@pytest.mark.parametrize("channel", [PRESSURE, POSITION])
def test_a_single_interpolated_channel_keeps_only_its_own_samples(channel: str) -> None:
    record = circuit_log("multisine")
    given = bridged(record[channel], 4, 0)
    found, (note,) = without_held_values(record.replace(**{channel: given}))
    assert note.code is SensorCode.BRIDGED
    assert note.data["rows"] == 4
    assert np.array_equal(np.flatnonzero(np.isfinite(found[channel])), np.arange(0, len(record), 4))


@pytest.mark.parametrize("rows", [1, 2, 3, 50])
def test_a_log_of_a_few_rows_is_neither_held_nor_interpolated(rows: int) -> None:
    record = circuit_log("multisine").slice(0, rows)
    assert without_held_values(record) == (record, ())
