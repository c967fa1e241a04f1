"""Workbooks and HDF5 files hold more than numbers: what is no log is passed over, what is one keeps its meaning."""

import re
import zipfile
from datetime import date, datetime, time, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from plant.errors import LogError
from plant.log import xlsx
from plant.log.hdf5 import OBJECTS, open_hdf5
from plant.log.table import Table
from plant.log.xlsx import open_xlsx

h5py = pytest.importorskip("h5py")
openpyxl = pytest.importorskip("openpyxl")


def workbook(path: Path, *sheets: list[list[Any]]) -> Path:
    book = openpyxl.Workbook()
    book.remove(book.active)
    for rows in sheets:
        sheet = book.create_sheet()
        for row in rows:
            sheet.append(row)
    book.save(path)
    return path


def names(table: Table) -> list[str]:
    return [one.name for one in table.headings]


def read(table: Table) -> dict[str, np.ndarray]:
    return {table.headings[place].name: values for place, values in table.numbers().items()}


NUMBERS = [["time_s", "position_m"], *([0.1 * k, 0.01 * k] for k in range(6))]


def test_sheets_without_rows_of_numbers_are_passed_over(tmp_path: Path) -> None:
    path = workbook(tmp_path / "log.xlsx", [["a title"]], NUMBERS, [[None, None]])
    (table,) = open_xlsx(path)
    assert names(table) == ["time_s", "position_m"]
    with pytest.raises(LogError, match="no sheet has rows of numbers"):
        open_xlsx(workbook(tmp_path / "none.xlsx", [["a title"]], []))


def test_too_many_cells_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(xlsx, "MOST_CELLS", 5)
    with pytest.raises(LogError, match="more than 5 cells"):
        open_xlsx(workbook(tmp_path / "log.xlsx", NUMBERS))


@pytest.mark.parametrize(
    ("cell", "said"),
    [
        (datetime(2026, 1, 2, 3, 4, 5), "2026-01-02 03:04:05"),
        (time(3, 4, 5), "03:04:05"),
        (timedelta(seconds=1.5), "1.5"),
        (date(2026, 1, 2), "2026-01-02"),
        (None, ""),
        (" a \n b ", "a b"),
        (0.1, "0.1"),
    ],
)
def test_a_cell_is_said_as_a_text_log_would_have_it(cell: Any, said: str) -> None:
    assert xlsx._said(cell) == said


def test_a_cell_is_a_number_of_seconds_a_missing_sample_or_a_decimal() -> None:
    assert xlsx._number(timedelta(minutes=1), ".") == 60.0
    assert np.isnan(xlsx._number(None, "."))
    assert xlsx._number("1,5", ",") == 1.5


def test_hdf5_gives_fields_named_columns_and_units_and_passes_over_what_is_no_vector(tmp_path: Path) -> None:
    path = tmp_path / "log.h5"
    rows = np.zeros(5, dtype=[("time_s", "f8"), ("name", "S3"), ("speed", "i4")])
    rows["speed"] = np.arange(5)
    with h5py.File(path, "w") as file:
        file["table/rows"] = rows
        file["table/grid"] = np.zeros((2, 2), dtype=rows.dtype)
        file["table/text"] = "a title"
        file["table/nothing"] = np.zeros(0)
        file["matrix/data"] = np.arange(10.0).reshape(5, 2)
        file["matrix/data"].attrs["columns"] = np.array([b"time_s", b"force_n"])
        file["vector/position"] = np.arange(5.0)
        file["vector/position"].attrs["unit"] = np.array([b"mm"])
    found = {table.label: table for table in open_hdf5(path)}
    assert sorted(found) == ["matrix", "table", "vector"]
    assert names(found["table"]) == ["time_s", "speed"]
    assert read(found["table"])["speed"] == pytest.approx(np.arange(5.0))
    assert read(found["matrix"])["force_n"] == pytest.approx([1.0, 3.0, 5.0, 7.0, 9.0])
    assert found["vector"].headings[0].said == "mm"


def test_hdf5_of_matlab_counts_the_other_way_and_keeps_its_metadata(tmp_path: Path) -> None:
    path = tmp_path / "log.mat"
    with h5py.File(path, "w") as file:
        file["record/data"] = np.arange(10.0).reshape(2, 5)
        file["record/data"].attrs["MATLAB_class"] = np.bytes_("double")
    (table,) = open_hdf5(path)
    assert len(table.headings) == 2
    assert read(table)[names(table)[1]] == pytest.approx(np.arange(5.0, 10.0))
    with h5py.File(path, "w") as file:
        file["text"] = "nothing else"
    with pytest.raises(LogError, match=re.escape(OBJECTS)):
        open_hdf5(path)
    with h5py.File(tmp_path / "none.h5", "w") as file:
        file["text"] = "nothing else"
    with pytest.raises(LogError, match="no vector of numbers"):
        open_hdf5(tmp_path / "none.h5")


def test_an_archive_without_a_workbook_is_no_log(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "logs.xlsx", "w") as archive:
        archive.writestr("log.csv", "time_s,position_m\n0,0\n")
    with pytest.raises(LogError, match="a zip archive is no log: unpack it first"):
        open_xlsx(tmp_path / "logs.xlsx")
