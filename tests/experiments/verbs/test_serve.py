"""`hydrostate serve`: what it refuses before it listens, and its message if a package is missing."""

import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from experiments.cli import app


def refused(*arguments: object) -> str:
    done = CliRunner().invoke(app, ["serve", *map(str, arguments)])
    assert done.exit_code == 2, done.output
    return " ".join(done.stderr.split())


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--watch", "http://127.0.0.1"), "--watch must be NAME=tcp://HOST:PORT"),
        (("--watch", "../x=tcp://127.0.0.1:1"), "--watch must be NAME=tcp://HOST:PORT"),
        (("--watch", "a=tcp://h:1", "--watch", "a=tcp://h:2"), "'a' twice"),
        (("--limit", "leak=2"), "--limit must be one of"),
        (("--pattern", "{date}.csv"), "--pattern must hold {actuator} once"),
        (("--token", "short"), "16 ASCII letters"),
        (("--host", "203.0.113.1", "--port", "0"), "cannot listen there"),
    ],
)
def test_invalid_server_options_are_refused(tmp_path: Path, options: tuple[str, ...], words: str) -> None:
    assert words in refused(tmp_path / "kept", *options)


def test_a_stream_of_another_kind_of_actuator_is_refused_before_anything_is_served(tmp_path: Path) -> None:
    rig = tmp_path / "stack.toml"
    rig.write_text('plant = "piezo-stack"\n')
    for how in (("--rig", rig), ("--rigs", tmp_path)):
        said = refused(tmp_path / "kept", "--watch", "stack=tcp://127.0.0.1:1", *how)
        assert "--watch stack: " in said
        assert "a rig of plant 'eha' is needed here, got one of 'piezo-stack'" in said
    assert not (tmp_path / "kept").exists()


def test_a_folder_that_cannot_be_made_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder")
    assert "the server's folder cannot be made" in refused(tmp_path / "file" / "kept", "--port", "0")
    said = refused(tmp_path / "file", "--port", "0")
    assert "file: a folder is needed, got a file" in said
    assert "are kept in" not in said


@pytest.mark.parametrize("named", [True, False])
def test_the_folder_of_the_server_is_printed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, named: bool) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("experiments.serve.server.run_server", lambda _, say: say("http://here"))
    done = CliRunner().invoke(app, ["serve", *(["kept"] if named else [])])
    assert done.exit_code == 0, done.output
    folder = tmp_path / ("kept" if named else "hydrostate-server")
    assert f"logs, pages and results are kept in {folder}" in done.stderr.replace("\n", "")
    assert ("hydrostate serve FOLDER" in done.stderr) is not named


def test_a_missing_package_is_reported_with_the_extra_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "experiments.serve.server", None)  # as if a package that it imports were missing
    assert "pip install 'hydrostate[serve]'" in refused()


def test_a_system_without_fcntl_gets_its_own_message(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("server", "service", "app"):
        monkeypatch.delitem(sys.modules, f"experiments.serve.{name}", raising=False)
    monkeypatch.setitem(sys.modules, "fcntl", None)
    assert "serve runs on Linux and macOS, this system has no fcntl" in refused()


def test_a_stream_with_another_kind_of_actuator_as_the_plant_is_refused(tmp_path: Path) -> None:
    told = refused(tmp_path / "kept", "--plant", "piezo-stack", "--watch", "x=tcp://127.0.0.1:1")
    assert "--watch works for the gear-pump actuator (eha) only, got --plant piezo-stack" in told
    assert not (tmp_path / "kept").exists()
