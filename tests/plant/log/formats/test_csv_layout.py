from pathlib import Path

import pytest

from plant.errors import LogError
from plant.log.formats import csv_layout
from plant.log.formats.csv_layout import Layout, layout_of, layout_of_lines


def layout(*lines: str) -> Layout:
    return layout_of_lines(lines, "utf-8", "a.csv")


def names(made: Layout) -> list[str]:
    return [one.name for one in made.headings]


@pytest.mark.parametrize("delimiter", [",", ";", "\t", "|", "  "])
def test_the_delimiter_that_gives_most_numbers_is_taken(delimiter: str) -> None:
    made = layout(*(delimiter.join(row) for row in (("t", "x", "v"), ("0.0", "1.0", "2.0"), ("0.1", "1.5", "2.5"))))
    assert (made.delimiter.strip(" "), names(made)) == (delimiter.strip(" "), ["t", "x", "v"])


def test_lines_above_the_header_are_skipped() -> None:
    made = layout("sep=;", "Bench;3", "Rate;1000", "", "t;x;v", "0,0;1,0;2", "0,1;1,5;3")
    assert (made.skipped, names(made), made.decimal_point) == (5, ["t", "x", "v"], ",")


def test_a_row_of_units_gives_the_units() -> None:
    made = layout("Time,Speed,Note", "[s],[rpm],", "0.0,1.0,a", "0.1,1.5,b")
    assert [(one.name, one.unit) for one in made.headings] == [("Time", "s"), ("Speed", "rpm"), ("Note", None)]


def test_a_log_without_a_header_has_numbered_columns() -> None:
    assert names(layout("0.0,1.0", "0.1,1.5")) == ["column 1", "column 2"]


def test_a_delimiter_at_the_end_of_every_row_gives_a_numbered_column() -> None:
    assert names(layout("t;x", "0;1;", "1;2;")) == ["t", "x", "column 3"]


@pytest.mark.parametrize("units", [[], ["s,mm,"], ["s,mm"]])
def test_a_delimiter_at_the_end_of_the_header_alone_loses_no_names(units: list[str]) -> None:
    made = layout_of_lines(["t,x,", *units, "0,1.5", "1,2.5"], "utf-8", "a.csv")
    assert [one.name for one in made.headings] == ["t", "x"]
    assert [one.unit for one in made.headings] == (["s", "mm"] if units else [None, None])


def test_names_for_more_columns_than_the_rows_have_are_not_guessed() -> None:
    made = layout_of_lines(["t,x,v", "0,1.5", "1,2.5"], "utf-8", "a.csv")
    assert [one.name for one in made.headings] == ["column 1", "column 2"]


def test_a_first_row_with_text_cells_is_not_taken_for_the_header() -> None:
    assert layout("t,x,v", "0.0,oops,oops", "0.1,1.5,2.5", "0.2,1.5,2.5").skipped == 1


def test_dates_are_told_from_numbers() -> None:
    assert layout("t,x", "12:00:00.1,1", "12:00:00.2,2").stamped == {0}


def test_blank_lines_alone_are_refused() -> None:
    with pytest.raises(LogError, match="a header line is needed, but the file is empty"):
        layout("", " ")


def test_utf_16_without_a_byte_order_mark_is_recognised(tmp_path: Path) -> None:
    text = "t,x\n" + "".join(f"{k},{k}\n" for k in range(20))
    for encoding in ("utf-16-le", "utf-16-be"):
        path = tmp_path / encoding
        path.write_bytes(text.encode(encoding))
        made = layout_of(path)
        assert (made.encoding, names(made)) == (encoding, ["t", "x"])
    (tmp_path / "binary").write_bytes(bytes(range(64)) * 4)
    with pytest.raises(LogError, match="a text file is needed for a CSV log, got binary data"):
        layout_of(tmp_path / "binary")


