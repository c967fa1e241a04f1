"""A progress bar on standard error, for several pieces of work and for what one of them is trying."""

import sys
from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from estimation.progress import reporting_to

if TYPE_CHECKING:
    from rich.progress import Progress


@contextmanager
def progress(total: int, what: str) -> Generator[Callable[[], None]]:
    """Show a bar on standard error, if that is a terminal: for pieces of work, and for what one of them is trying.

    A piece reports what it tries by `estimation.progress.report_progress`. A single piece has no bar before it reports.

    Yields
    ------
    callable
        To be called after every piece.
    """
    if not sys.stderr.isatty():
        yield lambda: None
        return
    bar = _Bar(total, what)
    if total > 1:
        bar.start()
    try:
        with reporting_to(bar.tried):
            yield bar.advance
    finally:
        bar.stop()


class _Bar:
    """A bar for pieces of work; for a single piece it has no end, since none is known."""

    def __init__(self, total: int, what: str) -> None:
        self.total, self.what, self.count = total, what, 0
        self.bar: Progress | None = None

    def start(self) -> "Progress":
        from rich.console import Console
        from rich.progress import (
            BarColumn,
            MofNCompleteColumn,
            Progress,
            TextColumn,
            TimeElapsedColumn,
            TimeRemainingColumn,
        )

        ends = (MofNCompleteColumn(), TimeRemainingColumn()) if self.total > 1 else (TimeElapsedColumn(),)
        columns = (TextColumn("{task.description}"), BarColumn(), *ends)
        bar = self.bar = Progress(*columns, console=Console(stderr=True), transient=True)
        bar.add_task(self.what, total=self.total if self.total > 1 else None)
        bar.start()
        return bar

    def tried(self, what: str) -> None:
        bar = self.start() if self.bar is None else self.bar
        self.count += 1
        bar.update(bar.task_ids[0], description=f"{self.what}: {what}, {self.count} tried")

    def advance(self) -> None:
        self.count = 0
        if self.bar is not None:
            self.bar.advance(self.bar.task_ids[0])

    def stop(self) -> None:
        if self.bar is not None:
            self.bar.stop()
