from pathlib import Path

import numpy as np
import pytest

from plant.errors import LogError
from plant.log.files import read_record
from plant.log.formats.thousands import groups_thousands

TIME = 1e-3 * np.arange(300)
SPEED = np.round(2000.0 * np.sin(40.0 * TIME))


def written(folder: Path, cells: list[str], name: str) -> Path:
    rows = (f"{t:.3f};{speed};{1e-3 * t:.7f}" for t, speed in zip(TIME, cells, strict=True))
    path = folder / name
    path.write_text("\n".join(["time_s;Motor speed [rpm];position_m", *rows]) + "\n")
    return path


def test_whole_numbers_with_their_thousands_apart_are_refused_not_read_as_thousandths(tmp_path: Path) -> None:
    cells = [f"{one:,.0f}".replace(",", ".") for one in SPEED]
    with pytest.raises(LogError, match=r"'Motor speed \[rpm\]' has separators of thousands"):
        read_record(written(tmp_path, cells, "log.csv"))


def test_so_they_are_behind_a_header_that_was_read_before(tmp_path: Path) -> None:
    header = "time_s,motor_speed_rad_s,position_m\n"
    plain, grouped = tmp_path / "plain.csv", tmp_path / "grouped.csv"
    rows = [f"{t:.3f},{one:.0f},{1e-3 * t:.7f}" for t, one in zip(TIME, SPEED, strict=True)]
    plain.write_text(header + "\n".join(rows) + "\n")
    parted = [
        f"{t:.3f},{one:,.0f}".replace(",", "|", 1).replace(",", ".").replace("|", ",")
        for t, one in zip(TIME, SPEED, strict=True)
    ]
    grouped.write_text(header + "\n".join(f"{one},0.001" for one in parted) + "\n")
    read_record(plain)
    with pytest.raises(LogError, match="separators of thousands"):
        read_record(grouped)


@pytest.mark.parametrize("digits", [1, 3, 4])
def test_decimals_are_none(tmp_path: Path, digits: int) -> None:
    path = written(tmp_path, [f"{one / 7.0:.{digits}f}" for one in SPEED], "log.csv")
    assert len(read_record(path)) == len(TIME)


def test_few_cells_are_not_judged() -> None:
    assert not groups_thousands(["998", "1.002"])


def late(folder: Path, cells: list[str]) -> Path:
    """Return a log whose numbers reach a thousand below the lines that are looked at for its layout."""
    rows = (f"{1e-3 * k:.3f};{speed};{1e-6 * k:.7f}" for k, speed in enumerate(cells))
    path = folder / "log.csv"
    path.write_text("\n".join(["time_s;Motor speed [rpm];position_m", *rows]) + "\n")
    return path


def test_thousands_that_are_reached_late_are_refused_too(tmp_path: Path) -> None:
    path = late(tmp_path, [f"{max(k - 300, k % 7):,d}".replace(",", ".") for k in range(0, 3600, 2)])
    with pytest.raises(LogError, match=r"thousands, as in '1\.000'"):
        read_record(path)
    assert len(read_record(late(tmp_path, [f"{0.004 * k:g}" for k in range(1800)]))) == 1800


def test_where_decimals_have_a_comma_a_point_that_parts_thousands_is_refused(tmp_path: Path) -> None:
    cells = [f"{one:d},5" for one in range(600)]
    path = tmp_path / "log.csv"
    for last, said in (("1.002", r"thousands, as in '1\.002'"), ("0.98", "")):
        rows = (f"0,{k:04d};{speed};0,{k:03d}1" for k, speed in enumerate([*cells, last]))
        path.write_text("\n".join(["time_s;Motor speed [rpm];position_m", *rows]) + "\n")
        if said:
            with pytest.raises(LogError, match=said):
                read_record(path)
        else:
            assert read_record(path)["motor_speed_rad_s"][-1] == pytest.approx(0.98 * np.pi / 30.0)
