import warnings
from pathlib import Path

import pytest

from plant.errors import LogWarning
from plant.log.formats.csv import open_csv
from plant.log.formats.csv_lines import unplaced_names
from plant.log.notes import LogCode

ROWS = "".join(f"{0.1 * row:.1f},{row % 7},{0.5 * row}\n" for row in range(20))


@pytest.mark.parametrize(
    ("header", "count"), [("time,u,y,spare", 4), ("time,u", 2), ("# time,u,y,spare", 4), ("time,u,y,spare\ns,V,m,-", 4)]
)
def test_names_that_are_no_columns_are_told(tmp_path: Path, header: str, count: int) -> None:
    path = tmp_path / "a.csv"
    path.write_text(f"{header}\n{ROWS}")
    with pytest.warns(LogWarning, match=f"{count} names stand above 3 columns") as caught:
        table = open_csv(path, None)
    assert [str(one.message.note.code) for one in caught if isinstance(one.message, LogWarning)] == [
        str(LogCode.NAMES_UNPLACED)
    ]
    assert [one.name for one in table.headings] == ["column 1", "column 2", "column 3"]


@pytest.mark.parametrize(
    "above",
    ["time,u,y\n", "", "Bench 2, run, 5\n", "Test bench, hall 3\n", "Pump\n", "a,b,c,d\ntime,u,y\n", "time,u,y,\n"],
)
def test_titles_and_names_that_fit_are_not(tmp_path: Path, above: str) -> None:
    path = tmp_path / "a.csv"
    path.write_text(above + ROWS)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        open_csv(path, None)


@pytest.mark.parametrize("cells", [["a"], ["a", "a", "b"], ["a", "", "b"], ["a", "b", "1"], list("abcdefgh")])
def test_other_lines_are_no_names(cells: list[str]) -> None:
    assert unplaced_names([",".join(cells)], ",", 3) == ()
