"""Terminal output: results on standard output, everything else on standard error, and no traceback."""

import io
import logging
import os
import sys
import traceback
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from contextlib import contextmanager, suppress
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NoReturn, TextIO

import typer
from typer.core import TyperGroup

from experiments.command.plain_help import hide_bool, use_plain_help
from experiments.command.plain_values import accept_plain_values
from experiments.command.visible_text import visible, visible_name
from plant.errors import HydrostateError

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.table import Table

PIPE_WIDTH = 200
"""Largest width of a table that is not printed on a terminal, where lines should not be folded."""

USAGE, SOME_FAILED, INTERRUPTED = 2, 1, 130
"""Exit codes other than 0."""

_BLOCKS, _DIGITS = "\u2581\u2582\u2583\u2584\u2585\u2586\u2587\u2588", "_.-=+*%#"


def sparkline(values: "Sequence[float]", width: int) -> str:
    """Return a small one-line plot of the means of equal parts of the values.

    Parameters
    ----------
    values : sequence of float
        Finite numbers [any unit].
    width : int
        Largest number of characters.

    Returns
    -------
    str
        Block characters, or ASCII characters if the terminal has no others; empty if nothing varies.
    """
    count = len(values)
    parts = min(width, count)
    if parts < 2:
        return ""
    edges = [count * part // parts for part in range(parts + 1)]
    largest = max(abs(float(max(values))), abs(float(min(values)))) or 1.0
    chunks = [values[a : min(b, a + 200)] for a, b in pairwise(edges)]
    means = [sum(float(one) / largest for one in chunk) / len(chunk) for chunk in chunks]
    low, high = min(means), max(means)
    if not high > low:
        return ""
    signs = _BLOCKS if "utf" in (getattr(sys.stdout, "encoding", None) or "").lower() else _DIGITS
    return "".join(signs[min(7, int(8.0 * (one - low) / (high - low)))] for one in means)


def emit(text: str, *, err: bool = False) -> None:
    """Write a line to standard output or error; a closed pipe (``| head``) is ignored.

    Parameters
    ----------
    text : str
        The line or lines, without the last line's end.
    """
    stream = sys.stderr if err else sys.stdout
    try:
        stream.write(text + "\n")
        stream.flush()
    except BrokenPipeError:
        _redirect_to_null(stream)


def note(sentence: str) -> None:
    """Write a sentence to standard error."""
    emit(visible(" ".join(sentence.split())), err=True)


def clauses(parts: Iterable[str]) -> str:
    """Return several statements as one sentence.

    Parameters
    ----------
    parts : iterable of str
        The statements, with or without a full stop.

    Returns
    -------
    str
        The sentence, without a full stop.

    Examples
    --------
    >>> clauses(["It stuck.", "drive it harder"])
    'It stuck; drive it harder'
    """
    return "; ".join(part.rstrip(".") for part in parts)


def _redirect_to_null(stream: TextIO) -> None:
    with suppress(OSError):  # a stream in memory has no file descriptor
        number, nowhere = stream.fileno(), os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, number)
        os.close(nowhere)


def table(*headings: str, title: str | None = None) -> "Table":
    """Return an empty table; file names in it are folded, never cut.

    Parameters
    ----------
    *headings : str
        One for each column, with its unit; one that ends in ``]`` or ``±`` is for numbers, aligned to the right.
    title : str, optional
        Line above.
    """
    from rich import box
    from rich.table import Table
    from rich.text import Text

    unicode = "utf" in (getattr(sys.stdout, "encoding", None) or "").lower()
    head = None if title is None else Text(visible(title))
    made = Table(box=box.SIMPLE_HEAD if unicode else box.ASCII, title=head, title_justify="left")
    for heading in headings:
        numeric = heading.endswith("]")
        made.add_column(
            Text(visible(heading)), justify="right" if numeric else "left", overflow="fold", no_wrap=numeric
        )
    return made


