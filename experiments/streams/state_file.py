"""The file in which a stream saves what it has learnt, so that it continues after a restart."""

from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path

from experiments.command.terminal import note
from plant.errors import HydrostateError, LogError

SAVED_EVERY = 10.0
"""Stream time between two checks of the state file [s]."""


@contextmanager
def save_at_intervals(
    path: Path | None, write: Callable[[Path], None], start: float
) -> Generator[Callable[[float], None]]:
    """Save what a stream has learnt at intervals during this block, and at its end.

    If the file cannot be written while the stream runs, this is reported once, and the stream continues.

    Parameters
    ----------
    path : Path or None
        The state file; None saves nothing.
    write : callable
        Writes the file; must leave no partial file behind.
    start : float
        Stream time at the start of the block [s].

    Yields
    ------
    callable
        To be called with the time of the stream [s] after every piece.

    Raises
    ------
    HydrostateError
        If the file cannot be written at the end.
    """
    if path is None:
        yield lambda _: None
        return
    saved, failed = start, False

    def save_if_due(now: float) -> None:
        nonlocal saved, failed
        if now - saved <= SAVED_EVERY:
            return
        saved = now
        try:
            write(path)
        except HydrostateError as error:
            if not failed:
                note(f"warning: {error}; the stream goes on without")
            failed = True
        else:
            failed = False

    try:
        yield save_if_due
    finally:
        write(path)


def require_same_rate(path: Path, kept: float, sample_time: float, source: str) -> None:
    """Raise an error if the sample rate of a state file differs from the stream's.

    Parameters
    ----------
    kept, sample_time : float
        Sample times of the state file and of the stream [s].
    source : str
        Name of the stream in errors.

    Raises
    ------
    LogError
        If they differ.
    """
    from plant.log.stream.csv_rows import SAME_RATE

    if abs(kept / sample_time - 1.0) > SAME_RATE:
        raise LogError(f"{path} was saved at {1.0 / kept:g} Hz, but the stream has {1.0 / sample_time:g} Hz", source)
