"""Lines of a text log that are not rows of data are skipped, left out at the end, or refused."""

import warnings
from pathlib import Path

import numpy as np
import pytest

from plant.errors import LogError, LogWarning
from plant.log.files import read_record
from plant.log.formats.csv_cells import BLOCK_ROWS
from plant.log.formats.detect import open_tables
from plant.log.notes import LogCode
from plant.log.record import Record
from plant.notes import Note

HEADER = "time_s,motor_speed_rad_s,position_m,said"
ROWS = [f"{0.001 * k:.3f},{k % 7},{0.001 * k:.4f},text" for k in range(BLOCK_ROWS + 500)]


def written(tmp_path: Path, *lines: str, end: str = "\n") -> Path:
    path = tmp_path / "run.csv"
    path.write_text("\n".join((HEADER, *lines)) + end)
    return path


def read(path: Path) -> tuple[Record, list[Note]]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        record = read_record(path)
    return record, [one.message.note for one in caught if isinstance(one.message, LogWarning)]


@pytest.mark.parametrize("line", ["# pressed the button", "% half way", "//", HEADER, f"\ufeff{HEADER}", "#0.01,1,2,3"])
def test_a_comment_or_the_header_again_among_the_rows_is_skipped(line: str, tmp_path: Path) -> None:
    record, notes = read(written(tmp_path, *ROWS[:40], line, *ROWS[40:]))
    assert len(record) == len(ROWS)
    assert notes == [LogCode.LINES_SKIPPED.note(count=1)]


def test_a_byte_order_mark_within_a_log_is_ignored(tmp_path: Path) -> None:
    record, notes = read(written(tmp_path, *ROWS[:40], f"\ufeff{ROWS[40]}", *ROWS[41:]))
    assert (len(record), notes) == (len(ROWS), [])


def test_a_repeated_header_with_an_empty_name_is_skipped(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    lines = [f",{line}" for line in (HEADER, *ROWS[:40], HEADER, *ROWS[40:])]
    path.write_text("\n".join(lines) + "\n")
    record, notes = read(path)
    assert (len(record), notes) == (len(ROWS), [LogCode.LINES_SKIPPED.note(count=1)])


@pytest.mark.parametrize(
    ("after", "end"),
    [
        (["1.500,3,0.0"], ""),
        (["Mean,1,2,3", "Max,6,2,3"], "\n"),
        (["", "Mean,1,2,3"], "\n"),
        (["\0\0\0\0\0\0"], ""),
        (["end of test"] * 15, "\n"),
    ],
)
def test_a_cut_last_row_and_summary_lines_below_the_data_are_left_out(
    after: list[str], end: str, tmp_path: Path
) -> None:
    record, notes = read(written(tmp_path, *ROWS, *after, end=end))
    assert len(record) == len(ROWS)
    np.testing.assert_allclose(record["position_m"], 0.001 * np.arange(len(ROWS)))
    assert notes == [LogCode.END_LEFT_OUT.note(count=sum(map(bool, after)), taken=len(ROWS))]


def test_summary_lines_below_the_data_are_left_out_of_every_column(tmp_path: Path) -> None:
    (table,) = open_tables(written(tmp_path, *ROWS, "Mean,1,2,3"))
    with pytest.warns(LogWarning, match="lines after row 1500, .*: 1"):
        found = table.numbers()
    assert {place: len(values) for place, values in found.items()} == dict.fromkeys((0, 1, 2), len(ROWS))


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("Mean,1,2,3", "'Mean, 1, 2, 3'"),
        ("1,2", "'1, 2'"),
        ("range switched", "'range switched'"),
        ("ERR,ERR,ERR,ERR", "'ERR, ERR, ERR, ERR'"),
        ("0.04\0\0,5,0.004,x", "'0.04"),
        ('0.040,5,0.5,"x,1,2,text', "0.040, 5, 0.5, "),
    ],
)
def test_a_row_of_garbage_within_a_log_becomes_a_missing_sample_with_a_note(
    line: str, said: str, tmp_path: Path
) -> None:
    record, notes = read(written(tmp_path, *ROWS[:40], line, *ROWS[41:]))
    (left_out,) = (note for note in notes if note.code is LogCode.ROWS_LEFT_OUT)
    assert (left_out.data["count"], left_out.data["line"]) == (1, 42)
    assert said in str(left_out)
    assert np.flatnonzero(np.isnan(record["position_m"])).tolist() == [40]
    np.testing.assert_allclose(np.delete(record["position_m"], 40), np.delete(0.001 * np.arange(len(ROWS)), 40))


