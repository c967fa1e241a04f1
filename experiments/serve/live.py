"""Watched streams: one process each, restarted when it ends; gauges and events are stored for viewers."""

import multiprocessing
import os
import threading
import time
from collections import deque
from collections.abc import Mapping
from multiprocessing.connection import Connection
from typing import Any

from experiments.command.terminal import note
from experiments.serve.gauges import StreamTask, watch_stream
from experiments.serve.rigs import rig_of_stream
from experiments.serve.settings import Settings
from experiments.serve.store import Store
from experiments.streams.watch_events import STATES
from plant.errors import HydrostateError

MOST_GAUGES = 2400
"""Number of stored gauges [count]: ten minutes at four per second."""

RETRY_DELAY = 5.0
"""Delay between the end of a stream and the next attempt [s]."""

SHOWN_EVENTS = 200
"""Number of past events in a new view [count]."""


class Stream:
    """A watched stream.

    Parameters
    ----------
    name : str
        Name in requests.
    address : str
        Source of the stream.
    settings, store : Settings, Store
        Rig and columns, and the store for its events.
    """

    def __init__(self, name: str, address: str, settings: Settings, store: Store) -> None:
        self.name, self.address = name, address
        self._settings, self._store = settings, store
        self._lock = threading.Lock()
        self._gauges: deque[dict[str, Any]] = deque(maxlen=MOST_GAUGES)
        self._count, self._state, self._said, self._fresh = 0, "connecting", "", 0
        self.alarms = 0
        """Alarms since the server began [count]."""
        self._process: Any = None
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"stream {name}", daemon=True)

    def start(self) -> None:
        """Start to watch."""
        self._thread.start()

    def close(self) -> None:
        """End the watch and its process; the next watch continues from its saved state."""
        with self._lock:  # a process that has started is ended here; no other starts afterwards
            self._closed.set()
            if self._process is not None and self._process.is_alive():
                self._process.terminate()
        if self._thread.is_alive():
            self._thread.join(RETRY_DELAY)

    @property
    def state(self) -> dict[str, Any]:
        """State of the live view: ``state``, ``message``, and the last gauges."""
        with self._lock:
            last = self._gauges[-1] if self._gauges else None
            return {"name": self.name, "state": self._state, "message": self._said, "gauges": last}

    @property
    def revision(self) -> tuple[int, int]:
        """Numbers of the last gauges and of the last change of state or event; new ones have larger numbers."""
        return self._count, self._fresh

    def since(self, number: int) -> list[dict[str, Any]]:
        """Return the stored gauges with a ``number`` above the given one; 0 returns all."""
        with self._lock:
            new = min(self._count - number, len(self._gauges))
            return list(self._gauges)[len(self._gauges) - new :] if new > 0 else []

    def events(self) -> list[dict[str, Any]]:
        """Return the last events, the latest last."""
        return self._store.events(self.name, SHOWN_EVENTS)

    def _run(self) -> None:
        while not self._closed.is_set():
            try:
                self._watch_once()
            except OSError as error:  # no process or pipe was available; the next attempt may get them
                self._fail(f"it cannot be watched: {error.strerror or error}")
            except HydrostateError as error:  # its rig file was deleted
                self._fail(f"it cannot be watched: {error}")
            self._closed.wait(RETRY_DELAY)

    def _watch_once(self) -> None:
        """Watch the stream in its own process until that ends."""
        settings, context = self._settings, multiprocessing.get_context("spawn")
        state = settings.folder / f"stream-{self.name}.npz"
        rig = rig_of_stream(self.name, settings.rigs, settings.rig)
        columns = tuple(settings.columns.items())
        task = StreamTask(self.address, rig, columns, settings.false_alarms, state)
        ours, theirs = context.Pipe(duplex=False)
        with ours:
            with theirs, self._lock:
                if self._closed.is_set():
                    return
                process = context.Process(target=watch_stream, args=(theirs, os.getpid(), task), daemon=True)
                process.start()
                self._process = process
            self._listen(ours)
        self._process.join(RETRY_DELAY)
        if self._process.is_alive():
            self._process.kill()

    def _listen(self, ours: Connection) -> None:
        while True:
            try:
                kind, entries = ours.recv()
            except (EOFError, OSError):
                break
            if kind == "gauges":
                self._store_gauges(entries)
            else:
                self._store_event(entries)
        if self._state not in ("ended", "failed"):
            self._fail("the process that watched it ended")

    def _fail(self, message: str) -> None:
        with self._lock:
            self._state, self._said = "failed", message
            self._fresh += 1

    def _store_gauges(self, entries: Mapping[str, Any]) -> None:
        with self._lock:
            self._count += 1
            self._gauges.append({"number": self._count, "received": time.time(), **entries})

    def _store_event(self, entries: Mapping[str, Any]) -> None:
        event = entries["event"]
        told = STATES.get(event)
        failed = event == "end" and entries.get("outcome") == "failed"
        if not (failed and self._state == "failed" and self._said == entries["message"]):
            try:
                self._store.add_event(self.name, entries)
            except HydrostateError as error:  # a full disk must not end the watch
                note(f"serve: stream {self.name}: {event} is told, but not kept: {error}")
        with self._lock:
            self._state = "failed" if failed else told or self._state
            self._said = str(entries.get("message") or "")
            self.alarms += event == "alarm"
            self._fresh += 1


class Streams:
    """The streams of a server, by name.

    Parameters
    ----------
    settings, store : Settings, Store
        The streams to watch, and the store for their events.
    """

    def __init__(self, settings: Settings, store: Store) -> None:
        self.by_name = {name: Stream(name, address, settings, store) for name, address in settings.streams.items()}
        self.looking = 0

    def start(self) -> None:
        """Start to watch all streams."""
        for one in self.by_name.values():
            one.start()

    def close(self) -> None:
        """End all watches."""
        for one in self.by_name.values():
            one.close()
