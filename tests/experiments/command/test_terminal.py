"""Messages on a terminal if a command ends in an unexpected way."""

import logging

import pytest
import typer

from experiments.command import terminal
from experiments.command.terminal import INTERRUPTED, SOME_FAILED, USAGE, guarded, rendered
from plant.compiled.expression import symbol
from plant.errors import HydrostateError


def raising(error: BaseException) -> int:
    def run() -> None:
        raise error

    return guarded(run)


@pytest.mark.parametrize(
    ("error", "code", "words"),
    [
        (KeyboardInterrupt(), INTERRUPTED, "hydrostate: interrupted"),
        (HydrostateError("a rig is needed"), USAGE, "hydrostate: a rig is needed"),
        (ZeroDivisionError("by nothing"), SOME_FAILED, "an internal error (ZeroDivisionError: by nothing)"),
        (MemoryError(), SOME_FAILED, "this log needs more memory than there is"),
    ],
)
def test_whatever_goes_wrong_is_one_sentence_and_a_code(
    error: BaseException, code: int, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert raising(error) == code
    said = capsys.readouterr()
    assert words in said.err
    assert said.out == ""
    assert "Traceback" not in said.err


def test_the_traceback_is_printed_where_it_is_asked_for(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("HYDROSTATE_DEBUG", "1")
    assert raising(ZeroDivisionError("by nothing")) == SOME_FAILED
    assert "Traceback" in capsys.readouterr().err


def test_a_model_that_cannot_be_compiled_is_its_authors_slip_and_no_internal_error(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert guarded(lambda: symbol("x") ** 0.5) == USAGE
    said = capsys.readouterr().err
    assert "write exp(power * log(x))" in said
    assert "internal error" not in said


@pytest.mark.parametrize("values", [[], [1.0], [2.0, 2.0, 2.0]])
def test_what_does_not_vary_has_no_curve(values: list[float]) -> None:
    assert terminal.sparkline(values, 8) == ""


def test_an_interrupted_command_says_so_and_ends_with_its_code(capsys: pytest.CaptureFixture[str]) -> None:
    app = typer.Typer(cls=terminal.HydrostateGroup, callback=lambda: None)

    @app.command()
    def wait() -> None:
        raise KeyboardInterrupt

    with pytest.raises(SystemExit) as ended:
        app(["wait"])
    assert ended.value.code == INTERRUPTED
    assert capsys.readouterr().err == "hydrostate: interrupted\n"


def test_compiling_is_said_once_and_every_warning(monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    monkeypatch.setattr(terminal, "note", said.append)
    notice = terminal._KernelNotice()
    for level in (logging.INFO, logging.INFO, logging.WARNING):
        notice.emit(logging.LogRecord("kernels", level, "", 0, "no compiler", None, None))
    assert len(said) == 2
    assert said[1] == "warning: no compiler"


def test_a_terminal_folds_lines_between_words_and_a_pipe_keeps_them_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    line = "  reliable  " + "yes: a circuit reproduces the log; " * 8
    assert rendered(line).splitlines() == [line.rstrip()]
    monkeypatch.setattr("sys.stdout.isatty", lambda: True, raising=False)
    monkeypatch.setenv("COLUMNS", "60")
    first, *others = rendered(line).splitlines()
    assert others
    assert max(map(len, (first, *others))) <= 60
    assert all(other.startswith(" " * 12) and other[12] != " " for other in others)
    assert " ".join(one.strip() for one in (first, *others)) == line.strip()


def test_no_name_of_a_file_reaches_a_terminal_as_more_than_text() -> None:
    name = "a\x1b[31m\x9b\u202evsc.\u2066\n.csv"
    shown = terminal.table(name, title=name)
    shown.add_row(*terminal.short_names([{"file": name}]))
    said = rendered(f"{name}: healthy", shown)
    assert not {"\x1b", "\x9b", "\u202e", "\u2066"} & set(said)
    assert "a\\x1b[31m\\x9b\\u202evsc.\\u2066\\x0a.csv" in said