GARBAGE = (
    "x",
    '"',
    '",',
    "1,2",
    "1,2,3,4,5",
    "ERR,ERR,ERR,ERR",
    '0.5,"x,1,2',
    "#x",
    "Mean,1,2,3",
    "\0\0",
    '"a\nb"',
    ";;;",
)


@pytest.mark.parametrize("seed", range(12))
def test_garbage_shifts_no_sample_and_always_raises_a_note(seed: int, tmp_path: Path) -> None:
    rng, rows = np.random.default_rng(seed), list(ROWS)
    for place, line in zip(rng.integers(1, len(rows) - 1, 6), rng.choice(GARBAGE, 6), strict=True):
        if rng.random() < 0.5:
            rows.insert(place, str(line))
        else:
            rows[place] = ",".join([*rows[place].split(",")[:2], str(line), "text"])
    record, notes = read(written(tmp_path, *rows))
    there = np.isfinite(record["position_m"])
    assert len(record) == len(ROWS)
    assert np.count_nonzero(~there) <= 12
    np.testing.assert_allclose(record["position_m"][there], 0.001 * np.arange(len(ROWS))[there])
    assert notes


def test_a_cell_that_is_no_number_is_missing_and_the_rest_of_its_row_is_not(tmp_path: Path) -> None:
    record, notes = read(written(tmp_path, *ROWS[:40], "0.040,ERR,0.0400,text", *ROWS[41:]))
    wanted = {"column": "motor_speed_rad_s", "count": 1, "where": "line", "place": 42, "said": "ERR"}
    assert LogCode.CELLS_NO_NUMBERS.note(**wanted) in notes
    assert np.flatnonzero(np.isnan(record["motor_speed_rad_s"])).tolist() == [40]
    assert not np.isnan(record["position_m"]).any()


def test_a_quote_that_is_never_closed_swallows_no_rows(tmp_path: Path) -> None:
    record, _ = read(written(tmp_path, *ROWS[:40], '0.040,5,0.0400,"text', *ROWS[41:]))
    assert len(record) == len(ROWS)


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        (
            [*ROWS, *["end of test"] * 16],
            f"got 1 in row {len(ROWS) + 1}.* 16 of 1516 rows cannot be read, at most 1 % may be so",
        ),
        (["x,y,z,u"] * 16, "every row must hold numbers, .* 16 of 16 rows cannot be read, at most 1 % may be so"),
        ([*ROWS[:40], *["1,2"] * 16, *ROWS[40:]], "got 2 in row 41, .* 16 of 1516 rows cannot be read, at most 1 %"),
        ([*ROWS[:60], *["0.060,x,0.06,text"] * 2], "column 'motor_speed_rad_s' must hold numbers, got 'x' in row 61"),
        ([*ROWS[:9], "time_s,position_m,motor_speed_rad_s,said", *ROWS[9:]], "got another header in row 10"),
        ([*ROWS[:9], "Channels,4", "***End_of_Header***,,", *ROWS[9:]], "got another header in row 11"),
    ],
)
def test_many_rows_of_garbage_or_another_header_are_refused_with_their_row(
    lines: list[str], said: str, tmp_path: Path
) -> None:
    with pytest.raises(LogError, match=said):
        read_record(written(tmp_path, *lines))


def test_a_row_of_garbage_in_a_log_without_time_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path, *ROWS[:40], "1,2", *ROWS[40:])
    path.write_text(path.read_text().replace("time_s", "count"))
    with pytest.raises(LogError, match="got 2 in row 41"):
        read_record(path, sample_time=1e-3)


def test_a_row_with_an_invalid_date_becomes_a_missing_sample(tmp_path: Path) -> None:
    rows = [f"2026-03-01 12:00:{0.01 * k:06.3f},{k % 7},{0.001 * k:.4f},text" for k in range(500)]
    rows[40] = rows[40].replace("-03-", "-93-")
    record, notes = read(written(tmp_path, *rows))
    assert LogCode.ROWS_LEFT_OUT in [note.code for note in notes]
    assert np.flatnonzero(np.isnan(record["position_m"])).tolist() == [40]


def test_an_optional_channel_of_text_is_left_out_with_a_note(tmp_path: Path) -> None:
    path = written(tmp_path, *ROWS)
    path.write_text(path.read_text().replace("said", "differential_pressure_bar", 1))
    record, notes = read(path)
    assert "differential_pressure_pa" not in record
    left_out = {"channel": "differential_pressure_pa", "column": "differential_pressure_bar", "text": "text"}
    assert notes == [LogCode.CHANNEL_OF_TEXT.note(**left_out)]
    with pytest.raises(LogError, match="'differential_pressure_bar' must hold numbers, got 'text' in row 1"):
        read_record(path, required=("differential_pressure_pa",))