def short_names(results: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return short names of logs for a narrow table, with folders only if file names are ambiguous.

    Parameters
    ----------
    results : sequence of Mapping
        One object for each log, with its ``file``.
    """
    files = [visible_name(result["file"]) for result in results]
    names = [file.replace(os.sep, "/").rsplit("/", 1)[-1] for file in files]
    return names if len(set(names)) == len(set(files)) else files


def folded_text(text: str, width: int) -> str:
    """Return a text folded between words; folded parts are aligned with the first words, or with those after a name.

    Parameters
    ----------
    text : str
        Lines, as ``"  oil       bulk modulus 207.0 MPa"``.
    width : int
        Largest number of characters in a line; a longer word stays whole.

    Examples
    --------
    >>> print(folded_text("  oil   bulk modulus 207.0 MPa", 24))
      oil   bulk modulus
            207.0 MPa
    """
    import re
    import textwrap

    lines: list[str] = []
    for line in text.split("\n"):
        named = re.match(r" {8,}| +\S+ {2,}", line)
        hang = " " * (len(named.group()) if named and len(named.group()) < width // 2 else 4)
        folder = textwrap.TextWrapper(width, subsequent_indent=hang, break_long_words=False, break_on_hyphens=False)
        lines += folder.wrap(line) or [""]
    return "\n".join(lines)


def render_text(*parts: "RenderableType") -> str:
    """Return tables and sentences as text for standard output, with colours only on a terminal.

    Parameters
    ----------
    *parts : str, rich.text.Text or rich.table.Table
        Items to show, in order; plain text is shown unchanged.

    Returns
    -------
    str
        The text, without its last line's end.
    """
    from rich.console import Console
    from rich.table import Table

    from experiments.command.narrow import as_lines, fit_to_width

    terminal = sys.stdout.isatty()
    width = None if terminal else PIPE_WIDTH
    as_is: Any = dict.fromkeys(("markup", "highlight", "emoji"), False)
    console = Console(file=io.StringIO(), force_terminal=terminal, width=width, **as_is)
    with console.capture() as captured:
        for part in parts:
            shown = fit_to_width(part, console.width) or f"\n{as_lines(part)}\n" if isinstance(part, Table) else part
            told = visible(shown) if isinstance(shown, str) else shown
            told = folded_text(told, console.width) if terminal and isinstance(told, str) else told
            console.print(told, soft_wrap=isinstance(told, str))
    return "\n".join(line.rstrip() for line in captured.get().strip("\n").splitlines())


class _KernelNotice(logging.Handler):
    """Reports once that kernels are being compiled, and passes warnings on."""

    def __init__(self) -> None:
        super().__init__(logging.INFO)
        self.said = False

    def emit(self, record: logging.LogRecord) -> None:
        if record.levelno >= logging.WARNING:
            note(f"warning: {record.getMessage()}")
        elif not self.said:
            self.said = True
            note("compiling kernels: this takes some seconds, once for each kind of work")


@contextmanager
def _kernel_notices() -> Generator[None]:
    logger, handler = logging.getLogger("hydrostate"), _KernelNotice()
    level, propagate = logger.level, logger.propagate
    logger.addHandler(handler)
    logger.setLevel(logging.INFO)
    logger.propagate = False
    try:
        yield
    finally:
        logger.removeHandler(handler)
        logger.setLevel(level)
        logger.propagate = propagate


def error_sentence(error: BaseException) -> str:
    """Return the sentence for an unforeseen error; with ``HYDROSTATE_DEBUG=1`` also print where it occurred."""
    if os.environ.get("HYDROSTATE_DEBUG", "") not in {"", "0"}:
        emit("".join(traceback.format_exception(error)).rstrip(), err=True)
    if isinstance(error, MemoryError):
        return "this log needs more memory than there is"
    said = " ".join(str(error).split())[:200]
    what = type(error).__name__ + (f": {said}" if said else "")
    return f"an internal error ({what}), please report it; HYDROSTATE_DEBUG=1 prints the traceback"


def run_guarded(run: Callable[[], object]) -> int:
    """Run the command line; any error becomes one sentence and an exit code.

    Parameters
    ----------
    run : callable
        Parses arguments and runs a command; returns its exit code, or anything else for 0.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    try:
        with _kernel_notices():
            code = run()
        emit_nothing_more()
    except (KeyboardInterrupt, typer.Abort):
        note("hydrostate: interrupted")
        return INTERRUPTED
    except HydrostateError as error:
        note(f"hydrostate: {error}")
        return USAGE
    except OSError as error:
        _redirect_to_null(sys.stdout)
        place = f"{error.filename}: " if error.filename else ""  # errors of stdout and of connections have none
        note(f"hydrostate: {place}{error.strerror or error}")
        return SOME_FAILED
    except Exception as error:
        said = _usage_sentence(error)
        if said is None:
            note(f"hydrostate: {error_sentence(error)}")
            return SOME_FAILED
        if said:
            note(said)
        return USAGE
    return code if isinstance(code, int) else 0


def emit_nothing_more() -> None:
    """Flush standard output now, while a closed pipe can still be handled silently."""
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        _redirect_to_null(sys.stdout)


def _usage_sentence(error: Exception) -> str | None:
    """Return the parser's sentence about wrong arguments; empty after help was shown; None for other errors."""
    message = getattr(error, "format_message", None)
    if message is None:
        return None
    command = getattr(getattr(error, "ctx", None), "command_path", "hydrostate")
    said = str(message())
    if command == "hydrostate" and said.startswith("No such option"):
        said += " (a command's options stand after its name)"
    if said.startswith("Missing"):
        said += f" `{command} --help` shows an example."
    if said.startswith("No such command") and said.endswith("'."):
        group: Any = getattr(error, "ctx", None)
        said += f" Commands: {', '.join(group.command.list_commands(group))}."
    return f"{command}: {said}" if said else ""


def _help_last(args: list[str]) -> list[str]:
    """Return ``help VERB`` rewritten as ``VERB --help``."""
    return [*args[1:], "--help"] if args[:1] == ["help"] else args


class HydrostateGroup(TyperGroup):
    """The command line, with errors as sentences and with the exit codes given in the help."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the arguments before the command; plain values need no import of a validator."""
        accept_plain_values(self.get_params(ctx))
        hide_bool(self.get_params(ctx))
        return super().parse_args(ctx, _help_last(args))

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return a command by its name; its plain values need no import of a validator either."""
        command = super().get_command(ctx, cmd_name)
        if command is not None:
            accept_plain_values(command.get_params(ctx))
            use_plain_help(command)
        return command

    def invoke(self, ctx: Any) -> Any:
        """Run the command; an interruption is reported here, since Typer would exit silently with its own code."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            note("hydrostate: interrupted")
            raise typer.Exit(INTERRUPTED) from None

    def main(self, *args: Any, **kwargs: Any) -> NoReturn:
        """Run the command line and exit."""
        kwargs["standalone_mode"] = False
        sys.exit(run_guarded(lambda: super(HydrostateGroup, self).main(*args, **kwargs)))
