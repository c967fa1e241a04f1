"""`hydrostate fleet`: from logs to a page, and again from the store."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from experiments.cli import app


def invoke(*arguments: object) -> tuple[int, str, str]:
    done = CliRunner().invoke(app, [str(one) for one in arguments])
    return done.exit_code, done.stdout, done.stderr


def test_a_folder_without_logs_is_refused(tmp_path: Path) -> None:
    code, _, said = invoke("fleet", tmp_path, "--out", tmp_path / "out")
    assert code == 2
    assert "must be a folder with logs or a store" in said


@pytest.mark.parametrize(
    ("option", "words"),
    [("leak=2", "--limit must be one of"), ("leakage_flow=much", "--limit leakage_flow must be a number in L/min")],
)
def test_a_limit_that_cannot_be_used_is_refused(tmp_path: Path, option: str, words: str) -> None:
    code, _, said = invoke("fleet", tmp_path, "--limit", option)
    assert code == 2
    assert words in " ".join(said.split())


def test_a_folder_of_logs_becomes_a_page_with_the_sick_one_first(tmp_path: Path) -> None:
    logs = tmp_path / "logs"
    for name, condition in (("A_1", "normal"), ("A_2", "normal"), ("B_1", "normal"), ("B_2", "minor_leakage")):
        options = ("--plant", "circuit", "--duration", 4, "--sample-time", 1e-3, "--condition", condition)
        assert invoke("simulate", *options, "--out", logs / f"{name}.csv")[0] == 0
    (logs / "A_3.csv").write_text("a,b\n1,2\n")
    named = ("--pattern", "{actuator}_{date}.csv")
    code, out, said = invoke("fleet", logs, *named, "--out", tmp_path / "fleet", "--pages", 1, "--workers", 1)
    assert (code, out.strip()) == (1, f"{tmp_path}/fleet/index.html")
    assert "1 of 5 logs could not be read" in said
    page = (tmp_path / "fleet" / "index.html").read_text("utf-8")
    assert "1 of 2 actuators is past a limit." in page
    assert "Start with B." in page
    assert str(tmp_path) not in page
    (own,) = (tmp_path / "fleet" / "pages").iterdir()
    assert f"pages/{own.name}" in page
    assert "(minor leakage)" in own.read_text("utf-8")
    code, _, _ = invoke("fleet", tmp_path / "fleet" / "store", *named, "--out", tmp_path / "again")
    assert code == 1
    assert "Start with B." in (tmp_path / "again" / "index.html").read_text("utf-8")