def test_a_number_in_a_column_of_dates_is_refused_as_not_a_date(tmp_path: Path) -> None:
    """The message used to ask for numbers, and to name a number as the fault."""
    stamps = [f"2026-11-29 10:00:00.{k:03d}" if k < 30 else f"{0.001 * k:.3f}" for k in range(60)]
    rows = [f"{stamp},{k}.5,0.{k:03d}" for k, stamp in enumerate(stamps)]
    (tmp_path / "log.csv").write_text("\n".join(["time,motor_speed_rad_s,position_m", *rows]))
    with pytest.raises(
        LogError, match=r"'time' must hold dates or times in every row, such as 2026.*, got '0\.030' in"
    ):
        read_record(tmp_path / "log.csv")


def test_placeholders_of_loggers_and_spreadsheets_for_no_value_are_missing(tmp_path: Path) -> None:
    rows = list(ROWS)
    for k, cell in enumerate(("-", "---", "OL", "#DIV/0!", "1.#QNAN", "-1.#IND")):
        rows[10 * k] = rows[10 * k].replace(f",{0.01 * k:.4f},", f",{cell},")
    record, _ = read(written(tmp_path, *rows))
    assert np.flatnonzero(np.isnan(record["position_m"])).tolist() == [0, 10, 20, 30, 40, 50]


@pytest.mark.parametrize(("delimiter", "cell"), [(",", '"-1,234.5"'), (";", "-1.234,5")])
def test_thousands_separators_are_read_if_a_fraction_identifies_the_decimal_sign(
    delimiter: str, cell: str, tmp_path: Path
) -> None:
    point = "," if delimiter == ";" else "."
    rows = [delimiter.join((f"{0.001 * k:.3f}".replace(".", point), "1", "2", cell)) for k in range(99)]
    path = tmp_path / "run.csv"
    header = "time_s,motor_speed_rad_s,position_m,differential_pressure_pa".replace(",", delimiter)
    path.write_text("\n".join((header, *rows)) + "\n")
    record, _ = read(path)
    assert set(record["differential_pressure_pa"]) == {-1234.5}


def test_comments_and_summary_rows_of_a_sheet_are_left_out_as_in_csv(tmp_path: Path) -> None:
    book = pytest.importorskip("openpyxl").Workbook()
    header = ("time_s", "motor_speed_rad_s", "position_m")
    rows = [(0.001 * k, k % 7 or None, 0.01 * k if k % 2 else f"{0.01 * k:.2f}") for k in range(150)]
    for row in (header, *rows[:70], ("# note", None, None), *rows[70:], (), ("Mean", 1, 2)):
        book.active.append(row)
    book.save(tmp_path / "run.xlsx")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        (table,) = open_tables(tmp_path / "run.xlsx")
        found = table.numbers()
    said = [one.message.note for one in caught if isinstance(one.message, LogWarning)]
    assert said == [LogCode.LINES_SKIPPED.note(count=1), LogCode.END_LEFT_OUT.note(count=1, taken=150)]
    np.testing.assert_allclose(found[2], 0.01 * np.arange(150))
    assert np.isnan(found[1][::7]).all()


@pytest.mark.parametrize("end", ["END", "END,,,", "\x1a", "Total,20", "1.5,3,0.0"])
def test_one_line_of_text_below_a_short_log_is_left_out_and_more_are_refused(end: str, tmp_path: Path) -> None:
    record, notes = read(written(tmp_path, *ROWS[:40], end))
    assert (len(record), notes) == (40, [LogCode.END_LEFT_OUT.note(count=1, taken=40)])
    with pytest.raises(LogError, match="row 41"):
        read(written(tmp_path, *ROWS[:40], end, end, *["END"] * (end != "END")))


def test_a_channel_whose_file_states_a_scale_is_read_with_a_warning(tmp_path: Path) -> None:
    above = ["Name;Speed;Way", "SampleTime[ms];1;1", "ScaleFactor;1;0,1", "Unit;rpm;mm", ""]
    path = tmp_path / "log.csv"
    path.write_text("\n".join([*above, *(f"{k};{100 * k % 700},5;{k % 9}" for k in range(50))]))
    columns = {"motor_speed_rad_s": "Speed", "position_m": "Way"}
    with pytest.warns(LogWarning, match="the scale factor 0.1 and the offset 0 for column 'Way'"):
        read_record(path, columns=columns)
