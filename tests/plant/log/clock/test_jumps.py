"""Tests of a clock that is set during a log."""

import warnings

import numpy as np
import pytest
from numpy.typing import NDArray

from plant.errors import LogError, LogWarning
from plant.log.clock.jumps import without_jumps, without_overruns
from plant.log.files import read_record
from plant.log.frames import frame_table
from plant.log.notes import LogCode
from plant.notes import Note

EVEN = 0.01 * np.arange(2000.0)


def stamps(seconds: NDArray[np.float64]) -> NDArray[np.datetime64]:
    return np.datetime64("2026-10-25T02:59:50", "ns") + np.rint(1e9 * seconds).astype("timedelta64[ns]")


def read(seconds: NDArray[np.float64]) -> tuple[float, int, list[Note]]:
    ramp = np.arange(float(len(seconds)))
    table = frame_table({"time": stamps(seconds), "motor_speed_rad_s": ramp % 7, "position_m": 1e-4 * ramp})
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        record = read_record(table)
    return record.sample_time, len(record), [one.message.note for one in caught if isinstance(one.message, LogWarning)]


@pytest.mark.parametrize("hours", [-1, 1, 2, -24])
def test_a_clock_jump_by_whole_hours_is_removed_with_a_note(hours: int) -> None:
    sample_time, length, notes = read(EVEN + 3600.0 * hours * (EVEN > 9.995))
    assert sample_time == pytest.approx(0.01)
    assert length == len(EVEN)
    assert notes == [LogCode.TIME_SET.note(channel="time_s", hours=hours, row=1001)]


def test_a_clock_jump_is_removed_before_rounded_time_stamps_are_made_uniform() -> None:
    sample_time, length, notes = read(np.floor(EVEN - 3600.0 * (EVEN > 9.995)))
    assert (sample_time, length) == (pytest.approx(0.01), len(EVEN))
    assert [str(note.code) for note in notes] == ["time_set", "time_rounded"]


@pytest.mark.parametrize("by", [-5.0, -3605.0, 3605.0, 5.0])
def test_a_clock_jump_by_other_than_whole_hours_is_refused_with_its_row(by: float) -> None:
    with pytest.raises(LogError, match=r"in row 1001 after .* keep one side|gap is before row 1001"):
        read(EVEN + by * (EVEN > 9.995))


def test_hourly_pauses_between_slow_samples_and_repeated_hourly_pauses_are_kept() -> None:
    slow = 30.0 * np.arange(100.0)
    for time in (slow + 3600.0 * (slow > 900.0), EVEN + 3600.0 * np.floor(EVEN / 5.0)):
        kept, jumps = without_jumps(time)
        assert jumps == []
        np.testing.assert_array_equal(kept, time)


@pytest.mark.parametrize(
    ("bits", "tick", "start"), [(16, 1e-3, 50.0), (16, 1e-6, 0.0), (24, 1e-6, 9.0), (32, 1e-6, 4290.0)]
)
def test_an_overflow_of_a_tick_counter_is_corrected_with_a_note(bits: int, tick: float, start: float) -> None:
    ticks = np.rint((start + 1e-3 * np.arange(20_000.0)) / tick) % 2**bits
    ramp = np.arange(float(len(ticks)))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        record = read_record(
            frame_table({"time_s": ticks * tick, "motor_speed_rad_s": ramp % 7, "position_m": 1e-5 * ramp})
        )
    assert record.sample_time == pytest.approx(1e-3, rel=1e-6)
    assert len(record) == len(ticks)
    assert [one.message.note.code for one in caught if isinstance(one.message, LogWarning)] == [LogCode.TIME_RAN_OVER]


@pytest.mark.parametrize("rows", [2**16, 1000, 65_537])
def test_a_restarted_test_is_not_taken_for_a_counter_overflow(rows: int) -> None:
    time = 1e-3 * (np.arange(1.5 * rows) % rows)
    assert without_overruns(time)[1] is None
    assert without_overruns(time + 7.0)[1] is None


def test_a_single_backward_step_of_slow_stamps_is_not_taken_for_a_counter_overflow() -> None:
    time = np.arange(1000.0)
    assert without_overruns(time - 65.0 * (time > 500.0))[1] is None


@pytest.mark.parametrize(
    ("row", "stamp", "end", "step"),
    [(0, 0.015, "first", -0.005), (0, -700.0, "first", 700.01), (1999, 0.0, "last", -19.98)],
)
def test_a_first_or_last_row_whose_time_does_not_fit_is_left_out_with_a_note(
    row: int, stamp: float, end: str, step: float
) -> None:
    seconds = EVEN.copy()
    seconds[row] = stamp
    sample_time, length, (note,) = read(seconds)
    assert (sample_time, length) == (pytest.approx(0.01), len(EVEN) - 1)
    assert str(note) == str(LogCode.TIME_STRAYS.note(channel="time_s", step_s=step, end=end))


def test_rows_at_an_end_that_fit_are_kept_and_others_within_are_refused() -> None:
    assert read(np.delete(EVEN, np.arange(1, 60)))[1] == len(EVEN)  # 3 % are missing, which a log may lack
    within = EVEN.copy()
    within[[0, 1000]] = 0.015, 0.0
    with pytest.raises(LogError, match="must increase"):
        read(within)
