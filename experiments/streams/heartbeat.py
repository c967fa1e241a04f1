"""A heartbeat of a watch, even if no rows arrive: it tells a process that hangs from a test bench that is silent."""

import threading
import time
from collections.abc import Generator
from contextlib import contextmanager

from experiments.streams.watch_events import WatchEvents


@contextmanager
def report_alive(told: WatchEvents, every: float | None) -> Generator[None]:
    """Report at intervals during this block that the watch is alive.

    Parameters
    ----------
    every : float or None
        Time between two heartbeats [s]; None sends none.
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
