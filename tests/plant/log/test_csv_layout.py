import pytest

from plant.errors import LogError
from plant.log.csv_layout import Layout, layout_of_lines


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


def test_a_delimiter_that_closes_every_row_makes_no_column_of_its_own() -> None:
    assert names(layout("t;x", "0;1;", "1;2;")) == ["t", "x", "column 3"]


def test_a_broken_first_row_is_a_row_and_no_header() -> None:
    assert layout("t,x,v", "0.0,oops,oops", "0.1,1.5,2.5", "0.2,1.5,2.5").skipped == 1


def test_dates_are_told_from_numbers() -> None:
    assert layout("t,x", "12:00:00.1,1", "12:00:00.2,2").stamped == {0}


def test_blank_lines_alone_are_refused() -> None:
    with pytest.raises(LogError, match="a header line is needed, the file is empty"):
        layout("", " ")
