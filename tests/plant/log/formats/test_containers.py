"""Workbooks and HDF5 files may hold more than logs: other content is skipped, and a log keeps its meaning."""

import re
import zipfile
from datetime import date, datetime, time, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from plant.errors import LogError, LogWarning
from plant.log.columns import Column
from plant.log.formats import hdf5, json_text, xlsx
from plant.log.formats.detect import open_tables
from plant.log.formats.hdf5 import NO_VECTORS, open_hdf5
from plant.log.formats.mat import tables_of
from plant.log.formats.xlsx import open_xlsx
from plant.log.table import Table

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


def test_duration_cells_of_a_sheet_are_read_in_seconds(tmp_path: Path) -> None:
    rows = [["Time", "position_m"], *([timedelta(milliseconds=100 * k), 0.01 * k] for k in range(6))]
    (table,) = open_xlsx(workbook(tmp_path / "log.xlsx", rows))
    assert table.headings[0].unit == "s"
    np.testing.assert_allclose(read(table)["Time"], 0.1 * np.arange(6))


def test_sheets_without_rows_of_numbers_are_passed_over(tmp_path: Path) -> None:
    path = workbook(tmp_path / "log.xlsx", [["a title"]], NUMBERS, [[None, None]])
    (table,) = open_xlsx(path)
    assert names(table) == ["time_s", "position_m"]
    with pytest.raises(LogError, match="no sheet has rows of numbers"):
        open_xlsx(workbook(tmp_path / "none.xlsx", [["a title"]], []))


def test_an_empty_sheet_of_charts_is_passed_over(tmp_path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.load_workbook(workbook(tmp_path / "log.xlsx", NUMBERS))
    book.create_chartsheet("Chart")
    book.save(tmp_path / "log.xlsx")
    assert len(open_xlsx(tmp_path / "log.xlsx")) == 1


def test_columns_take_their_units_from_a_list_of_channels_on_another_sheet(tmp_path: Path) -> None:
    rows = [["T", "Pos [m]", "DP", "A"], *([0.001 * k, 1.0 * k, 2.0 * k, 3.0 * k] for k in range(30))]
    listed = [["channels"], [None], ["No", "Channel", "Einheit", "Sensor"], [1, "T", "s", "clock"]]
    listed += [[2, "Pos [m]", "mm", "LVDT"], [3, "DP", "bar", "A"], [4, "A", "V", "none"], [5, "unused"]]
    for place, sheets in enumerate(((rows, listed), (listed, rows))):
        tables = open_xlsx(workbook(tmp_path / f"{place}.xlsx", *sheets))
        (found,) = [one.headings for one in tables if "DP" in names(one)]
        assert [one.unit for one in found] == [
            "s",
            "m",
            "bar",
            None,
        ]  # A is a sensor in bar and a channel in V, so it gets no unit
    (alone,) = open_xlsx(workbook(tmp_path / "alone.xlsx", rows))
    assert [one.unit for one in alone.headings] == [None, "m", None, None]


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
        (True, "1"),
    ],
)
def test_a_cell_is_converted_to_the_text_of_a_csv_log(cell: Any, said: str) -> None:
    assert xlsx._cell_text(cell) == said


def test_hdf5_fields_named_columns_and_units_are_read_and_other_data_sets_are_skipped(tmp_path: Path) -> None:
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


def test_a_matlab_hdf5_matrix_is_transposed_and_files_without_numbers_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "log.mat"
    with h5py.File(path, "w") as file:
        file["record/data"] = np.arange(10.0).reshape(2, 5)
        file["record/data"].attrs["MATLAB_class"] = np.bytes_("double")
    (table,) = open_hdf5(path)
    assert len(table.headings) == 2
    assert read(table)[names(table)[1]] == pytest.approx(np.arange(5.0, 10.0))
    with h5py.File(path, "w") as file:
        file["text"] = "nothing else"
    with pytest.raises(LogError, match=re.escape(NO_VECTORS)):
        open_hdf5(path)
    with h5py.File(tmp_path / "none.h5", "w") as file:
        file["text"] = "nothing else"
    with pytest.raises(LogError, match="no vector of numbers"):
        open_hdf5(tmp_path / "none.h5")


def test_a_workbook_is_known_by_its_content_whatever_its_suffix(tmp_path: Path) -> None:
    path = workbook(tmp_path / "log.xlsx", [["time_s", "position_mm"], *([0.1 * k, k] for k in range(9))])
    (table,) = open_tables(path.rename(tmp_path / "log.csv"))
    assert names(table) == ["time_s", "position_mm"]


def test_an_archive_without_a_workbook_is_no_log(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "logs.xlsx", "w") as archive:
        archive.writestr("log.csv", "time_s,position_m\n0,0\n")
    with pytest.raises(LogError, match="a zip archive is no log: unpack it first"):
        open_xlsx(tmp_path / "logs.xlsx")


