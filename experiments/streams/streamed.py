"""What the commands on streams share: lines in, lines out, and a last line that says how the stream ended."""

import io
import json
import signal
import threading
from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, Protocol, TextIO

import typer

from experiments.command.terminal import SOME_FAILED, emit, note, unexpected
from plant.errors import HydrostateError
from plant.log.stream_source import bounded_lines

STANDARD_INPUT = "standard input"
"""What standard input is called in events and errors."""


class EventSource(Protocol):
    """What tells of a stream."""

    def end(self, outcome: str, message: str) -> None:
        """Tell that the stream has ended, and how."""
        ...


@contextmanager
def end_told(told: EventSource) -> Generator[None]:
    """Follow a stream; whatever ends it, the last line says so.

    Parameters
    ----------
    told : EventSource
        What tells of it.

    Raises
    ------
    HydrostateError
        As within.
    typer.Exit
        After an error that nobody expected, which is noted.
    """
    try:
        yield
    except HydrostateError as error:
        told.end("failed", str(error))
        raise
    except KeyboardInterrupt:
        told.end("interrupted", "interrupted")
        raise
    except BaseException as error:
        said = unexpected(error)
        told.end("failed", said)
        note(said)
        raise typer.Exit(SOME_FAILED) from error
    told.end("ok", "")


class Saving:
    """Saves what was learnt while a stream runs; where that fails the stream goes on, and it is said once."""

    def __init__(self) -> None:
        self._failed = False

    def save(self, write: Callable[[], None]) -> None:
        """Save now, or say why that is not possible.

        Parameters
        ----------
        write : callable
            Writes the state file, whole or not at all.
        """
        try:
            write()
        except HydrostateError as error:
            if not self._failed:
                note(f"warning: {error}; the stream goes on without")
            self._failed = True
        else:
            self._failed = False


def stop_at_sigterm() -> None:
    """Let a signal to end a process interrupt it, so that its last line is written."""
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, signal.default_int_handler)


def say_line(entries: Mapping[str, Any]) -> None:
    """Print entries as a line of JSON."""
    emit(json.dumps(entries, allow_nan=False))


def stream_input(file: TextIO) -> Iterator[str]:
    """Yield the lines of standard input; bytes that are no text are refused later as no numbers.

    Raises
    ------
    LogError
        If a line does not end.
    """
    if isinstance(file, io.TextIOWrapper):
        file.reconfigure(errors="replace")
    return bounded_lines(file, STANDARD_INPUT)
