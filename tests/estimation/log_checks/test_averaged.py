"""A moving average of the pressure shows in its spectrum, whatever drives the actuator; no other channel looks so."""

import numpy as np
import pytest

from estimation.log_checks.averaged import FAST, averaged_rows, without_overlapping_means
from estimation.log_checks.channel_names import PRESSURE, SPEED
from estimation.log_checks.clean import clean_log
from estimation.log_checks.filtered import is_smoothed
from estimation.log_checks.notes import LoggerCode
from faults.conditions import CONDITIONS, parameters_for
from plant.arrays import Array
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH, IDEAL, Sensors


def log(drive: str, sensors: Sensors = BENCH, sample_time: float = 1e-3) -> Record:
    rng = np.random.default_rng(7)
    p = parameters_for(CONDITIONS["minor_leakage"])
    signal = make_drive(drive, 6.0, sample_time, p, rng)
    return simulate(CIRCUIT, signal, sample_time, p, sensors=sensors, rng=rng)


def over_last(values: Array, rows: int) -> Array:
    return np.convolve(np.concatenate([np.full(rows - 1, values[0]), values]), np.ones(rows) / rows, "valid")


def over_both_sides(values: Array, rows: int) -> Array:
    return np.convolve(np.pad(values, (rows // 2, rows - 1 - rows // 2), mode="edge"), np.ones(rows) / rows, "valid")


@pytest.mark.parametrize("drive", ["steps", "prbs", "multisine", "chirp"])
@pytest.mark.parametrize("rows", [2, 3, 4, 8, 20])
def test_the_rows_of_an_average_and_the_noise_before_it_are_found_under_any_drive(drive: str, rows: int) -> None:
    record = log(drive)
    raw = clean_log(record, EhaParameters()).variances[PRESSURE]
    for average in (over_last, over_both_sides):
        found, variance = averaged_rows(average(record[PRESSURE], rows))
        assert found == rows
        assert variance == pytest.approx(raw, rel=0.2)


@pytest.mark.parametrize("sensors", [BENCH, IDEAL])
@pytest.mark.parametrize("drive", ["steps", "prbs", "multisine", "chirp", "sine"])
def test_a_log_whose_pressure_was_not_averaged_is_unchanged(drive: str, sensors: Sensors) -> None:
    for sample_time in (1e-3, 1e-4):
        record = log(drive, sensors, sample_time)
        assert without_overlapping_means(record) == (record, (), {})


def test_first_order_and_binomial_filters_are_no_average() -> None:
    noise = np.random.default_rng(1).normal(0.0, 1e3, 20_000)
    slow = noise.copy()
    for row in range(1, len(slow)):
        slow[row] = 0.5 * slow[row - 1] + 0.5 * noise[row]
    for smoothed in (slow, np.convolve(noise, [0.25, 0.5, 0.25], "valid"), np.convolve(noise, np.hanning(8), "valid")):
        assert averaged_rows(smoothed)[0] == 1


def test_one_mean_in_so_many_rows_is_kept_with_the_noise_of_a_mean() -> None:
    record = log("steps")
    clean = clean_log(record.replace(**{PRESSURE: over_last(record[PRESSURE], 5)}), EhaParameters())
    assert clean.averaged == 5
    assert not clean.filtered
    (note,) = clean.left_out
    assert note.code is LoggerCode.AVERAGED
    assert np.flatnonzero(np.isfinite(clean.record[PRESSURE]))[:3].tolist() == [4, 9, 14]
    raw = clean_log(record, EhaParameters()).variances[PRESSURE]
    assert clean.variances[PRESSURE] == pytest.approx(raw / 5.0, rel=0.2)


def test_channels_that_were_all_averaged_need_no_average_of_the_model() -> None:
    record = log("steps")
    alike = record.replace(**{name: over_last(record[name], 5) for name in (PRESSURE, SPEED)})
    assert without_overlapping_means(alike) == (alike, (), {})


def test_means_of_a_fast_log_take_the_place_of_its_blocks_only_if_they_have_a_middle_row() -> None:
    record = log("steps", sample_time=1e-4)
    assert record.sample_time < FAST
    for rows, kept in ((5, True), (4, False), (9, False)):
        averaged = record.replace(**{PRESSURE: over_last(record[PRESSURE], rows)})
        assert bool(without_overlapping_means(averaged)[1]) is kept


def test_a_short_or_constant_channel_was_not_averaged() -> None:
    noise = np.random.default_rng(2).normal(0.0, 1e3, 1000)
    assert averaged_rows(over_last(noise, 4)) == (1, 0.0)
    assert averaged_rows(np.zeros(20_000)) == (1, 0.0)


def test_a_filter_run_forward_and_backward_leaves_no_noise_at_the_highest_frequencies_and_an_average_does() -> None:
    from scipy.signal import butter, filtfilt

    record = log("prbs")
    for corner in (0.06, 0.2, 0.5):
        assert is_smoothed(filtfilt(*butter(2, corner), record[PRESSURE]))
    assert not is_smoothed(record[PRESSURE])
    for rows in (2, 3, 4, 9):
        assert not is_smoothed(over_last(record[PRESSURE], rows))
    assert not is_smoothed(record[PRESSURE][:200])