def test_empty_columns_and_rows_of_a_sheet_are_left_out() -> None:
    rows = [["time_s", "position_m", None], *([0.1 * k, 0.01 * k, None] for k in range(6)), [None, None]]
    table = xlsx._table(Path("log.xlsx"), "sheet", rows)
    assert table is not None
    assert names(table) == ["time_s", "position_m"]
    assert read(table)["position_m"] == pytest.approx(0.01 * np.arange(6))


@pytest.mark.parametrize(
    "rows",
    [
        [[" ", "  "]] * 4,
        [["a;b;c;d", None], *[["1;2;3;4", None]] * 5, [None, "x"]],
    ],
    ids=["blanks", "text with delimiters"],
)
def test_a_sheet_of_text_is_no_table(rows: list[list[Any]]) -> None:
    assert xlsx._table(Path("log.xlsx"), "sheet", rows) is None


def test_dates_and_numbers_of_a_sheet_are_read_and_text_among_them_is_refused_with_its_row(tmp_path: Path) -> None:
    noon = datetime(2026, 3, 1, 12)
    rows = [["when", "force", "way_mm"], *([noon + timedelta(seconds=k), 0.5 * k, str(k)] for k in range(6))]
    (table,) = open_xlsx(workbook(tmp_path / "log.xlsx", rows))
    values = read(table)
    np.testing.assert_array_equal(np.diff(values["when"]), np.timedelta64(1, "s"))
    assert values["force"] == pytest.approx(0.5 * np.arange(6))
    assert values["way_mm"] == pytest.approx(np.arange(6))
    rows[4][1] = "broken"
    (table,) = open_xlsx(workbook(tmp_path / "spoilt.xlsx", rows))
    with pytest.raises(LogError, match=r"spoilt\.xlsx: .*force.*broken.*row 4"):
        table.read([Column(1, "force", "force")])
    rows[5][0] = "later"
    (table,) = open_xlsx(workbook(tmp_path / "late.xlsx", rows))
    with pytest.raises(LogError, match=r"when.*later.*row 5"):
        table.read([Column(0, "when", "time_s")])


def test_a_workbook_beyond_the_unpacking_limit_or_cut_short_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = workbook(tmp_path / "log.xlsx", NUMBERS)
    with monkeypatch.context() as patch:
        patch.setattr(xlsx, "most_unpacked", lambda _: 1000)
        with pytest.raises(LogError, match="it unpacks to more than"):
            open_xlsx(path)
    infos = zipfile.ZipFile.infolist

    def beyond(archive: zipfile.ZipFile) -> list[zipfile.ZipInfo]:
        found = infos(archive)
        found[-1].header_offset = 10**6
        return found

    monkeypatch.setattr(zipfile.ZipFile, "infolist", beyond)
    with pytest.raises(zipfile.BadZipFile, match="it ends too early"):
        open_xlsx(path)


def matlab(file: Any, name: str, text: str) -> None:
    file[name] = np.frombuffer(text.encode("utf-16-le"), dtype="<u2")
    file[name].attrs["MATLAB_class"] = np.bytes_("char")


def test_only_the_written_record_is_read_from_a_matlab_hdf5_file(tmp_path: Path) -> None:
    path = tmp_path / "log.mat"
    with h5py.File(path, "w") as file:
        file["record/position_m"] = np.arange(5.0)
        matlab(file, "record/metadata_json", '{"rig": 7}')
        matlab(file, "record/comment", "none")
        file["beside/noise"] = np.arange(9.0)
    (table,) = open_hdf5(path)
    assert (names(table), table.metadata) == (["position_m"], '{"rig": 7}')


@pytest.mark.parametrize("text", [False, True])
def test_hdf5_of_more_than_a_log_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: bool) -> None:
    path = tmp_path / "log.mat"
    with h5py.File(path, "w") as file:
        if text:
            matlab(file, "record/metadata_json", "x" * 100)
        else:
            file["record/position_m"] = np.arange(100.0)
    monkeypatch.setattr(hdf5, "most_unpacked", lambda _: 199)
    with pytest.raises(LogError, match="it unpacks to more than"):
        open_hdf5(path)


def test_what_simulink_calls_a_structure_with_time_is_a_table() -> None:
    signals = [
        {"label": "speed", "values": np.arange(5.0)},
        {"label": " ", "values": np.arange(10.0).reshape(5, 2)},
        {"label": "text", "values": "none"},
    ]
    (table,) = tables_of({"out": {"time": np.arange(5.0), "signals": signals}}, "a.mat")
    assert names(table) == ["time", "speed", "signal 2 1", "signal 2 2"]
    assert table.headings[0].said == "s"
    (alone,) = tables_of({"out": {"time": np.arange(5.0), "signals": signals[0]}}, "a.mat")
    assert names(alone) == ["time", "speed"]


