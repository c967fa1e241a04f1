"""The page of `hydrostate inspect`: whether the log can be read, its clock, and its columns over time."""

import re
from base64 import b64decode
from pathlib import Path

import numpy as np

from estimation.log_checks.notes import GuessCode
from experiments.log_pages.inspect_page import inspect_page
from experiments.log_pages.inspected import GUESSED_UNIT_COMMENT, columns_block, guessed_units, inspect_log


def page_of(folder: Path, names: str, *columns: np.ndarray) -> str:
    path = folder / "E9_1.csv"
    np.savetxt(path, np.column_stack(columns), header=names, delimiter=",", comments="")
    found, tables = inspect_log(path, None)
    return inspect_page({"file": path.name, **found}, tables)


TIME = 1e-3 * np.arange(400.0)
SPEED = 100.0 * np.sign(np.sin(12.0 * TIME))
WAY = 1e-6 * np.cumsum(SPEED)


def test_the_heading_says_whether_the_log_can_be_diagnosed(tmp_path: Path) -> None:
    page = page_of(tmp_path, "time_s,motor_speed_rad_s,position_m", TIME, SPEED, WAY)
    assert "<h1>This log can be diagnosed.</h1>" in page
    assert "no gaps" in page
    assert "<h1>This log cannot be diagnosed yet.</h1>" in page_of(tmp_path, "time_s,M1", TIME, SPEED)


def test_the_page_names_no_folder(tmp_path: Path) -> None:
    page_of(tmp_path, "time_s,motor_speed_rad_s", TIME, SPEED)
    path = tmp_path / "E9_1.csv"
    found, tables = inspect_log(path, None)
    page = inspect_page({"file": str(path), **found}, tables)
    assert "E9_1.csv" in page
    assert str(tmp_path) not in page


def drawing(page: str) -> str:
    return b64decode(page.split("base64,")[1].split('"')[0]).decode()


def test_columns_are_drawn_over_time_or_over_rows_if_time_does_not_increase(tmp_path: Path) -> None:
    by_time = drawing(page_of(tmp_path, "time_s,motor_speed_rad_s", TIME, SPEED))
    assert by_time.count("<!-- time_s -->") == 1  # time is the axis, and has no drawing of its own
    assert "<!-- row -->" not in by_time
    assert "<!-- row -->" in drawing(page_of(tmp_path, "time_s,motor_speed_rad_s", np.round(TIME, 2), SPEED))


def test_columns_of_a_log_with_dates_are_drawn_over_seconds_since_the_first_row(tmp_path: Path) -> None:
    path = tmp_path / "dated.csv"
    rows = (f"2026-03-01 12:00:00.{k:03d},{value}" for k, value in enumerate(SPEED))
    path.write_text("\n".join(["time,motor_speed_rad_s", *rows]))
    found, tables = inspect_log(path, None)
    drawn = drawing(inspect_page({"file": path.name, **found}, tables))
    assert "<!-- time since the first row [s] -->" in drawn
    assert "<!-- row -->" not in drawn


def test_a_column_named_like_an_erratum_is_not_linked(tmp_path: Path) -> None:
    page = page_of(tmp_path, "time_s,M1,position_m,P1", TIME, SPEED, WAY, SPEED)
    assert "P1" in page
    assert 'id="errata"' not in page


def test_the_table_has_no_unit_column_for_a_file_without_units(tmp_path: Path) -> None:
    page = page_of(tmp_path, "time_s,motor_speed_rad_s,position_m", TIME, SPEED, WAY)
    assert ">unit<" not in page
    assert ">unit<" in page_of(tmp_path, "time [s],speed [rpm]", TIME, SPEED)


def test_options_do_not_break_across_lines_and_can_be_copied_together(tmp_path: Path) -> None:
    page = page_of(tmp_path, "time_s,MOTOR_RPM,position_m,DP_PA", TIME, SPEED, WAY, 1e4 * SPEED)
    (said,) = re.findall(r"add these options to one command: <code>(.*?)</code>", page, re.DOTALL)
    options = re.findall(r'<span class="option">(.*?)</span>', said)
    assert "--columns motor_speed_rad_s=MOTOR_RPM:rpm" in options
    # the unit as it is usually written (Pa), not as in the column's name (PA)
    assert "--columns differential_pressure_pa=DP_PA:Pa" in options
    assert re.sub(r"<.*?>", "", said).split() == " ".join(options).split()  # the text as a browser copies it


def test_the_page_lists_the_columns_whose_missing_units_must_be_checked(tmp_path: Path) -> None:
    """Before, the page asked the reader to check units "that are marked as guessed", and marked none."""
    asked = "The file gives no known unit for Zeit, Drehzahl, Weg: check"
    assert asked in page_of(tmp_path, "Zeit,Drehzahl,Weg", TIME, SPEED, WAY)
    assert "gives no known unit" not in page_of(tmp_path, "time_s,motor_speed_rad_s,position_m", TIME, SPEED, WAY)


def test_a_guessed_unit_is_marked_in_the_heading_and_in_the_rig_file(tmp_path: Path) -> None:
    page = page_of(tmp_path, "time_s,motor_speed_rad_s,Weg [mm],dP", TIME, SPEED, WAY, 50.0 * SPEED / SPEED.max())
    assert "<h1>This log can be diagnosed; check the units that were guessed.</h1>" in page
    assert "# the file gives no known unit: check this one" in page
    assert "# the file" not in page_of(tmp_path, "time_s,motor_speed_rad_s,position_m", TIME, SPEED, WAY)


def test_a_guessed_unit_in_the_block_is_marked_only_for_its_own_column() -> None:
    """Two tables may contain the same channel, and only one of them its unit."""
    why = [{"code": GuessCode.UNIT_GUESSED}]
    tables = [
        {"columns": [{"channel": "position_m", "name": "Weg", "why": why}]},
        {"columns": [{"channel": "position_m", "name": "Hub", "why": why}]},
    ]
    guessed = guessed_units(tables)
    assert guessed == [("position_m", "Weg"), ("position_m", "Hub")]
    for spec, marked in (("Weg:mm", True), ("Hub", True), ("Position:mm", False), ("Wegmesser:mm", False)):
        assert (GUESSED_UNIT_COMMENT in columns_block({"position_m": spec}, guessed)) is marked
