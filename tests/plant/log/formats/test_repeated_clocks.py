"""A clock that stands beside each channel is one clock, if all are equal; else none is chosen."""

from pathlib import Path

import numpy as np
import pytest

from plant.errors import LogError
from plant.log.files import read_record

NAMES = ("motor_speed_rpm", "position_mm", "velocity_mm_s")


def log(path: Path, clock: str, *, late: bool = False) -> Path:
    lines = [",".join(cell for name in NAMES for cell in (clock, name))]
    for k in range(60):
        times = [f"2026-03-01 12:00:00.{k:03d}" if clock == "stamp" else f"{0.001 * k:.3f}" for _ in NAMES]
        if late and k == 59:
            times[-1] = "0.060"
        lines.append(",".join(cell for time in times for cell in (time, f"{200.0 * np.sin(0.1 * k):.6f}")))
    path.write_text("\n".join(lines))
    return path


@pytest.mark.parametrize("clock", ["time_s", "Time [s]", "stamp"])
def test_equal_clocks_beside_each_channel_are_one(tmp_path: Path, clock: str) -> None:
    record = read_record(log(tmp_path / "log.csv", clock))
    assert record.sample_time == pytest.approx(1e-3)
    assert set(record.channels) == {"motor_speed_rad_s", "position_m", "velocity_m_s"}


def test_clocks_that_differ_in_one_row_are_refused(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="both give time_s"):
        read_record(log(tmp_path / "log.csv", "time_s", late=True))


def test_an_equal_clock_of_another_name_keeps_it(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(
        "\n".join(["t,Timestamp,motor_speed_rpm,position_mm", *(f"{k},{k},{9 * k},{k}" for k in range(60))])
    )
    assert read_record(path, columns={"time_s": "Timestamp:ms"}).sample_time == pytest.approx(1e-3)


def test_equal_columns_of_one_name_in_a_unit_of_time_are_one_clock(tmp_path: Path) -> None:
    path = log(tmp_path / "log.csv", "x[s]")
    with pytest.raises(LogError, match="column time_s is missing"):
        read_record(path)
    assert read_record(path, columns={"time_s": "x[s]"}).sample_time == pytest.approx(1e-3)
