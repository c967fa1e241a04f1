"""How the command ends: with its exit code, after all running work, and with all output written."""

import atexit
import gc
import os
import threading
from collections.abc import Iterator

import pytest

from experiments import cli


class Ended(BaseException):
    """Stands in for the end of the process."""


@pytest.fixture
def order(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[str]]:
    """Return what happens at the end of the command, in order."""
    happened: list[str] = []

    def end(code: int) -> None:
        happened.append(f"end {code}")
        raise Ended

    thresholds = gc.get_threshold()
    monkeypatch.setattr(os, "_exit", end)
    monkeypatch.setattr(atexit, "_run_exitfuncs", lambda: happened.append("exit functions"))
    monkeypatch.setattr(cli, "trust_sources", lambda: happened.append("sources trusted"))
    monkeypatch.setattr(cli, "SHUTDOWN_WAIT", 5.0)
    for name in ("OPENBLAS", "OMP", "MKL"):
        monkeypatch.setenv(f"{name}_NUM_THREADS", "3")
    yield happened
    gc.set_threshold(*thresholds)


def test_the_immediate_exit_waits_for_threads_and_calls_the_exit_functions(
    order: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    go_on = threading.Event()

    def works() -> None:
        go_on.wait(5.0)
        order.append("thread done")

    def command() -> None:
        threading.Thread(target=works).start()
        threading.Timer(0.05, go_on.set).start()
        raise SystemExit(1)

    monkeypatch.setattr(cli, "app_for", lambda _: command)
    with pytest.raises(Ended):
        cli.main()
    assert order == ["sources trusted", "thread done", "exit functions", "end 1"]


def test_an_exit_with_a_text_instead_of_a_code_is_left_to_python(
    order: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def command() -> None:
        raise SystemExit("words")

    monkeypatch.setattr(cli, "app_for", lambda _: command)
    with pytest.raises(SystemExit, match="words"):
        cli.main()
    assert order == ["sources trusted"]


def test_an_interruption_while_a_command_is_loaded_prints_one_line(
    order: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def loaded(_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(cli, "app_for", loaded)
    with pytest.raises(Ended):
        cli.main()
    assert order == ["sources trusted", "end 130"]
    assert capsys.readouterr().err == "hydrostate: interrupted\n"


def test_the_number_of_threads_is_the_user_s_or_one_by_default(
    order: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("OMP_NUM_THREADS")
    monkeypatch.setattr(cli, "app_for", lambda _: lambda: None)
    cli.main()
    assert (os.environ["OMP_NUM_THREADS"], os.environ["MKL_NUM_THREADS"]) == ("1", "3")
    assert order == ["sources trusted"]


def test_the_version_is_that_of_the_installed_package() -> None:
    from importlib.metadata import version

    from typer.testing import CliRunner

    done = CliRunner().invoke(cli.app, ["--version"])
    assert done.exit_code == 0
    assert done.stdout.strip() == f"hydrostate {version('hydrostate')}"
