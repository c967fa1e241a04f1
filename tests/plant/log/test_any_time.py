import warnings
from pathlib import Path

import numpy as np
import pytest

from plant.errors import LogWarning
from plant.log.any_columns import read_any, time_of
from plant.log.frames import frame_table
from plant.log.notes import LogCode

ROWS = 50


def read_with(folder: Path, heading: str, times: list[str], **asked: str) -> tuple[float, list[str]]:
    """Return the sample time that a log with such times is read with, and the codes of what was said."""
    path = folder / "log.csv"
    rows = [f"{time},{0.1 * k:.1f},{0.2 * k:.1f}" for k, time in enumerate(times)]
    path.write_text("\n".join([f"{heading},u,y", *rows]))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        record = read_any(path, ["u", "y"], **asked)  # pyright: ignore[reportArgumentType]
    return record.sample_time, [str(one.message.note.code) for one in caught if isinstance(one.message, LogWarning)]


@pytest.mark.parametrize(
    ("unit", "seconds"), [("µs", 1e-6), ("ns", 1e-9), ("hr", 3_600.0), ("d", 86_400.0), ("min", 60.0), ("msec", 1e-3)]
)
def test_a_time_is_read_in_the_unit_that_its_heading_states(tmp_path: Path, unit: str, seconds: float) -> None:
    times = [repr(0.05 / seconds * k) for k in range(ROWS)]
    step, said = read_with(tmp_path, f"Time [{unit}]", times)
    assert step == pytest.approx(0.05)
    assert "time_unit_assumed" not in said


@pytest.mark.parametrize(
    ("begin", "step", "digits"),
    [
        (1_717_000_000_000.0, 10.0, 0),  # ms since 1970
        (1_717_000_000_000_000.0, 10_000.0, 0),  # us
        (134_176_000_000_000_000.0, 100_000.0, 0),  # ticks of Windows
        (45_000.0, 0.01 / 86_400.0, 11),  # days of a spreadsheet
    ],
)
def test_dates_without_a_unit_are_read_as_dates_and_not_as_seconds(
    tmp_path: Path, begin: float, step: float, digits: int
) -> None:
    times = [f"{begin + step * k:.{digits}f}" for k in range(ROWS)]
    found, said = read_with(tmp_path, "timestamp", times)
    assert found == pytest.approx(0.01, rel=1e-3)
    assert "time_is_dates" in said
    assert read_with(tmp_path, "stamp", times, time="stamp")[0] == pytest.approx(0.01, rel=1e-3)
    told = time_of(frame_table({"timestamp": begin + step * np.arange(ROWS), "y": np.arange(ROWS)}))
    assert told is not None
    assert float(np.diff(told).mean()) == pytest.approx(0.01, rel=1e-3)


def test_whole_numbers_or_a_unit_that_is_none_of_a_time_are_said_to_be_read_in_seconds(tmp_path: Path) -> None:
    counted = [str(5_123 + 10 * k) for k in range(ROWS)]
    assert read_with(tmp_path, "time", counted) == (10.0, ["time_unit_assumed"])
    assert read_with(tmp_path, "time [samples]", counted) == (10.0, ["time_unit_assumed"])
    assert read_with(tmp_path, "time_s", counted) == (10.0, [])
    assert read_with(tmp_path, "time [ms]", counted) == (pytest.approx(0.01), [])
    assert read_with(tmp_path, "time", counted, time="time:ms") == (pytest.approx(0.01), [])
    assert read_with(tmp_path, "time", counted, time="time") == (10.0, [])
    assert read_with(tmp_path, "time", [f"{0.2 * k:.1f}" for k in range(ROWS)]) == (pytest.approx(0.2), [])


def test_the_note_gives_column_and_step(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text("\n".join(["t,u", *(f"{20 * k},{k}" for k in range(ROWS))]))
    with pytest.warns(LogWarning, match="20 s apart") as caught:
        read_any(tmp_path / "log.csv")
    (note,) = [one.message.note for one in caught if isinstance(one.message, LogWarning)]
    assert note.code == LogCode.TIME_UNIT_ASSUMED
    assert dict(note.data) == {"column": "t", "step_s": 20.0}