def test_nested_structs_give_columns_with_both_names_and_a_file_without_vectors_is_refused() -> None:
    (table,) = tables_of({"log": {"rod": {"way": np.arange(4.0)}, "speed": np.arange(4.0), "who": "me"}}, "a.mat")
    assert names(table) == ["rod.way", "speed"]
    with pytest.raises(LogError, match=re.escape(f"a.mat: {NO_VECTORS}")):
        tables_of({"gain": np.array(1.0), "who": "me"}, "a.mat")


@pytest.mark.parametrize(
    ("start", "said"),
    [
        (b"|CF,2,1,1;|CK,1,3,1,1;", "imc FAMOS cannot be read: export it as CSV"),
        (b"#ROSBAG V2.0\n", "bag of ROS"),
        (b";$FILEVERSION=1.1\r\n;$STARTTIME=46093.4\r\n", "raw frames of a bus cannot be read: decode them"),
        (b"date Thu Mar 12 10:11:12 am 2026\r\nbase hex  timestamps absolute\r\n", "raw frames of a bus"),
        (b"(1773310272.000000) can0 100#0001020304050607\n", "raw frames of a bus"),
        (b"\x89MCAP0\r\n", "bag of ROS"),
        (b"LOGG\x90\0\0\0", "by Vector"),
        (b"SQLite format 3\0", "export the table"),
        (b"<?xml version='1.0'?><usi:tdm/>", "XML or HTML"),
        (b"\xef\xbb\xbf <TABLE border=1><tr>", "XML or HTML"),
    ],
)
def test_unsupported_bench_formats_are_refused_with_the_remedy(tmp_path: Path, start: bytes, said: str) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(start + bytes(600))
    with pytest.raises(LogError, match=said):
        open_tables(path)


def test_a_boolean_among_numbers_is_missing_and_formulas_without_stored_values_are_refused(tmp_path: Path) -> None:
    rows: list[list[Any]] = [["t", "x"], *([0.1 * k, float(k)] for k in range(200))]
    rows[50][1] = True
    (table,) = open_xlsx(workbook(tmp_path / "log.xlsx", rows))
    with pytest.warns(LogWarning, match="'TRUE' in line 51"):
        assert np.flatnonzero(np.isnan(read(table)["x"])).tolist() == [49]
    rows[50][1] = 49.0
    (table,) = open_xlsx(workbook(tmp_path / "log.xlsx", [["t", "x", "y"], *([t, f"={x}*2", x] for t, x in rows[1:])]))
    with pytest.raises(LogError, match="column 'x' is empty in 200 rows, and values of formulas are not stored"):
        table.read([Column(1, "x", "position_m")])


def test_netcdf_scale_offset_fill_value_and_units_are_applied(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "log.h5", "w") as file:
        way = file.create_dataset("way", data=np.arange(20, dtype="i2"))
        way.attrs.update({"scale_factor": 0.5, "add_offset": [3.0], "_FillValue": np.int16(7), "units": "mm"})
        time_ = file.create_dataset("time", data=np.arange(20.0))
        time_.attrs.update({"units": "milliseconds since 2026-01-01", "scale_factor": "text", "add_offset": np.nan})
        file["speed"] = np.arange(20.0)
    (table,) = open_hdf5(tmp_path / "log.h5")
    assert {one.name: one.unit for one in table.headings} == {"way": "mm", "time": "milliseconds", "speed": None}
    wanted = np.where(np.arange(20) == 7, np.nan, 3.0 + 0.5 * np.arange(20))
    np.testing.assert_array_equal(read(table)["way"], wanted)
    for name in ("time", "speed"):
        np.testing.assert_array_equal(read(table)[name], np.arange(20.0))


def test_json_of_more_parts_than_a_log_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "log.json").write_text("[" + ",".join(["[]"] * 30) + "]")
    monkeypatch.setattr(json_text, "MOST_PARTS", 30)
    with pytest.raises(LogError, match="it has more than 30 lists and objects"):
        open_tables(tmp_path / "log.json")
    monkeypatch.setattr(json_text, "MOST_PARTS", 31)
    with pytest.raises(LogError, match="JSON is read as"):
        open_tables(tmp_path / "log.json")


def test_an_hdf5_data_set_is_read_under_each_link_and_cyclic_groups_end_the_search(tmp_path: Path) -> None:
    path = tmp_path / "log.h5"
    with h5py.File(path, "w") as file:
        run = file.create_group("run")
        run["position_m"] = np.arange(20.0)
        run["a"], run["again"], file["#refs#"] = run["position_m"], file, run
    tables = open_hdf5(path)
    assert [(one.label, [heading.name for heading in one.headings]) for one in tables] == [("run", ["a", "position_m"])]
