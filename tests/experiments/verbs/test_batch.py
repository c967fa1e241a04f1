import json
from collections.abc import Callable
from pathlib import Path
from threading import Event

import pytest
from typer.testing import CliRunner, Result

from experiments.batch.runner import Tally
from experiments.cli import app

STUDY = """
name = "small"
[[runs]]
plants = ["reduced"]
drives = ["sine"]
conditions = ["normal", "major_friction"]
seeds = 3
starts_pa = [0.0, 2e8, 5e8]
duration_s = 0.05
sensors = ["{sensors}"]
sample_time_s = {sample_time}
methods = [{{ verb = "filter", form = "acceleration", method = "ekf" }}]
"""


def invoke(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture
def study(tmp_path: Path) -> Path:
    path = tmp_path / "small.toml"
    path.write_text(STUDY.format(sensors="bench", sample_time=1e-4), encoding="utf-8")
    return path


@pytest.mark.parametrize("command", ["batch", "compare", "report"])
def test_help_gives_an_example(command: str) -> None:
    shown = invoke(command, "--help")
    assert shown.exit_code == 0
    assert f"Example: hydrostate {command}" in " ".join(shown.stdout.split())


def test_a_dry_run_counts_cases_and_writes_nothing(study: Path, tmp_path: Path) -> None:
    shown = invoke("batch", study, "--dry-run", "--out", tmp_path / "store")
    assert shown.exit_code == 0
    assert "small: 18 cases on 6 series; 18 are not in" in shown.stdout
    assert not (tmp_path / "store").exists()


def test_a_batch_is_run_once_reported_and_compared(study: Path, tmp_path: Path) -> None:
    store = tmp_path / "store"
    first = invoke("batch", study, "--out", store, "--workers", 1)
    assert (first.exit_code, first.stdout.strip()) == (0, f"{store}/report.html")
    assert "18 of 18 cases done, 0 failed" in first.stderr
    assert (store / "report.html").exists()
    (again,) = json.loads(invoke("batch", study, "--out", store, "--workers", 1, "--json").stdout)
    assert (again["cases"], again["done"], again["ran"], again["failed"]) == (18, 18, 0, 0)
    (anew,) = json.loads(invoke("batch", study, "--out", store, "--workers", 1, "--no-resume", "--json").stdout)
    assert anew["ran"] == 18
    assert invoke("report", store, "--out", tmp_path / "page").stdout.strip() == f"{tmp_path}/page/report.html"
    compared = invoke("compare", store, store, "--out", tmp_path / "compared.html")
    assert compared.exit_code == 0
    assert "no difference shown" in compared.stdout
    assert "What got better, what got worse" in (tmp_path / "compared.html").read_text(encoding="utf-8")
    manifest = json.loads((store / "manifest.json").read_text(encoding="utf-8"))
    assert manifest["seeds"] == [0, 1, 2]
    assert {"config_hash", "versions", "commit", "config"} <= set(manifest)


def test_failed_cases_are_named_and_the_exit_code_is_2(study: Path, tmp_path: Path) -> None:
    study.write_text(STUDY.format(sensors="rig", sample_time=4e-3), encoding="utf-8")
    shown = invoke("batch", study, "--out", tmp_path / "store", "--workers", 1)
    assert shown.exit_code == 2
    assert "reduced sine normal seed 0 (filter): velocity_window must be at least two sample times" in shown.stderr
    assert "18 of 18 cases done, 18 failed" in shown.stderr
    stopped = invoke("batch", study, "--out", tmp_path / "other", "--workers", 1, "--max-failures", 1)
    assert "--max-failures is 1" in stopped.stderr
    assert "the same command goes on from there" in stopped.stderr


def test_a_dry_run_as_json_gives_the_number_of_cases_left(study: Path, tmp_path: Path) -> None:
    store = tmp_path / "store"
    for left in (18, 0):
        (plan,) = json.loads(invoke("batch", study, "--dry-run", "--json", "--workers", 2, "--out", store).stdout)
        assert (plan["cases"], plan["series"], plan["left"], plan["workers"]) == (18, 6, left, 2)
        assert (plan["seconds"] > 0.0) is (left > 0)
        assert invoke("batch", study, "--out", store, "--workers", 1).exit_code == 0


def test_a_part_that_was_damaged_is_set_aside_and_its_cases_are_run_again(study: Path, tmp_path: Path) -> None:
    store = tmp_path / "store"
    invoke("batch", study, "--out", store, "--workers", 1)
    part = next((store / "parts").iterdir())
    part.write_bytes(part.read_bytes()[:-100])
    again = invoke("batch", study, "--out", store, "--workers", 1)
    assert again.exit_code == 0
    assert "cannot be read: it is set aside, and its cases are run again" in again.stderr
    assert "18 of 18 cases done" in again.stderr


def test_an_interrupted_study_ends_with_exit_code_130_and_counts_the_kept_cases(
    study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object, on_part: Callable[..., None], stop: Event, **__: object) -> Tally:
        del on_part
        stop.set()
        return Tally(stopped="interrupted")

    invoke("batch", study, "--out", tmp_path / "store", "--workers", 1)
    monkeypatch.setattr("experiments.batch.runner.run_batch", interrupted)
    done = invoke("batch", study, "--out", tmp_path / "store", "--workers", 1, "--json")
    assert done.exit_code == 130
    (told,) = json.loads(done.stdout)
    assert told["outcome"] == "interrupted"
    assert "interrupted: 18 of 18 cases are kept in" in done.stderr


def test_a_long_study_without_a_terminal_prints_its_progress_at_intervals(
    study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    quiet = invoke("batch", study, "--out", tmp_path / "quiet", "--workers", 1).stderr
    monkeypatch.setattr("experiments.batch.run_on_terminal.QUIET_SECONDS", 0.0)
    told = invoke("batch", study, "--out", tmp_path / "told", "--workers", 1).stderr
    assert len(told.splitlines()) > len(quiet.splitlines())
    assert "18 of 18" in told


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("batch", "nothing.toml"), "nothing.toml: there is no such study file; eha-paper and"),
        (("report", "nowhere"), "store nowhere: there is no batch study there"),
        (("compare", "nowhere", "nothing"), "store nowhere: there is no batch study there"),
        (("compare", __file__, "b.csv"), "b.csv: there is no such file"),
        (("batch", "eha-paper", "--logs", "*.csv"), "--logs replaces the logs of a study, and eha-paper has none"),
    ],
)
def test_missing_files_and_stores_are_refused(words: tuple[str, ...], said: str) -> None:
    shown = invoke(*words)
    assert shown.exit_code == 2
    assert said in shown.stderr
