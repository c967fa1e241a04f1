from pathlib import Path

import numpy as np
import pytest

from plant.errors import LogError, LogWarning
from plant.log.clock.merging import SAME_TIME_TOLERANCE, LoggerChannels, _same_time, merge_loggers
from plant.log.files import read_record

T = 1e-3


def signal(time: np.ndarray) -> np.ndarray:
    return 40.0 * np.sin(30.0 * time)


def logger(path: Path, name: str, time: np.ndarray, stamps: np.ndarray | None = None) -> Path:
    rows = zip(time if stamps is None else stamps, signal(time), strict=True)
    path.write_text("\n".join([f"time_s,{name}", *(f"{t},{x:.9g}" for t, x in rows)]))
    return path


@pytest.mark.parametrize(("step", "late"), [(T, 0.3e-3), (T, 0.2), (4e-3, 0.0), (4e-3, 1.3e-3)])
def test_logs_of_two_loggers_are_merged_on_the_faster_clock_over_their_common_time(
    tmp_path: Path, step: float, late: float
) -> None:
    motor = logger(tmp_path / "a.csv", "motor_speed_rad_s", T * np.arange(2000))
    piston = logger(tmp_path / "b.csv", "velocity_m_s", late + step * np.arange(round(2.0 / step)))
    with pytest.warns(LogWarning) as caught:
        record = read_record(motor, beside=[piston])
    assert "loggers_merged" in [one.message.note.code for one in caught]
    assert record.sample_time == pytest.approx(T)
    there = np.isfinite(record["velocity_m_s"])
    assert there.mean() == pytest.approx(T / step, rel=0.02)
    assert np.abs(record["velocity_m_s"] - signal(record.time))[there].max() < 0.02
    np.testing.assert_allclose(record["motor_speed_rad_s"], signal(record.time), atol=1e-6)


def test_a_file_of_one_clock_is_merged_without_a_note(tmp_path: Path) -> None:
    time = T * np.arange(200)
    motor = logger(tmp_path / "a.csv", "motor_speed_rad_s", time)
    record = read_record(motor, beside=[logger(tmp_path / "b.csv", "position_cm", time)])
    assert list(record) == ["motor_speed_rad_s", "position_m"]


def test_two_logs_that_do_not_overlap_in_time_are_refused(tmp_path: Path) -> None:
    motor = logger(tmp_path / "a.csv", "motor_speed_rad_s", T * np.arange(200))
    other = logger(tmp_path / "b.csv", "position_m", 5.0 + T * np.arange(200))
    with pytest.raises(LogError, match=r"a\.csv \(0 to 0\.199 s\) and b\.csv \(5 to 5\.199 s\) do not overlap in time"):
        read_record(motor, beside=[other])


def test_a_channel_that_both_have_is_refused(tmp_path: Path) -> None:
    motor = logger(tmp_path / "a.csv", "position_m", T * np.arange(200))
    other = logger(tmp_path / "b.csv", "position_mm", T * np.arange(200))
    with pytest.raises(LogError, match="both give position_m, wanted one"):
        read_record(motor, beside=[other])


def test_merging_a_log_with_dates_and_one_without_is_refused(tmp_path: Path) -> None:
    time = T * np.arange(200)
    dates = np.datetime64("2026-03-01T00:00:00", "ms") + np.arange(200)
    motor = logger(tmp_path / "a.csv", "motor_speed_rad_s", time, dates)
    with pytest.raises(LogError, match=r"a\.csv has dates and b\.csv has not"):
        read_record(motor, beside=[logger(tmp_path / "b.csv", "position_m", time)])


@pytest.mark.parametrize("begin", [0.0, 1000.0])
def test_clocks_are_compared_with_a_tolerance_relative_to_their_step(begin: float) -> None:
    time = begin + T * np.arange(200)
    assert _same_time(time, time + 0.5 * SAME_TIME_TOLERANCE * T)
    assert not _same_time(time, time + 2.0 * SAME_TIME_TOLERANCE * T)


def test_the_refusal_of_logs_that_do_not_overlap_suggests_an_exchanged_day_and_month(tmp_path: Path) -> None:
    """01/03/2026 used to be read as 3 January beside a logger of 1 March, without a message."""
    steps = 0.01 * np.arange(300)
    american, iso = (np.array([f"{day} 12:00:{one:06.3f}" for one in steps]) for day in ("01/03/2026", "2026-03-01"))
    motor = logger(tmp_path / "a.csv", "motor_speed_rad_s", steps, american)
    other = logger(tmp_path / "b.csv", "position_m", steps, iso)
    with pytest.raises(LogError, match=r"2026-01-03 12:00:00 to .*2026-03-01 12:00:00 to .*may be exchanged"):
        read_record(motor, beside=[other])


@pytest.mark.parametrize("count", [1, 2])
def test_channels_of_a_logger_that_took_no_sample_are_missing_and_the_others_are_read(count: int) -> None:
    time = 0.001 * np.arange(50.0)
    full = [LoggerChannels("a", time, {"position_m": time}), LoggerChannels("b", time, {"velocity_m_s": time})][:count]
    empty = LoggerChannels("c", time[:0], {"differential_pressure_pa": time[:0]})
    merged = merge_loggers([empty, *full], "log").channels
    assert np.isnan(merged["differential_pressure_pa"]).all()
    assert all(len(values) == 50 for values in merged.values())
    assert len(merged) == count + 2
