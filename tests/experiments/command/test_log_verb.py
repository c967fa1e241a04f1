"""One log with its figure and its page; files of other loggers belong to one log."""

import html
import json
import re
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from experiments.cli import app
from experiments.command import pages
from plant.errors import HydrostateError


def invoke(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(one) for one in arguments])


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("verb") / "run.csv"
    made = invoke("simulate", "--drive", "prbs", "--duration", 2, "--sample-time", 1e-3, "--out", path)
    assert made.exit_code == 0, made.output
    return path


def test_an_estimate_is_written_as_a_figure_and_a_page_on_request(log: Path, tmp_path: Path) -> None:
    wanted = ("--figure", tmp_path / "run.png", "--report", tmp_path / "run")
    done = invoke("estimate", log, "--form", "pressure", "--method", "ekf", "--no-tune", *wanted)
    assert done.exit_code == 0, done.output
    assert (tmp_path / "run.png").read_bytes()[:4] == b"\x89PNG"
    page = (tmp_path / "run.html").read_text("utf-8")
    assert "run.csv" in page
    assert "bulk modulus" in page


@pytest.mark.parametrize("call", [("estimate", "--form", "pressure"), ("diagnose",)], ids=lambda call: call[0])
def test_a_page_lists_the_warnings_of_reading_the_log(call: tuple[str, ...], log: Path, tmp_path: Path) -> None:
    rows = [line.split(",")[:5] for line in log.read_text().splitlines()[:300]]  # without the chamber pressures
    assert rows[0][4] == '"differential_pressure_pa"'
    rows[0][4] = "dp"
    (tmp_path / "other.csv").write_text("\n".join(map(",".join, rows)) + "\n")
    done = invoke(*call, tmp_path / "other.csv", "--report", tmp_path / "page.html", "--json")
    assert done.exit_code == 0, done.output
    (told,) = json.loads(done.stdout)
    (said,) = [one["text"] for one in told["notes"] if one["code"] == "column_overlooked"]
    assert told["warnings"].count(said) == 1
    page = re.sub("</?span[^>]*>", "", (tmp_path / "page.html").read_text("utf-8"))
    assert f"<li>C{said[1:]}." in html.unescape(page)


def test_the_path_of_the_page_is_printed_on_standard_error(log: Path, tmp_path: Path) -> None:
    done = invoke("diagnose", log, "--report", tmp_path / "page")
    assert done.exit_code == 0, done.output
    assert f"written: {tmp_path / 'page.html'}; open it in a browser" in done.stderr.splitlines()
    assert "written" not in done.stdout


@pytest.mark.parametrize(
    ("entry", "said"),
    [
        (None, "no --rig: the paper's actuator is assumed"),
        ("", "rig.toml: its parameters are those of the paper's actuator"),
        ("moving_mass = 8.0", ""),
    ],
)
def test_a_missing_description_of_the_actuator_is_noted_once(
    entry: str | None, said: str, log: Path, tmp_path: Path
) -> None:
    (tmp_path / "rig.toml").write_text(f"[parameters]\n{entry or ''}\n")
    done = invoke("estimate", log, *(() if entry is None else ("--rig", tmp_path / "rig.toml")))
    assert done.exit_code == 0, done.output
    assert done.stderr.count(" actuator") == bool(said)
    assert said in done.stderr
    assert "the paper's actuator" not in done.stdout


def test_the_verdict_is_printed_even_if_its_page_cannot_be_written(
    log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(path: Path, *_: object) -> None:
        raise HydrostateError(f"--report {path}: cannot be written: No space left on device")

    monkeypatch.setattr(pages, "write_whole", full)
    done = invoke("diagnose", log, "--report", tmp_path / "page.html")
    assert done.exit_code == 1
    assert "probability" in done.stdout
    assert "No space left on device" in done.stderr


def test_option_with_joins_a_second_file_to_one_log_and_refuses_several(log: Path, tmp_path: Path) -> None:
    lines = [line.replace('"', "").split(",") for line in log.read_text().splitlines()]
    names = lines[0]
    pressure = names.index("differential_pressure_pa")
    parts = {"motion": [k for k in range(len(names)) if k != pressure], "pressure": [0, pressure]}
    for name, columns in parts.items():
        rows = (",".join(cells[k] for k in columns) for cells in lines)
        (tmp_path / f"{name}.csv").write_text("\n".join(rows) + "\n")
    together = invoke("estimate", tmp_path / "motion.csv", "--with", tmp_path / "pressure.csv", "--json")
    assert together.exit_code == 0, together.output
    assert '"differential_pressure_pa"' in together.stdout
    refused = invoke("estimate", log, tmp_path / "motion.csv", "--with", tmp_path / "pressure.csv")
    assert refused.exit_code == 2
    assert "--with goes with one log, got several" in refused.stderr


def test_an_error_about_a_file_begins_with_the_path_of_that_file(log: Path, tmp_path: Path) -> None:
    absent = tmp_path / "absent.csv"
    beside = invoke("estimate", log, "--with", absent)
    assert beside.stderr.splitlines() == [f"{absent}: there is no such file"]
    related = invoke("identify", log, "--input", "WRONG", "--output", "velocity_m_s")
    assert related.stderr.startswith(f"{log}: column 'WRONG' is needed")
