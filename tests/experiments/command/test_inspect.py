import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from experiments.cli import app
from plant.eha.rig import read_rig

TIME = 1e-3 * np.arange(3000)
SPEED = 90.0 * np.sign(np.sin(9.0 * TIME)) * (1.0 - np.exp(-40.0 * (TIME % (np.pi / 9.0))))


def invoke(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["inspect", *map(str, arguments)])


@pytest.fixture
def strange(tmp_path: Path) -> Path:
    path = tmp_path / "strange.txt"
    weg = np.cumsum(4e-4 * SPEED) * 1e-3
    rows = (
        f"{t:.3f};{n:.3f};{x:.6f}".replace(".", ",") for t, n, x in zip(TIME, 9.5493 * SPEED, 1e3 * weg, strict=True)
    )
    path.write_text("\n".join(["Bench 3", "", "Zeit [s];Drehzahl [U/min];Kolbenweg [mm]", *rows]), encoding="utf-16")
    return path


def test_the_terminal_shows_columns_guesses_block_and_option(strange: Path) -> None:
    done = invoke(strange)
    assert done.exit_code == 0
    for part in ("Kolbenweg [mm]", "[columns]", 'position_m = "Kolbenweg [mm]:mm"', "or add to one command: --columns"):
        assert part in done.stdout
    assert "with these columns the log reads: 2.999 s at 1000 Hz" in done.stdout


def test_the_rig_file_that_it_writes_reads_the_log(strange: Path, tmp_path: Path) -> None:
    rig = tmp_path / "rig.toml"
    written = invoke(strange, "--write", rig)
    assert written.exit_code == 0
    assert f"run: hydrostate diagnose {strange} --rig {rig}" in written.stderr
    assert read_rig(rig).columns["motor_speed_rad_s"] == "Drehzahl [U/min]:U/min"
    assert tomllib.loads(rig.read_text())["columns"].keys() >= {"time_s", "position_m"}
    again = invoke(strange, "--write", rig)
    assert "is not overwritten" in again.stderr


def test_json_says_how_sure_each_guess_is_and_why(strange: Path) -> None:
    (found,) = json.loads(invoke(strange, "--json").stdout)
    (table,) = found["tables"]
    weg = table["columns"][2]
    assert (weg["channel"], weg["unit"]) == ("position_m", "mm")
    assert weg["probability"] > 0.9
    assert {"called_so", "unit_fits"} <= {note["code"] for note in weg["why"]}
    assert table["clock"]["gaps"] == 0


def test_the_page_draws_every_column(strange: Path, tmp_path: Path) -> None:
    assert invoke(strange, "--html", tmp_path / "page.html").exit_code == 0
    page = (tmp_path / "page.html").read_text()
    assert "Kolbenweg [mm]" in page
    assert "image/svg+xml" in page


def test_a_file_that_cannot_be_opened_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "x.xls").write_bytes(b"\xd0\xcf\x11\xe0" + bytes(600))
    done = invoke(tmp_path / "x.xls")
    assert done.exit_code == 2
    assert "save it as .xlsx or .csv" in done.stderr


def test_names_with_escape_codes_do_not_reach_the_terminal(tmp_path: Path) -> None:
    path = tmp_path / "a\x1b[2Jb.csv"
    path.write_text("time_s,x\x1b[31m\n" + "".join(f"{k},{k}\n" for k in range(20)))
    done = invoke(path)
    assert "\x1b" not in done.stdout + done.stderr
