"""Output of the commands on streams: one JSON object per line; the last one says how the stream ended."""

import json
import signal
import threading
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from typing import Any, Protocol

import typer

from experiments.command.terminal import SOME_FAILED, emit, error_sentence, note
from plant.errors import HydrostateError


class EventSource(Protocol):
    """Source of a stream's events."""

    def end(self, outcome: str, message: str) -> None:
        """Report that the stream has ended, and how."""
        ...


@contextmanager
def report_end(told: EventSource) -> Generator[None]:
    """Follow a stream; however it ends, the last line reports it.

    Raises
    ------
    HydrostateError
        Any such error raised in the block.
    typer.Exit
        After an unexpected error, which is reported.
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
        said = error_sentence(error)
        told.end("failed", said)
        note(said)
        raise typer.Exit(SOME_FAILED) from error
    told.end("ok", "")


def stop_at_signals() -> None:
    """Turn a termination signal, or a closed terminal, into an interrupt, so that the last line is written."""
    if threading.current_thread() is not threading.main_thread():
        return
    for name in ("SIGTERM", "SIGHUP"):  # Windows has no SIGHUP
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is not signal.SIG_IGN:  # nohup ignores it; keep that
            signal.signal(number, signal.default_int_handler)


def say_line(entries: Mapping[str, Any]) -> None:
    """Print entries as a line of JSON."""
    emit(json.dumps(entries, allow_nan=False))