def test_a_line_cut_at_the_end_of_the_examined_bytes_does_not_change_the_layout(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.csv"
    path.write_text("t,x\n0.0,1.0\n0.1,2.0\n")
    whole = layout_of(path)
    monkeypatch.setattr(csv_layout, "INSPECTED_BYTES", 16)  # within the second row
    assert layout_of(path) == whole


def test_a_block_above_a_blank_line_is_not_the_header() -> None:
    made = layout("bench,3", "rate,1000", "", "t,x", "", *(f"0.{k},{k}.0" for k in range(6)))
    assert names(made) == ["t", "x"]


def test_a_row_of_units_below_a_second_row_of_names_is_found() -> None:
    made = layout("t,x", "time,way", "s,mm", "0.0,1.0", "0.1,2.0")
    assert [one.unit for one in made.headings] == ["s", "mm"]


def test_in_a_log_without_numbers_the_first_nonblank_line_is_the_header() -> None:
    made = layout("", "name;place", "press;hall", "lift;yard")
    assert (names(made), made.skipped, made.delimiter) == (["name", "place"], 2, ";")
    assert layout("name,place", "press,hall").skipped == 1


def test_a_comma_is_the_delimiter_if_the_header_has_as_many_commas_as_the_rows() -> None:
    made = layout("time_s,motor_speed_rad_s", "0,1", "1,x")
    assert (names(made), made.delimiter, made.decimal_point) == (["time_s", "motor_speed_rad_s"], ",", ".")
    assert layout("Weg", "0,1", "1,x").decimal_point == ","


def test_rows_of_units_with_micrometres_or_unit_words_are_recognised() -> None:
    made = layout("Zeit,Weg", "(ms),(µm)", "", "0.0,1.0", "0.1,2.0")
    assert [(one.bare, one.unit) for one in made.headings] == [("Zeit", "ms"), ("Weg", "µm")]
    made = layout("path,,way", "unit,s,um", "rows,0.0,1.0", ",0.1,2.0", ",0.2,2.0")
    assert [one.unit for one in made.headings] == [None, "s", "um"]
    rows = [f"0.{k},1.0" for k in range(9)]
    # a row of units between rows of data does not turn the rows above it into a header
    assert layout("t,x", rows[0], "s,um", *rows[1:]).skipped == 1
    made = layout("x-axis,1", "second,um", *rows)
    assert ([one.unit for one in made.headings], names(made), made.skipped) == (["second", "um"], ["x-axis", "1"], 2)


@pytest.mark.parametrize(
    ("header", "row"), [("X_Value\tWay\tComment", "0.{k}\t1.{k}"), ("X_Value\tWay", "0.{k}\t1.{k}")]
)
def test_a_labview_header_may_name_a_comment_column_that_the_rows_lack(header: str, row: str) -> None:
    above = (
        "LabVIEW Measurement",
        "X_Columns\tOne",
        "***End_of_Header***",
        "",
        "Y_Unit_Label\tum",
        "***End_of_Header***",
    )
    made = layout(*above, header, *(row.format(k=k) for k in range(9)))
    assert [(one.name, one.unit) for one in made.headings] == [("X_Value", "s"), ("Way", "um")]
    assert made.skipped == 7
    again = layout(*above, header, *(row.format(k=k) for k in range(9)), *above[3:], header, row.format(k=1))
    assert again == made  # another segment does not change the layout


def scope(step: str, rows: list[str], *more: str, names_of: str = "Name\tWay\tName\tSpeed") -> Layout:
    """Return the layout of a TwinCAT Scope export."""
    steps = "\t".join(f"SampleTime[ms]\t{step}" for _ in range(names_of.count("Name")))
    return layout("Name\tProject", "File\tx.svdx", "", names_of, steps, *more, "", *rows, "EOF")


def test_a_twincat_scope_log_has_one_clock_in_milliseconds_if_all_its_channels_share_it() -> None:
    rows = [f"{2 * k}\t1,{k}\t{2 * k}\t3,{k}" for k in range(5)]
    made = scope("2", rows, "Port\t851\tPort\t851", "Unit\tum\tUnit\t(None)")
    assert names(made) == ["Time", "Way", "Time of Speed", "Speed"]
    assert [one.unit for one in made.headings] == ["ms", "um", None, None]
    assert (made.decimal_point, made.skipped) == (",", 8)
    assert names(scope("1", rows)) == ["Name", "Way", "Name", "Speed"]  # the clock is not in milliseconds
    skewed = [row.replace("\t", "\t", 1).replace(f"\t{2 * k}\t", f"\t{2 * k + 1}\t") for k, row in enumerate(rows)]
    with pytest.raises(LogError, match="its channels have clocks that differ"):
        scope("2", skewed)
    again = ["Name\tWay\tName\tSpeed", "SampleTime[ms]\t2\tSampleTime[ms]\t2", *rows]
    assert scope("2", [*rows, *again]).skipped == 6
    for hostile in ([], ["0\t1"], ["x\ty\tz\tw"] * 5):
        assert scope("2", hostile).headings


def test_full_time_stamps_of_twincat_scope_have_no_unit_but_their_size() -> None:
    def ticks(k: int) -> int:
        return 134_176_000_000_000_000 + 20_000 * k

    rows = [f"{ticks(k)}\t1,{k}\t{ticks(k)}\t3,{k}" for k in range(5)]
    made = scope("2", rows, "Unit\tum\tUnit\trpm")
    assert [(one.name, one.unit) for one in made.headings[:2]] == [("Time", None), ("Way", "um")]
    assert names(scope("3", rows)) == ["Name", "Way", "Name", "Speed"]
    short = layout("Name\tProject", "Starttime of export\t134176000000000000", "", "Name\tWay\tName\tSpeed", "", *rows)
    assert [(one.name, one.unit) for one in short.headings[:2]] == [("Time", None), ("Way", None)]


def test_the_fastest_clock_of_twincat_scope_is_the_time_if_slow_channels_are_held() -> None:
    above = ("Name\tProject", "", "Name\tWay\tName\tSpeed", "SampleTime[ms]\t4\tSampleTime[ms]\t2", "")
    held = [f"{4 * (k // 2)}\t1,{k}\t{2 * k}\t3,{k}" for k in range(9)]
    assert names(layout(*above, *held)) == ["Time of Way", "Way", "Time", "Speed"]
    ahead = [f"{4 * k}\t1,{k}\t{2 * k}\t3,{k}" for k in range(9)]
    ended = [*ahead[:4], *(f"\t\t{2 * k}\t3,{k}" for k in range(4, 9))]
    for rows in (ahead, ended):
        with pytest.raises(LogError, match=r"a\.csv: its channels have clocks that differ"):
            layout(*above, *rows)
    still = [one.replace("\t2", "\t0") for one in above]
    assert "Time" not in names(layout(*still, *held))


def test_signal_express_gives_names_and_the_time_step_above_its_rows() -> None:
    begin = "3/12/2026 10:11:12.345678"

    def made(step: str = "0.002\t0.002", begins: str = f"{begin}\t{begin}", tabs: str = "") -> Layout:
        told = ("channel names:", "Way\tSpeed", "start times:", begins, "dt:", step, "data:")
        padded = [f"{one}{tabs}" if one.endswith(":") else one for one in told]
        return layout(*padded, *(f"{0.1 * k}\t{k}" for k in range(9)))

    for tabs in ("", "\t"):
        assert (names(made(tabs=tabs)), made(tabs=tabs).step, made(tabs=tabs).skipped) == (["Way", "Speed"], 2e-3, 7)
    assert made("x\ty").step is None
    assert made("0.002\t0.001").step is None
    assert made(begins=f"{begin}\t{begin[:-4]}6000").step == 2e-3
    with pytest.raises(LogError, match="its channels have clocks that differ"):
        made(begins=f"{begin}\t3/12/2026 10:11:12.355678")


def test_labview_channels_of_several_time_steps_without_a_time_are_refused() -> None:
    above = ("LabVIEW Measurement", "X_Columns\tNo", "***End_of_Header***", "Delta_X\t0.001\t0.002")
    with pytest.raises(LogError, match="its channels have clocks that differ"):
        layout(*above, "***End_of_Header***", "X_Value\tWay\tSpeed", *(f"\t{k}\t{k}" for k in range(9)))


def test_a_scale_that_a_twincat_header_states_is_kept_with_its_column() -> None:
    rows = [f"{2 * k}\t1,{k}\t{2 * k}\t3,{k}" for k in range(5)]
    stated = "ScaleFactor\t1\tScaleFactor\t0,5", "Offset\t0\tOffset\t2"
    assert scope("2", rows, *stated).scales == {3: (0.5, 2.0)}
    assert scope("2", rows, "ScaleFactor\t1\tScaleFactor\t1", "Offset\t\tOffset\tx").scales == {}


def test_twincat_channels_with_one_shared_time_column_have_a_clock_in_milliseconds() -> None:
    made = layout(
        "Name\tProject",
        "",
        "Name\tWay\tSpeed",
        "SampleTime[ms]\t1\t1",
        "Offset\t0\t0",
        "",
        *(f"{k}\t1\t2" for k in range(9)),
    )
    assert ((made.headings[0].name, made.headings[0].unit), made.skipped) == (("Time", "ms"), 6)


def test_a_first_line_with_more_than_10000_cells_is_refused() -> None:
    with pytest.raises(LogError, match=r"at most 10,000 columns are read, the first line has 20,001 cells"):
        layout_of_lines(["0," * 20_000], "utf-8", "a.csv")


def test_a_preamble_that_excel_pads_with_delimiters_is_not_taken_for_data() -> None:
    above = ["Operator,bench 2,,", "Rate,1000,,", "Range,200 mm,400 bar,9 rpm", "", "t [s],x [mm],p [bar],n [rpm]"]
    made = layout(*above, *(f"{0.1 * k:.1f},1.5,2.5,3.5" for k in range(9)))
    assert made.skipped == 5
    assert [one.bare for one in made.headings] == ["t", "x", "p", "n"]


def test_a_name_that_is_a_number_does_not_turn_the_header_into_data() -> None:
    made = layout("t [s],x [mm],3", "0.0,1.5,2.5", "0.1,1.5,2.5", "0.2,1.5,2.5")
    assert made.skipped == 1
    assert made.headings[1].unit == "mm"


def test_of_two_rows_of_names_the_one_with_units_counts() -> None:
    made = layout("CH,U1,U2", "Time,U1[rpm],U2[mm]", "0.0,1.5,2.5", "0.1,1.5,2.5", "0.2,1.5,2.5")
    assert [one.unit for one in made.headings] == [None, "rpm", "mm"]


def test_units_that_simulink_writes_below_the_names_are_read() -> None:
    above = ["time,n,x", ",Type: double,Type: double", ",Unit: rpm,Unit: mm", ",Interp: linear,Interp: zoh"]
    made = layout(*above, "0.0,1.5,2.5", "0.1,1.5,2.5", "0.2,1.5,2.5")
    assert [(one.name, one.unit) for one in made.headings] == [("time", None), ("n", "rpm"), ("x", "mm")]


def test_rows_that_a_text_begins_are_no_data_where_no_row_has_anything_in_that_place() -> None:
    rows = [f";{k};{9 * k}" for k in range(9)]
    above = ("Name;Time;Way", "Unit;s;mm", "Length;9;9", "Factor;1;0,5")
    made = layout(*above, *rows)
    assert ([(one.name, one.unit) for one in made.headings[1:]], made.skipped) == ([("Time", "s"), ("Way", "mm")], 4)
    assert made.scales == {2: (0.5, 0.0)}
    remarks = [f"begin;{k};{9 * k}" if k in (0, 5) else row for k, row in enumerate(rows)]
    assert layout(*above[:2], *remarks).skipped == 2


def test_units_may_stand_above_the_names_or_lack_those_of_the_last_columns() -> None:
    rows = [f"{k};{9 * k};{k * k}" for k in range(9)]
    for above in (("s;mm;rpm", "Time;Way;Speed"), ("Time;Way;Speed", "s;mm")):
        made = layout(*above, *rows)
        wanted = [("Time", "s"), ("Way", "mm"), ("Speed", "rpm" if above[0][0] == "s" else None)]
        assert [(one.name, one.unit) for one in made.headings] == wanted
    assert names(layout("s;V;A", *rows)) == ["s", "V", "A"]
    assert [one.unit for one in layout("Time;Way;Speed", "mm;rpm", *rows).headings] == [
        None
    ] * 3  # not those of the first
