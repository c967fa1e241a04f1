"""A file written like an earlier one gets its layout; a file written in any other way is examined anew."""

from pathlib import Path

import numpy as np
import pytest

from plant.log.formats import csv_layout, layouts_seen
from plant.log.formats.csv_layout import Layout, layout_of

HEADER = "Bench 2\nTime [s],Speed [rpm],Way [mm]\n"


@pytest.fixture(autouse=True)
def nothing_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(layouts_seen, "_seen", {})


@pytest.fixture
def looked(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The files that were examined line by line."""
    found: list[str] = []
    usual = csv_layout.layout_of_lines

    def watched(lines: list[str], encoding: str, source: str) -> Layout:
        found.append(Path(source).name)
        return usual(lines, encoding, source)

    monkeypatch.setattr(csv_layout, "layout_of_lines", watched)
    return found


def rows(count: int, seed: int = 1) -> str:
    values = np.random.default_rng(seed).standard_normal((count, 3))
    return "".join(",".join(map(repr, row)) + "\n" for row in values.tolist())


def written(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.write_bytes(text.encode())
    return path


def test_of_several_files_with_one_layout_only_the_first_is_examined(tmp_path: Path, looked: list[str]) -> None:
    made = [layout_of(written(tmp_path, f"{k}.csv", HEADER + rows(100 + 90 * k, k))) for k in range(5)]
    assert looked == ["0.csv"]
    assert made == [made[0]] * 5
    assert [one.bare for one in made[0].headings] == ["Time", "Speed", "Way"]
    assert made[0].skipped == 2


@pytest.mark.parametrize(
    "text",
    [
        HEADER.replace("rpm", "rad/s") + rows(400),
        HEADER + rows(50) + "1.0,,2.0\n" + rows(400),
        HEADER + rows(50) + "12:30:01,1.0,2.0\n" + rows(400),
        HEADER + rows(50) + "1.0,2.0\n" + rows(400),
        HEADER + rows(50) + "1.0,2.0,nan\n" + rows(400),
        HEADER + rows(400).replace(",", ";").replace(".", ","),
        HEADER + rows(20),
        HEADER + rows(150) + "end",
        HEADER + rows(400).replace("\n", "\r"),
    ],
)
def test_a_file_with_another_layout_is_examined(text: str, tmp_path: Path, looked: list[str]) -> None:
    layout_of(written(tmp_path, "first.csv", HEADER + rows(400)))
    layout_of(written(tmp_path, "other.csv", text))
    assert looked == ["first.csv", "other.csv"]


@pytest.mark.parametrize("header", ["t,x\n", "", "\r".join(["a,b,c", "Time,Speed,Way", ""]), "a;b;c\n"])
def test_a_reused_layout_equals_the_one_found_by_examination(header: str, tmp_path: Path) -> None:
    width = 2 if header == "t,x\n" else 3
    text = header + "".join(",".join(line.split(",")[:width]) + "\n" for line in rows(400).splitlines())
    first, again = (layout_of(written(tmp_path, name, text)) for name in ("first.csv", "again.csv"))
    assert first == again == csv_layout.layout_of_lines(text.replace("\r", "\n").split("\n")[:300], "utf-8", "a.csv")
