"""A name with a line break in it is one name, and the rows below it are read from where they begin."""

from pathlib import Path

import pytest

from plant.log.files import read_record
from plant.log.formats.csv_layout import layout_of

ROWS = [f"{k / 1000:.3f},{100 * (k % 7)},{k % 5}" for k in range(60)]


def log(path: Path, *header: str, end: str = "\r\n") -> Path:
    path.write_bytes(end.join([*header, *ROWS]).encode())
    return path


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize(
    "header",
    [
        ('"Time', '[s]","Motor speed', '[rpm]","Position', '[mm]"'),
        ("Bench 2", "", '"Time [s]","Motor', 'speed [rpm]",Position [mm]'),
        ('Time,"Motor', 'speed",Position', "s,rpm,mm"),
    ],
)
def test_names_of_several_lines_are_read(tmp_path: Path, header: tuple[str, ...], end: str) -> None:
    path = log(tmp_path / "log.csv", *header, end=end)
    made = layout_of(path)
    assert made.skipped == len(header)
    assert [(one.bare, one.unit) for one in made.headings] == [
        *(("Time", "s"), ("Motor speed", "rpm"), ("Position", "mm"))
    ]
    record = read_record(path)
    assert (len(record), record["position_m"][4]) == (60, pytest.approx(4e-3))


@pytest.mark.parametrize(
    "header",
    [
        ('Time [s],Stroke "A,Way "B',),  # inch marks, closed in the line
        ('Range "5,x', 'Range 6",y', "Time [s],Stroke,Way"),  # above the names, in two lines
        ('Time [s],Stroke ",Way',),  # never closed
        ('Time,Stroke ",Way', 's,",mm'),  # closed in the row of units, which is then lost
    ],
)
def test_a_quote_that_opens_no_name_changes_no_header(tmp_path: Path, header: tuple[str, ...]) -> None:
    made = layout_of(log(tmp_path / "log.csv", *header))
    assert made.skipped == len(header)
    assert len(made.headings) == 3
    assert not any("s," in one.name for one in made.headings)
