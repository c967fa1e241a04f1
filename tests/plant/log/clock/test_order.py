"""Rows that are not in the order of time are sorted only where nothing else explains it."""

import warnings
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from plant.errors import LogError, LogWarning
from plant.log.clock.order import in_order
from plant.log.columns import TIME
from plant.log.files import read_record
from plant.log.notes import LogCode
from plant.log.record import Record
from plant.notes import Note

ROWS = np.arange(400.0)
LOG = pd.DataFrame({"time_s": 1e-3 * ROWS, "motor_speed_rad_s": 50.0 + ROWS, "position_m": 1e-3 * ROWS})


def read(log: pd.DataFrame, folder: Path) -> tuple[Record, list[object]]:
    log.to_csv(folder / "log.csv", index=False)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        record = read_record(folder / "log.csv")
    return record, [one.message.note.code for one in said if isinstance(one.message, LogWarning)]


def with_dates(log: pd.DataFrame) -> pd.DataFrame:
    dates = pd.Timestamp("2026-03-04 23:59:59.9") + pd.to_timedelta(log["time_s"], unit="s")
    return log.assign(time_s=dates.dt.strftime("%Y-%m-%d %H:%M:%S.%f")).rename(columns={"time_s": "Time"})


@pytest.mark.parametrize("seed", range(3))
def test_rows_in_any_order_are_sorted_with_a_note(seed: int, tmp_path: Path) -> None:
    record, codes = read(LOG.sample(frac=1.0, random_state=seed), tmp_path)
    assert codes == [LogCode.ROWS_SORTED]
    np.testing.assert_array_equal(record["motor_speed_rad_s"], LOG["motor_speed_rad_s"])


def test_rows_with_dates_and_the_newest_first_are_read_from_the_last_on(tmp_path: Path) -> None:
    record, codes = read(with_dates(LOG)[::-1], tmp_path)
    assert codes == [LogCode.ROWS_NEWEST_FIRST]
    np.testing.assert_array_equal(record["position_m"], LOG["position_m"])
    assert record.metadata["began"] == read(with_dates(LOG), tmp_path)[0].metadata["began"]


def test_numbers_that_fall_throughout_may_count_down_and_are_refused(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="falls from row to row; if the newest row stands first, turn the rows round"):
        read(LOG[::-1], tmp_path)


@pytest.mark.parametrize(
    "time",
    [
        np.r_[ROWS[200:], ROWS[:200]],  # a clock that begins again
        np.r_[ROWS[:200], ROWS[:200]],  # another test
        np.r_[ROWS[:200], ROWS[150:350]],  # buffers that overlap
        ROWS + 0.8 * np.sin(1.7 * ROWS),  # stamps that jitter
        (ROWS + 65_300.0) % 65_536.0,  # a counter that runs over
    ],
)
def test_rows_stay_where_something_else_may_be_wrong_with_the_time(time: np.ndarray) -> None:
    notes: list[Note] = []
    columns = {TIME: 1e-3 * time, "position_m": ROWS}
    assert in_order(columns, notes) is columns
    assert not notes
