"""`hydrostate fleet`: from logs to a page, and again from the store."""

from pathlib import Path
from typing import Any

import pyarrow as pa
import pytest
from typer.testing import CliRunner

from experiments.batch import run_on_terminal
from experiments.batch.runner import Tally
from experiments.cli import app
from experiments.verbs.fleet import rigs_of_folders


def invoke(*arguments: object) -> tuple[int, str, str]:
    done = CliRunner().invoke(app, [str(one) for one in arguments])
    return done.exit_code, done.stdout, done.stderr


def test_a_folder_without_logs_is_refused(tmp_path: Path) -> None:
    code, _, said = invoke("fleet", tmp_path, "--out", tmp_path / "out")
    assert code == 2
    assert "must hold logs, files that end in .csv, .txt, " in said


def test_a_folder_may_hold_logs_of_another_kind_of_actuator(tmp_path: Path) -> None:
    logs, stack = tmp_path / "logs", tmp_path / "logs" / "stacks"
    for name in ("A_1", "A_2"):
        options = ("--duration", 1, "--sample-time", 1e-3, "--condition", "normal")
        assert invoke("simulate", *options, "--out", logs / f"{name}.csv")[0] == 0
        assert invoke("simulate", "--plant", "piezo-stack", "--out", stack / f"S{name}.csv")[0] == 0
    (stack / "rig.toml").write_text('name = "stack 3"\nplant = "piezo-stack"\n', encoding="utf-8")
    named = ("--pattern", "{actuator}_{date}.csv")
    code, _, said = invoke("fleet", logs, *named, "--out", tmp_path / "fleet", "--pages", 2, "--workers", 1)
    assert (code, "None of 2 actuators is past a limit." in said) == (0, True), said
    (page,) = (tmp_path / "fleet" / "pages").glob("SA_2*")
    assert "piezo-stack actuator, rig stack 3" in page.read_text("utf-8")
    (other,) = (tmp_path / "fleet" / "pages").glob("A_2*")
    assert "The actuator is healthy" in other.read_text("utf-8")


@pytest.mark.parametrize(
    ("option", "words"),
    [
        ("leak=2", "--limit must be one of"),
        ("leakage_flow=much", "--limit leakage_flow must be a number in L/min"),
        ("leakage_flow=nan", "must be a number in L/min, got 'nan'"),
    ],
)
def test_a_limit_that_cannot_be_used_is_refused(tmp_path: Path, option: str, words: str) -> None:
    code, _, said = invoke("fleet", tmp_path, "--limit", option)
    assert code == 2
    assert words in " ".join(said.split())


def test_a_folder_of_logs_becomes_a_page_that_lists_the_faulty_actuator_first(tmp_path: Path) -> None:
    logs = tmp_path / "logs"
    for name, condition in (("A_1", "normal"), ("A_2", "normal"), ("B_1", "normal"), ("B_2", "minor_leakage")):
        options = ("--plant", "circuit", "--duration", 4, "--sample-time", 1e-3, "--condition", condition)
        assert invoke("simulate", *options, "--out", logs / f"{name}.csv")[0] == 0
    (logs / "A_3.csv").write_text("a,b\n1,2\n")
    named = ("--pattern", "{actuator}_{date}.csv")
    code, out, said = invoke("fleet", logs, *named, "--out", tmp_path / "fleet", "--pages", 1, "--workers", 1)
    assert (code, out.strip()) == (1, f"{tmp_path}/fleet/index.html")
    assert "1 of 5 logs could not be read" in said
    assert "1 of 2 actuators is past a limit. Start with B." in said
    page = (tmp_path / "fleet" / "index.html").read_text("utf-8")
    assert "1 of 2 actuators is past a limit." in page
    assert "Start with B." in page
    assert str(tmp_path) not in page
    (own,) = (tmp_path / "fleet" / "pages").iterdir()
    (course,) = (tmp_path / "fleet" / "actuators").iterdir()
    assert f"actuators/{course.name}" in page
    assert f"../pages/{own.name}" in course.read_text("utf-8")
    assert "(minor leakage)" in own.read_text("utf-8")
    code, _, _ = invoke("fleet", tmp_path / "fleet" / "store", *named, "--out", tmp_path / "again")
    assert code == 1
    assert "Start with B." in (tmp_path / "again" / "index.html").read_text("utf-8")


ROW = {"verb": "diagnose", "outcome": "ok", "found_condition": "normal", "reason": None, "quantities": None}


class Stored:
    """A store of a batch study that has rows only."""

    def __init__(self, rows: list[dict[str, Any]]) -> None:
        self._rows = rows

    def manifest(self) -> dict[str, Any]:
        return {"name": "batch"}

    def rows(self, columns: list[str]) -> pa.Table:
        return pa.Table.from_pylist([{name: row.get(name) for name in columns} for row in self._rows])


