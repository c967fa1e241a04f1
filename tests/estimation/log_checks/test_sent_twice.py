"""Rows that a logger wrote twice are left out; rest, drives that repeat and coarse channels are not copies."""

import numpy as np
import pytest

from estimation.log_checks.clean import clean_log
from estimation.log_checks.sent_twice import FEWEST_ROWS, _extended_copy, without_rows_sent_twice
from estimation.notes import SensorCode
from plant.eha.model import EhaParameters
from plant.log.record import Record
from plant.sensors.sensors import BENCH, IDEAL, Sensors
from tests.estimation.log_checks.made_logs import circuit_log

SPEED, POSITION, PRESSURE = "motor_speed_rad_s", "position_m", "differential_pressure_pa"


def at(record: Record, rows: np.ndarray) -> Record:
    return Record(record.sample_time, {name: record[name][rows] for name in record})


@pytest.mark.parametrize("sensors", [BENCH, IDEAL])
@pytest.mark.parametrize("drive", ["steps", "prbs", "multisine", "sine"])
def test_a_sound_log_has_no_copied_rows(drive: str, sensors: Sensors) -> None:
    record = circuit_log(drive, sensors)
    assert without_rows_sent_twice(record) == (record, ())


@pytest.mark.parametrize("rows", [FEWEST_ROWS, 50, 300])
@pytest.mark.parametrize("drive", ["steps", "multisine", "sine"])
def test_a_packet_that_was_sent_twice_is_cut_out_and_noted(drive: str, rows: int) -> None:
    record = circuit_log(drive)
    order = np.arange(len(record))
    sent = np.concatenate([order[: 1500 + rows], order[1500 : 2500 + rows], order[2500:]])
    found, notes = without_rows_sent_twice(at(record, sent))
    assert {(note.data["rows"], note.data["count"]) for note in notes} == {(2 * rows, 2)}
    for name in (SPEED, POSITION, PRESSURE):
        assert np.array_equal(found[name], record[name])


def test_a_copy_that_replaces_lost_rows_becomes_missing_samples() -> None:
    record = circuit_log("multisine")
    order = np.arange(len(record))
    order[1600:1700] = order[1500:1600]
    clean = clean_log(at(record, order), EhaParameters())
    assert {note.code for note in clean.left_out} == {SensorCode.SENT_TWICE}
    assert len(clean.record) == len(record)
    for name in (SPEED, POSITION, PRESSURE):
        assert np.flatnonzero(np.isnan(clean.record[name])).tolist() == list(range(1600, 1700))


def without_noise(*phases: np.ndarray) -> Record:
    """Return three channels that follow a phase [periods], equal to the last bit if the phase is equal."""
    phase = 2.0 * np.pi * np.concatenate(phases)
    return Record(
        1e-3, {SPEED: 100.0 * np.cos(phase), POSITION: 0.01 * np.sin(phase), PRESSURE: 1e6 * np.sin(2 * phase)}
    )


PERIOD = np.arange(400.0) / 400.0
BEFORE = -0.7 * np.linspace(1.0, 0.0, 2000, endpoint=False) ** 2
"""Phase of a motion that never repeats."""


@pytest.mark.parametrize("times", [2, 3, 12])
def test_a_periodic_run_without_noise_has_no_copied_rows(times: int) -> None:
    record = without_noise(BEFORE, np.tile(PERIOD, times))
    assert without_rows_sent_twice(record) == (record, ())


def test_a_noiseless_packet_sent_twice_is_found_by_its_step_back() -> None:
    once = without_noise(BEFORE, PERIOD[:200])
    order = np.arange(len(once))
    for sent in (np.concatenate([order[:1550], order[1500:]]), np.concatenate([order, order[-50:]])):
        found, (note,) = without_rows_sent_twice(at(once, sent))
        assert (note.data["rows"], note.data["count"]) == (50, 1)
        assert np.array_equal(found[POSITION], once[POSITION])


@pytest.mark.parametrize(
    ("rows", "known", "whole"),
    [
        ([7, 7, 1, 2, 3, 7, 7, 1, 2, 3, 9], (7, 10), (5, 10)),
        ([1, 2, 3, 7, 7, 1, 2, 3, 7, 7, 9], (5, 8), (5, 10)),
        ([1, 2, 3, 7, 7, 1, 2, 3, 7, 7], (5, 8), (5, 10)),
        ([8, 7, 1, 2, 3, 7, 7, 1, 2, 3, 9], (7, 10), (6, 10)),
        ([7] * 12, (6, 7), (5, 10)),
    ],
    ids=["rest before", "rest behind", "to the end", "another row before", "no longer than the distance"],
)
def test_a_copy_extends_over_all_repeated_rows_including_rests_at_its_ends(
    rows: list[int], known: tuple[int, int], whole: tuple[int, int]
) -> None:
    assert _extended_copy(np.array(rows, dtype=np.uint64), *known, 5) == whole


def test_coarse_channels_at_rest_have_no_copied_rows() -> None:
    rng = np.random.default_rng(2)
    record = Record(1e-3, {name: rng.integers(0, 3, 4000).astype(np.float64) for name in (SPEED, POSITION, PRESSURE)})
    assert without_rows_sent_twice(record) == (record, ())


def relation(noise: float, decimals: int, seed: int = 0) -> Record:
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-1.0, 1.0], 200), 10)
    y = np.zeros(u.size)
    for t in range(1, u.size):
        y[t] = 0.8 * y[t - 1] + 0.2 * u[t - 1]
    return Record(0.1, {"u": u, "y": np.round(y + noise * rng.normal(size=u.size), decimals)})


def again(record: Record) -> Record:
    order = np.arange(len(record))
    return at(record, np.concatenate([order[:900], order[880:]]))


def test_a_copy_is_cut_out_of_a_noiseless_input_and_a_noisy_output() -> None:
    record = relation(0.02, 6)
    found, (note,) = without_rows_sent_twice(again(record), ["u", "y"])
    assert note.data["rows"] == 20
    assert np.array_equal(found["y"], record["y"])
    sent = again(record)
    assert without_rows_sent_twice(sent) == (sent, ())  # `u` and `y` are not channels of an actuator


@pytest.mark.parametrize(("noise", "decimals"), [(0.02, 6), (0.0, 6), (0.02, 2), (0.02, 1), (0.3, 0)])
def test_two_sound_columns_have_no_copied_rows(noise: float, decimals: int) -> None:
    for seed in range(5):
        record = relation(noise, decimals, seed)
        assert without_rows_sent_twice(record, ["u", "y"]) == (record, ())


def test_a_copy_in_a_log_without_noise_is_not_cut_out() -> None:
    sent = again(relation(0.0, 6))
    assert without_rows_sent_twice(sent, ["u", "y"]) == (sent, ())
