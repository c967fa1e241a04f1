"""Messages on a terminal if a command ends in an unexpected way."""

import logging

import pytest
import typer

from experiments.command import terminal
from experiments.command.terminal import INTERRUPTED, SOME_FAILED, USAGE, render_text, run_guarded
from plant.compiled.expression import symbol
from plant.errors import HydrostateError


def raising(error: BaseException) -> int:
    def run() -> None:
        raise error

    return run_guarded(run)


@pytest.mark.parametrize(
    ("error", "code", "words"),
    [
        (KeyboardInterrupt(), INTERRUPTED, "hydrostate: interrupted"),
        (HydrostateError("a rig is needed"), USAGE, "hydrostate: a rig is needed"),
        (ZeroDivisionError("by nothing"), SOME_FAILED, "an internal error (ZeroDivisionError: by nothing)"),
        (MemoryError(), SOME_FAILED, "this log needs more memory than there is"),
    ],
)
def test_every_error_is_one_sentence_and_an_exit_code(
    error: BaseException, code: int, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert raising(error) == code
    said = capsys.readouterr()
    assert words in said.err
    assert said.out == ""
    assert "Traceback" not in said.err


def test_the_traceback_of_an_internal_error_is_printed_on_request(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("HYDROSTATE_DEBUG", "1")
    assert raising(ZeroDivisionError("by nothing")) == SOME_FAILED
    assert "Traceback" in capsys.readouterr().err


def test_a_model_that_cannot_be_compiled_is_a_usage_error(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert run_guarded(lambda: symbol("x") ** 0.5) == USAGE
    said = capsys.readouterr().err
    assert "write exp(power * log(x))" in said
    assert "internal error" not in said


@pytest.mark.parametrize("values", [[], [1.0], [2.0, 2.0, 2.0]])
def test_constant_values_have_no_sparkline(values: list[float]) -> None:
    assert terminal.sparkline(values, 8) == ""


def test_an_interrupted_command_prints_this_and_ends_with_its_exit_code(capsys: pytest.CaptureFixture[str]) -> None:
    app = typer.Typer(cls=terminal.HydrostateGroup, callback=lambda: None)

    @app.command()
    def wait() -> None:
        raise KeyboardInterrupt

    with pytest.raises(SystemExit) as ended:
        app(["wait"])
    assert ended.value.code == INTERRUPTED
    assert capsys.readouterr().err == "hydrostate: interrupted\n"


def test_compiling_is_announced_once_and_every_warning_is_printed(monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    monkeypatch.setattr(terminal, "note", said.append)
    notice = terminal._KernelNotice()
    for level in (logging.INFO, logging.INFO, logging.WARNING):
        notice.emit(logging.LogRecord("kernels", level, "", 0, "no compiler", None, None))
    assert len(said) == 2
    assert said[1] == "warning: no compiler"


def test_long_lines_are_wrapped_between_words_on_a_terminal_and_not_in_a_pipe(monkeypatch: pytest.MonkeyPatch) -> None:
    line = "  reliable  " + "yes: a circuit reproduces the log; " * 8
    assert render_text(line).splitlines() == [line.rstrip()]
    monkeypatch.setattr("sys.stdout.isatty", lambda: True, raising=False)
    monkeypatch.setenv("COLUMNS", "60")
    first, *others = render_text(line).splitlines()
    assert others
    assert max(map(len, (first, *others))) <= 60
    assert all(other.startswith(" " * 12) and other[12] != " " for other in others)
    assert " ".join(one.strip() for one in (first, *others)) == line.strip()


def test_control_characters_in_file_names_are_escaped_on_the_terminal() -> None:
    name = "a\x1b[31m\x9b\u202evsc.\u2066\n.csv"
    shown = terminal.table(name, title=name)
    shown.add_row(*terminal.short_names([{"file": name}]))
    said = render_text(f"{name}: healthy", shown)
    assert not {"\x1b", "\x9b", "\u202e", "\u2066"} & set(said)
    assert "a\\x1b[31m\\x9b\\u202evsc.\\u2066\\x0a.csv" in said
