"""A sign of life of a watch, also while nothing comes: a process that hangs is told from a bench that is silent."""

import threading
import time
from collections.abc import Generator
from contextlib import contextmanager

from experiments.streams.watch_events import WatchEvents


@contextmanager
def beating(told: WatchEvents, every: float | None) -> Generator[None]:
    """Tell in this block, every so often, that the watch is alive.

    Parameters
    ----------
    every : float or None
        Time between two signs of life [s]; None tells none.
    """
    if every is None:
        yield
        return
    over = threading.Event()

    def beat() -> None:
        due = time.monotonic() + every
        while not over.wait(min(max(due - time.monotonic(), 0.0), threading.TIMEOUT_MAX)):
            told.alive()
            due += every

    beats = threading.Thread(target=beat, name="heartbeat", daemon=True)
    beats.start()
    try:
        yield
    finally:
        over.set()
        beats.join()
