"""Whole seconds and the parts of a second beside them are one time, if they are so in every row."""

import warnings
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from plant.errors import LogError, LogWarning
from plant.log.files import read_record
from plant.log.formats.split_seconds import with_joined_seconds
from plant.log.notes import LogCode
from plant.log.table import table_of

N = 2500
MS = 700 + np.arange(N)
RAMP = np.sin(0.01 * np.arange(N))


def read(path: Path, clock: Mapping[str, object], columns: Mapping[str, str]) -> tuple[float, int, list[LogCode]]:
    pd.DataFrame({**clock, "motor_speed_rpm": 900.0 * RAMP, "position_mm": RAMP}).to_csv(path, index=False)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        record = read_record(path, columns=columns)
    codes = [one.message.note.code for one in caught if isinstance(one.message, LogWarning)]
    return record.sample_time, len(record), [one for one in codes if one == LogCode.TIME_JOINED]


@pytest.mark.parametrize(
    ("clock", "columns"),
    [
        ({"stamp.sec": MS // 1000, "stamp.nanosec": MS % 1000 * 10**6}, {"time_s": "stamp.sec:s"}),
        ({"Time [s]": MS // 1000, "ms": MS % 1000}, {}),
        ({"tv_sec": 1773310272 + MS // 1000, "tv_usec": MS % 1000 * 1000}, {"time_s": "tv_sec:s"}),
        ({"Time": [f"10:11:{12 + one // 1000}" for one in MS], "Millitm": MS % 1000}, {}),
    ],
)
def test_seconds_and_parts_of_a_second_are_one_time(
    tmp_path: Path, clock: Mapping[str, object], columns: Mapping[str, str]
) -> None:
    sample_time, rows, codes = read(tmp_path / "log.csv", clock, columns)
    assert (sample_time, rows) == (pytest.approx(1e-3, rel=1e-6), N)
    assert codes == [LogCode.TIME_JOINED]


@pytest.mark.parametrize(
    "parts",
    [
        MS,  # over a second
        (MS + 300) % 1000,  # falls elsewhere
        np.where(np.arange(N) == 7, np.nan, MS % 1000),
        np.full(N, 5),
    ],
)
def test_a_column_that_is_no_part_of_a_second_is_not_added(tmp_path: Path, parts: object) -> None:
    with pytest.raises(LogError, match="time_s must increase"):
        read(tmp_path / "log.csv", {"Time [s]": MS // 1000, "ms": parts}, {})


@pytest.mark.parametrize(
    ("seconds", "name"), [(MS / 1000.0, "ms"), (MS // 1000, "delay"), (MS // 1000 * 2, "ms"), (-(MS // 1000), "ms")]
)
def test_other_columns_stay_as_they_are(seconds: np.ndarray, name: str) -> None:
    table = table_of("log", {"time": seconds, name: MS % 1000})
    np.testing.assert_array_equal(with_joined_seconds(table).numbers()[0], seconds)


def test_a_time_in_another_unit_is_not_joined() -> None:
    table = table_of("log", {"time_ms": MS // 1000, "ns": MS % 1000 * 10**6})
    assert with_joined_seconds(table) is table
