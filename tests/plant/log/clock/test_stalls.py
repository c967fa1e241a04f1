"""Stamps of a computer that was busy at times."""

import warnings

import numpy as np
import pytest

from plant.arrays import Array
from plant.errors import LogWarning
from plant.log.clock.stalls import is_sampled_evenly, stalled_clock
from plant.log.files import read_record
from plant.log.frames import frame_table
from plant.notes import Note

EVEN = 1e-3 * np.arange(4000.0)
RNG = np.random.default_rng(5)


def stalled(at: tuple[float, ...] = (0.7, 1.9, 3.1), length: float = 0.02, apart: float = 0.0) -> Array:
    """Return stamps that are delayed by `length` [s] at each stall, then follow each other by `apart` [s]."""
    time = EVEN.copy()
    for begin in at:
        waits = (time > begin) & (time < begin + length)
        time[waits] = begin + length + apart * np.arange(np.count_nonzero(waits))
    return np.maximum.accumulate(time)


def read(time: Array, sampled: Array = EVEN) -> tuple[float, Array, list[Note]]:
    ramp = np.sin(9.0 * sampled[: len(time)])
    table = frame_table({"time_s": time, "motor_speed_rad_s": ramp, "position_m": 1e-2 * ramp})
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        record = read_record(table)
    notes = [one.message.note for one in caught if isinstance(one.message, LogWarning)]
    return record.sample_time, record["position_m"], notes


@pytest.mark.parametrize("jitter", [0.0, 2e-4])
@pytest.mark.parametrize("apart", [0.0, 1e-4])
def test_rows_stamped_late_in_a_queue_are_put_back_at_their_sampling_times(apart: float, jitter: float) -> None:
    time = np.sort(stalled(apart=apart) + jitter * RNG.uniform(0.0, 1.0, len(EVEN)))
    sample_time, position, (note,) = read(time)
    assert (note.code, note.data["count"]) == ("time_stalls", 3)
    assert note.data["longest_s"] == pytest.approx(0.02, abs=2e-3)
    assert sample_time == pytest.approx(1e-3, rel=1e-5)
    np.testing.assert_array_equal(position, 1e-2 * np.sin(9.0 * EVEN))


@pytest.mark.parametrize("noise", [0.0, 1e-3])
def test_rows_sampled_late_by_an_overrun_loop_keep_their_time_stamps(noise: float) -> None:
    """Its stamps look like a queue's; on an even clock, a sine of 2 Hz was wrong by its whole amplitude."""
    time = stalled(length=0.0098, apart=1e-5)
    _, position, notes = read(time, time + noise / 9.0 * RNG.standard_normal(len(time)))
    assert notes[0].code == "time_jitters"
    even = np.arange(len(position)) * (time[-1] / (len(position) - 1))
    assert np.nanmax(np.abs(position - 1e-2 * np.sin(9.0 * even))) < 1e-4 + 6e-2 * noise


def test_constant_and_noisy_channels_do_not_contradict_an_even_clock() -> None:
    time = stalled(apart=1e-4)
    still = {"held": np.ones(len(time)), "noise": RNG.standard_normal(len(time)), "missing": np.full(len(time), np.nan)}
    found = stalled_clock(time)
    assert found is not None
    assert is_sampled_evenly(time, still, found.sample_time)


def test_lost_rows_jitter_and_rounding_are_not_taken_for_a_stalled_clock() -> None:
    lost = np.delete(EVEN, np.arange(700, 720))
    for time in (lost, EVEN, EVEN + 2e-4 * RNG.uniform(-1.0, 1.0, len(EVEN)), np.floor(EVEN / 0.02) * 0.02):
        assert stalled_clock(time) is None


def test_a_clock_that_slows_down_for_a_while_is_not_taken_for_a_stalled_clock() -> None:
    """Late rows then do not arrive all at once: they were sampled at their stamps."""
    time = EVEN + 5e-3 * np.clip(1.0 - np.abs(EVEN - 2.0) / 0.05, 0.0, 1.0)
    assert stalled_clock(time) is None


def test_a_log_with_both_lost_rows_and_rows_stamped_at_once_is_resampled() -> None:
    """Then no clock can be found, and no cubic fits stamps a nanosecond apart."""
    time = np.delete(stalled(apart=1e-9), np.arange(2500, 2503))
    sample_time, position, notes = read(
        np.sort(time + 1e-4 * RNG.uniform(0.0, 1.0, len(time)) * (np.diff(time, append=9.0) > 1e-6))
    )
    assert sample_time == pytest.approx(1e-3, rel=0.02)
    assert notes[0].code == "time_jitters"
    assert np.nanstd(position) > 0.0
