"""A bar moves with each piece of work, and within a piece with each of its tries."""

import io

import pytest

from estimation.progress import report_progress
from experiments.command.progress_bar import progress


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def shown_on(monkeypatch: pytest.MonkeyPatch) -> Terminal:
    shown = Terminal()
    monkeypatch.setattr("sys.stderr", shown)
    monkeypatch.setenv("TERM", "xterm")
    return shown


def test_a_single_task_shows_a_bar_once_it_reports_a_trial(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = shown_on(monkeypatch)
    with progress(1, "identifying") as advance:
        assert terminal.getvalue() == ""
        for _ in range(3):
            report_progress("linear models")
        advance()
    assert "identifying: linear models, 3 tried" in terminal.getvalue()


def test_with_several_tasks_the_trials_of_each_are_counted_separately(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = shown_on(monkeypatch)
    with progress(2, "identifying") as advance:
        report_progress("linear models")
        advance()
        report_progress("polynomial models")
    assert "identifying: polynomial models, 1 tried" in terminal.getvalue()
    assert "1/2" in terminal.getvalue()


def test_no_progress_is_shown_if_standard_error_is_not_a_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    with progress(2, "identifying") as advance:
        report_progress("linear models")
        advance()
    assert capsys.readouterr().err == ""
