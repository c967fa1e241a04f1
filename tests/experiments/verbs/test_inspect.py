import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from experiments.cli import app
from experiments.command import pages
from plant.eha.rig import read_rig
from plant.errors import HydrostateError

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


def test_inspect_writes_a_rig_file_with_the_columns_of_the_log_once(strange: Path, tmp_path: Path) -> None:
    rig = tmp_path / "rig.toml"
    written = invoke(strange, "--write", rig)
    assert written.exit_code == 0
    assert f"run: hydrostate diagnose {strange} --rig {rig}" in written.stderr
    assert read_rig(rig).columns["motor_speed_rad_s"] == "Drehzahl [U/min]:U/min"
    assert tomllib.loads(rig.read_text())["columns"].keys() >= {"time_s", "position_m"}
    again = invoke(strange, "--write", rig)
    assert again.stderr.startswith(f"hydrostate: --write {rig}: the file exists already and is not overwritten")


def test_the_findings_are_printed_even_if_the_page_cannot_be_written(
    strange: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(path: Path, *_: object) -> None:
        raise HydrostateError(f"--report {path}: cannot be written: No space left on device")

    monkeypatch.setattr(pages, "write_whole", full)
    done = invoke(strange, "--report", tmp_path / "page.html")
    assert done.exit_code == 1
    assert 'position_m = "Kolbenweg [mm]:mm"' in done.stdout
    assert done.stderr.count("No space left on device") == 1


def test_advice_to_inspect_is_not_given_by_inspect_itself(tmp_path: Path) -> None:
    (tmp_path / "letter.txt").write_text("hello world\n" + 12 * "1 2\n")
    done = invoke(tmp_path / "letter.txt")
    assert "cannot be read: columns time_s" in done.stdout
    assert "hydrostate inspect" not in done.stdout


def test_json_gives_the_probability_and_reasons_of_each_guess(strange: Path) -> None:
    (found,) = json.loads(invoke(strange, "--json").stdout)
    (table,) = found["tables"]
    weg = table["columns"][2]
    assert (weg["channel"], weg["unit"]) == ("position_m", "mm")
    assert weg["probability"] > 0.9
    assert {"called_so", "unit_fits"} <= {note["code"] for note in weg["why"]}
    assert table["clock"]["gaps"] == 0


def test_the_page_draws_every_column(strange: Path, tmp_path: Path) -> None:
    assert invoke(strange, "--report", tmp_path / "page.html").exit_code == 0
    page = (tmp_path / "page.html").read_text()
    assert "Kolbenweg [mm]" in page
    assert "image/svg+xml" in page


def test_page_and_results_are_written_to_the_given_paths(strange: Path, tmp_path: Path) -> None:
    done = invoke(strange, "--report", tmp_path / "page", "--out", tmp_path / "new" / "results")
    assert done.exit_code == 0, done.output
    assert (tmp_path / "page.html").is_file()
    assert (tmp_path / "new" / "results" / "results.json").is_file()


def test_a_file_that_cannot_be_opened_is_refused_with_the_remedy(tmp_path: Path) -> None:
    (tmp_path / "x.xls").write_bytes(b"\xd0\xcf\x11\xe0" + bytes(600))
    done = invoke(tmp_path / "x.xls")
    assert done.exit_code == 2
    assert "save it as .xlsx or .csv" in done.stderr


def test_names_with_escape_codes_do_not_reach_the_terminal(tmp_path: Path) -> None:
    path = tmp_path / "a\x1b[2Jb.csv"
    path.write_text("time_s,x\x1b[31m\n" + "".join(f"{k},{k}\n" for k in range(20)))
    done = invoke(path)
    assert "\x1b" not in done.stdout + done.stderr


def test_several_files_are_inspected_together_except_with_options_for_one_file(strange: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.csv"
    other.write_text("time_s,x\n" + "".join(f"{0.1 * k:.1f},{k}\n" for k in range(20)))
    assert len(json.loads(invoke(strange, other, "--json").stdout)) == 2
    for option in (("--write", tmp_path / "a.toml"), ("--with", strange)):
        done = invoke(strange, other, *option)
        assert done.exit_code == 2
        assert "go with one file, got several" in done.stderr
    assert not list(tmp_path.glob("a.*"))
    assert invoke(strange, other, "--html", tmp_path / "page.html").exit_code == 0
    assert {path.name for path in tmp_path.glob("page*")} == {f"page-{strange.stem}.html", "page-other.html"}


def test_each_channel_is_the_most_probable_column_of_all_files(tmp_path: Path) -> None:
    named, vague = tmp_path / "named.csv", tmp_path / "vague.csv"
    weg = np.cumsum(4e-4 * SPEED) * 1e-3
    for path, heading in ((named, "position [mm]"), (vague, "ch2")):
        rows = (f"{t:.3f},{1e3 * x:.6f}\n" for t, x in zip(TIME, weg, strict=True))
        path.write_text(f"time_s,{heading}\n" + "".join(rows))
    for first, second in ((named, vague), (vague, named)):
        (found,) = json.loads(invoke(first, "--with", second, "--json").stdout)
        assert found["columns"]["position_m"] == "position [mm]:mm"


def test_flaws_of_the_clock_are_given_in_the_unit_of_its_column(tmp_path: Path) -> None:
    steps = np.ones(40)
    steps[7] = 5.0  # a gap
    steps[20] = 0.0
    steps[30] = -1.0
    time = np.concatenate([[0.0], np.cumsum(steps)])
    path = tmp_path / "flawed.csv"
    path.write_text("time_ms,speed_rpm\n" + "".join(f"{t:.3f},{100 + k}\n" for k, t in enumerate(time)))
    (found,) = json.loads(invoke(path, "--json").stdout)
    clock = found["tables"][0]["clock"]
    assert (clock["step"], clock["gaps"], clock["repeats"], clock["backward"]) == (1.0, 1, 1, 1)
    told = " ".join(invoke(path).stdout.split())
    assert "clock: steps of 1 ms; 1 gaps, 1 repeats, 1 steps back" in told
    even = tmp_path / "even.csv"
    even.write_text("time_ms,speed_rpm\n" + "".join(f"{k + 0.1 * (k % 2):.3f},{100 + k}\n" for k in range(40)))
    assert "jitter of" in " ".join(invoke(even).stdout.split())
    dated = tmp_path / "dated.csv"
    dated.write_text("time,speed_rpm\n" + "".join(f"2026-03-01 12:00:0{k / 10},{100 + k}\n" for k in range(40)))
    assert "clock: steps of 0.1 s; no gaps" in " ".join(invoke(dated).stdout.split())


def test_a_log_without_a_clock_or_known_columns_gets_the_options_to_give(tmp_path: Path) -> None:
    path = tmp_path / "blank.csv"
    rng = np.random.default_rng(0)
    path.write_text("k,note\n" + "".join(f"{one:.4f},word\n" for one in rng.normal(size=50)))
    told = " ".join(invoke(path).stdout.split())
    assert "no column holds the time: give the time between rows with --sample-time S" in told
    assert "no column was recognised; name the columns yourself" in told
    assert "or add to one command" not in told


def test_a_log_of_one_row_is_shown_without_a_clock(tmp_path: Path) -> None:
    path = tmp_path / "short.csv"
    path.write_text("time,motor speed,position\ns,rad/s,m\n0.0,1.0,0.5\n")
    found = invoke(path)
    assert found.exception is None or isinstance(found.exception, SystemExit)
    assert "motor speed" in found.stdout
    assert "clock: " not in found.stdout