def test_actuators_of_one_name_in_two_folders_are_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    files = [f"site {site}/P_2026-01-0{day}.csv" for site in "AB" for day in (1, 2)]
    stored = Stored([{**ROW, "file": file} for file in files])
    monkeypatch.setattr("experiments.batch.part_store.open_store", lambda _: stored)
    code, _, said = invoke("fleet", tmp_path, "--out", tmp_path / "fleet")
    assert code == 0
    assert "warning: 2 actuators have the same name as another" in said
    page = (tmp_path / "fleet" / "index.html").read_text("utf-8")
    assert "site A/P" in page
    assert "site B/P" in page


@pytest.mark.parametrize(("outcomes", "code"), [(["ok", "ok"], 0), (["ok", "failed"], 1), (["failed", "failed"], 2)])
def test_the_exit_code_of_a_fleet_says_whether_all_some_or_none_could_be_read(
    outcomes: list[str], code: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rows = [{**ROW, "file": f"P_2026-01-0{day}.csv", "outcome": one} for day, one in enumerate(outcomes, start=1)]
    monkeypatch.setattr("experiments.batch.part_store.open_store", lambda _: Stored(rows))
    named = ("--pattern", "{actuator}_{date}.csv", "--out", tmp_path / "fleet")
    found, out, said = invoke("fleet", tmp_path, *named)
    assert (found, out.strip()) == (code, f"{tmp_path}/fleet/index.html")
    assert ("could not be read" in said) is (code > 0)


def test_a_store_without_diagnoses_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stored = Stored([{**ROW, "file": "a.csv", "verb": "estimate"}])
    monkeypatch.setattr("experiments.batch.part_store.open_store", lambda _: stored)
    code, _, said = invoke("fleet", tmp_path, "--out", tmp_path / "fleet")
    assert code == 2
    assert "must contain logs that were diagnosed" in said


def test_file_names_with_a_date_are_grouped_without_an_option_and_this_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stored = Stored([{**ROW, "file": f"{name}.csv"} for name in ("A_20261121", "A_20261122", "B_20261122")])
    monkeypatch.setattr("experiments.batch.part_store.open_store", lambda _: stored)
    code, _, said = invoke("fleet", tmp_path, "--out", tmp_path / "fleet")
    assert code == 0
    assert "A_20261121.csv is taken for actuator A, 20261121; 3 file names give 2 actuators" in said
    assert "None of 2 actuators is past a limit." in (tmp_path / "fleet" / "index.html").read_text("utf-8")
    code, _, said = invoke("fleet", tmp_path, "--pattern", "{actuator}.csv", "--out", tmp_path / "apart")
    assert code == 0
    assert "is taken for" not in said
    assert "None of 3 actuators is past a limit." in (tmp_path / "apart" / "index.html").read_text("utf-8")


def test_a_table_of_names_is_accepted_and_refused_together_with_a_pattern(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stored = Stored([{**ROW, "file": "a.csv"}, {**ROW, "file": "b.csv"}])
    monkeypatch.setattr("experiments.batch.part_store.open_store", lambda _: stored)
    table = tmp_path / "names.csv"
    table.write_text("file,actuator,date\na.csv,Press 7,2026-01-02\nb.csv,Press 7,2026-01-03\n")
    code, _, _ = invoke("fleet", tmp_path, "--names", table, "--out", tmp_path / "fleet")
    assert code == 0
    assert "The actuator is past no limit." in (tmp_path / "fleet" / "index.html").read_text("utf-8")
    code, _, said = invoke("fleet", tmp_path, "--names", table, "--pattern", "{actuator}.csv", "--out", tmp_path / "x")
    assert code == 2
    assert "--pattern and --names say the same" in said


def test_an_invalid_date_is_refused_before_any_log_is_diagnosed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ran = list[Any]()
    monkeypatch.setattr("experiments.batch.run_on_terminal.run_plan", lambda *asked: ran.append(asked))
    (tmp_path / "P-1_2026-99.csv").write_text("time_s\n")
    code, _, said = invoke("fleet", tmp_path, "--pattern", "{actuator}_{date}.csv", "--out", tmp_path / "fleet")
    assert (code, ran) == (2, [])
    assert "date must be ISO 8601 such as 2026-11-22, or a number, got '2026-99'" in said


def test_unmatched_file_names_and_repairs_without_effect_give_warnings(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stored = Stored([{**ROW, "file": "P-1_2026-01-02.csv"}, {**ROW, "file": "run.csv"}, {**ROW, "file": "P-2_x.csv"}])
    monkeypatch.setattr("experiments.batch.part_store.open_store", lambda _: stored)
    repairs = tmp_path / "repairs.csv"
    repairs.write_text("actuator,date\nP-1,2026-01-01\nP1,2026-01-01\n")
    options = ("--pattern", "{actuator}_{date}.csv", "--maintenance", repairs, "--out", tmp_path / "fleet")
    code, _, said = invoke("fleet", tmp_path, *options)
    assert code == 0
    assert "2 of 3 files do not match --pattern {actuator}_{date}.csv, so each has its own row" in said
    assert "a repair of 'P1', but no log is of that actuator" in said
    assert "'P-1'" not in said
    code, _, said = invoke("fleet", tmp_path, "--pattern", "{actuator}_*.csv", *options[2:])
    assert "a repair of 'P-1', but its logs have no dates" in said


def test_a_file_in_place_of_a_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("time_s\n")
    code, _, said = invoke("fleet", tmp_path / "a.csv")
    assert (code, "must be a folder with logs or a store, got a file" in said) == (2, True)


def test_a_fleet_is_diagnosed_with_the_given_rig_and_columns(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rig, logs, asked = tmp_path / "rig.toml", tmp_path / "logs", list[Any]()
    assert invoke("rig", "init", rig)[0] == 0
    logs.mkdir()
    for name in ("a.csv", "b.CSV", "c.txt", "note.md"):
        (logs / name).write_text("time_s\n")

    def ran(plan: Any, *_: Any) -> None:
        asked.append(plan)
        raise KeyboardInterrupt

    monkeypatch.setattr("experiments.batch.run_on_terminal.run_plan", ran)
    invoke("fleet", logs, "--rig", rig, "--columns", "position_m=POS:mm", "--out", tmp_path / "fleet")
    (plan,) = asked
    assert plan.study.rig == str(rig.resolve())
    assert {one.glob for one in plan.study.logs} >= {"**/*.csv", "**/*.CSV"}
    assert all(one.columns == {"position_m": "POS:mm"} for one in plan.study.logs)
    assert not any("md" in one.glob for one in plan.study.logs)


def test_an_interrupted_fleet_writes_no_page_and_counts_the_kept_logs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "logs").mkdir()
    for name in ("a", "b"):
        (tmp_path / "logs" / f"{name}.csv").write_text("a,b\n1,2\n")

    def ended(*_: Any) -> tuple[Tally, int]:
        return Tally(done=1, stopped="interrupted"), 0

    monkeypatch.setattr(run_on_terminal, "run_plan", ended)
    code, out, said = invoke("fleet", tmp_path / "logs", "--out", tmp_path / "fleet", "--workers", 1)
    assert (code, out) == (130, "")
    assert "interrupted: 1 of 2 logs are kept in" in said
    assert not (tmp_path / "fleet" / "index.html").exists()


def test_rig_files_in_folders_of_logs_are_found_and_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    logs = [tmp_path / name for name in ("a.csv", "large/b.csv", "small/deep/c.csv")]
    for folder in (tmp_path, tmp_path / "large"):
        folder.mkdir(exist_ok=True)
        (folder / "rig.toml").touch()
    assert rigs_of_folders(tmp_path, logs) == {"": tmp_path / "rig.toml", "large": tmp_path / "large" / "rig.toml"}
    assert "rig file of the logs in large" in capsys.readouterr().err
    given = tmp_path / "other.toml"
    assert rigs_of_folders(tmp_path, logs, given) == {"": given, "large": tmp_path / "large" / "rig.toml"}
    assert "logs in no folder" not in capsys.readouterr().err


def test_a_fleet_of_logs_with_coarse_time_stamps_needs_a_sample_time(tmp_path: Path) -> None:
    (logs := tmp_path / "logs").mkdir()
    assert invoke("simulate", "--duration", 0.5, "--sample-time", 2e-3, "--out", tmp_path / "run.csv")[0] == 0
    heading, *rows = (tmp_path / "run.csv").read_text("utf-8").splitlines()
    cells = [row.split(",") for row in rows]
    coarse = [",".join([f"{float(one):.0f}", *more]) for one, *more in cells]
    (logs / "A_1.csv").write_text("\n".join([heading, *coarse]), encoding="utf-8")
    words = ("fleet", logs, "--pattern", "{actuator}_{date}.csv", "--out", tmp_path / "fleet", "--workers", 1)
    code, _, said = invoke(*words)
    assert (code, "--sample-time S takes the rows as evenly spaced" in " ".join(said.split())) == (2, True), said
    code, _, said = invoke(*words, "--pages", 1, "--sample-time", 2e-3)
    assert (code, "The actuator is past no limit." in said) == (0, True), said
    assert len(list((tmp_path / "fleet" / "pages").iterdir())) == 1
