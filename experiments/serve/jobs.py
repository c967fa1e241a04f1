"""The queue of a server: logs are processed in processes with limits on time and memory, and can be cancelled."""

import multiprocessing
import os
import threading
from collections.abc import Callable
from concurrent.futures import CancelledError, Future
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

from pebble import ProcessExpired, ProcessPool

from experiments.command.terminal import error_sentence, note
from experiments.serve.settings import MB, Settings
from experiments.serve.store import DONE, FAILED, INTERRUPTED, Store, StoredLog
from experiments.serve.work import NO_MEMORY, LogResult, Task, begin_worker, process_log
from plant.errors import HydrostateError

MOST_TRIES = 3
"""Number of servers that may end while processing a log before it is given up [count]."""

LOGS_PER_PROCESS = 50
"""Logs after which a process is replaced by a new one [count], which limits memory leaks in libraries."""

VIEW_SECONDS = 60.0
"""Longest time to make a page about several logs [s]."""

MOST_VIEWS = 8
"""Largest number of such pages in progress or waiting [count]."""

KEEP_DELAY = 5.0
"""Delay between attempts to store a result that the folder did not take [s]."""

KEEPING = "worked out; its result waits until the server's folder takes it"
"""Step of a log whose result is not stored yet."""

T = TypeVar("T")


class BusyError(RuntimeError):
    """There is no capacity for more work now."""


class Jobs:
    """The work of a server.

    Parameters
    ----------
    settings : Settings
        The number of parallel jobs, and their limits.
    store : Store
        Receives the results.
    """

    def __init__(self, settings: Settings, store: Store) -> None:
        self._settings, self._store = settings, store
        self._waiting: dict[str, Future[Any]] = {}
        self._unkept: dict[str, tuple[StoredLog, LogResult]] = {}
        self._views = 0
        self._lock = threading.Lock()
        self._closing = threading.Event()
        context = multiprocessing.get_context("spawn")
        born: Any = {"initializer": begin_worker, "initargs": (os.getpid(), settings.memory), "context": context}
        self._pool = ProcessPool(max_workers=settings.workers, max_tasks=LOGS_PER_PROCESS, **born)
        self._drawing = ProcessPool(max_workers=1, max_tasks=LOGS_PER_PROCESS, **born)

    @property
    def waiting(self) -> int:
        """Logs that are running or waiting [count]."""
        return len(self._waiting)

    def resume(self) -> None:
        """Resume what an earlier server did not finish; a log is given up if several servers ended during its work."""
        for log in self._store.unfinished():
            if self.phase(log.id) is not None:
                self._store.count_try(log.id)
                if log.tries + 1 >= MOST_TRIES:
                    said = f"interrupted: the server ended {MOST_TRIES} times while it worked on this log"
                    self._store.finish(log.id, INTERRUPTED, {"file": log.name, "outcome": "failed", "message": said})
                    continue
            if not log_file(self._settings, log.id).exists():
                said = "interrupted: its file is no longer in the server's folder"
                self._store.finish(log.id, INTERRUPTED, {"file": log.name, "outcome": "failed", "message": said})
                continue
            self.submit(log)
        for left in self._settings.work.iterdir():
            if left.suffix == ".part":
                left.unlink(missing_ok=True)

    def submit(self, log: StoredLog) -> None:
        """Put a log into the queue."""
        settings = self._settings
        with suppress(OSError):  # on a full disk, the steps of the work are not shown
            phase_file(settings, log.id).write_bytes(b"")  # a process changes it, but never makes it: see `tell_phase`
        task = Task(
            log_file(settings, log.id),
            log.name,
            log.verb,
            page_file(settings, log.id),
            phase_file(settings, log.id),
            settings.plant,
            settings.rig,
            tuple(settings.columns.items()),
            settings.rigs,
            settings.pattern,
        )
        with self._lock:
            future: Future[Any] = self._pool.schedule(process_log, args=(task,), timeout=settings.seconds)
            self._waiting[log.id] = future
        future.add_done_callback(lambda done: self._on_end(log, done))

    def cancel(self, identity: str) -> None:
        """Cancel a log: remove it from the queue, or end the process that works on it."""
        with self._lock:
            self._unkept.pop(identity, None)
            future = self._waiting.pop(identity, None)
        if future is not None:
            future.cancel()

    def phase(self, identity: str) -> str | None:
        """Return the current step of the work on a log; None while it waits."""
        if identity in self._unkept:
            return KEEPING
        with suppress(OSError):
            return phase_file(self._settings, identity).read_text(encoding="utf-8") or None
        return None

    def has_page(self, identity: str) -> bool:
        """Return whether a log has a page."""
        return page_file(self._settings, identity).exists()

    def view(self, make: Callable[..., T], *args: Any) -> "Future[T]":
        """Make a page about several logs in another process.

        Parameters
        ----------
        make : callable
            A module-level function and its arguments, which are sent to another process.

        Raises
        ------
        BusyError
            If too many are in progress.
        """
        with self._lock:
            if self._views >= MOST_VIEWS:
                raise BusyError
            self._views += 1
        future: Future[T] = self._drawing.schedule(make, args=args, timeout=VIEW_SECONDS)

        def ended(_: "Future[T]") -> None:
            with self._lock:
                self._views -= 1

        future.add_done_callback(ended)
        return future

    def close(self) -> None:
        """End the processes; the next server resumes unfinished work."""
        self._closing.set()
        for pool in (self._pool, self._drawing):
            pool.stop()
        for pool in (self._pool, self._drawing):
            pool.join()

    def _on_end(self, log: StoredLog, future: "Future[Any]") -> None:
        if self._closing.is_set():
            return
        with self._lock:
            taken_back = self._waiting.get(log.id) is not future
        if taken_back:
            self.delete_files(log.id)
            return
        try:
            worked: LogResult = future.result()
        except CancelledError:
            worked = self._failed_result("it was cancelled", log)
        except TimeoutError:
            worked = self._failed_result(f"it took longer than {self._settings.seconds:g} s and was stopped", log)
        except ProcessExpired as error:
            worked = self._failed_result(_why_expired(error.exitcode, self._settings.memory // MB), log)
        except Exception as error:  # the worker could not report its error
            worked = self._failed_result(error_sentence(error), log)
        try:
            self._keep_or_wait(log, worked)
        except Exception as error:  # the result is no JSON
            self._keep_or_wait(log, self._failed_result(error_sentence(error), log))

    def _keep_or_wait(self, log: StoredLog, worked: LogResult) -> None:
        try:
            self._keep(log, worked)
        except HydrostateError as error:
            note(f"serve: the result of {log.name} cannot be stored yet, this is tried again: {error}")
            self._keep_later(log, worked)

    def _keep(self, log: StoredLog, worked: LogResult) -> None:
        """Store the result of a log, which then leaves the queue."""
        state = FAILED if worked.result["outcome"] == "failed" else DONE
        self._store.finish(log.id, state, worked.result, worked.entries, worked.said)
        if self._store.get(log.id) is None:
            self.delete_files(log.id)
        phase_file(self._settings, log.id).unlink(missing_ok=True)
        with self._lock:
            self._waiting.pop(log.id, None)
            self._unkept.pop(log.id, None)

    def _keep_later(self, log: StoredLog, worked: LogResult) -> None:
        """Keep a result in memory until the store takes it; a server that ends before works on the log again."""
        phase_file(self._settings, log.id).unlink(missing_ok=True)  # that end is not the log's fault
        with self._lock:
            alone = not self._unkept
            self._unkept[log.id] = log, worked
        if alone:
            threading.Thread(target=self._keep_all, name="unkept results", daemon=True).start()

    def _keep_all(self) -> None:
        while self._unkept and not self._closing.wait(KEEP_DELAY):
            for log, worked in list(self._unkept.values()):
                with suppress(HydrostateError):
                    self._keep(log, worked)

    def _failed_result(self, message: str, log: StoredLog) -> LogResult:
        entries = {"outcome": "failed", "reason": message} if log.verb == "diagnose" else None
        return LogResult({"file": log.name, "outcome": "failed", "message": message}, entries)

    def delete_files(self, identity: str) -> None:
        """Delete a log with its page and the step of the work on it."""
        for path in (log_file, page_file, phase_file):
            path(self._settings, identity).unlink(missing_ok=True)


def _why_expired(code: int, most: int) -> str:
    if code == NO_MEMORY:
        return f"the work on it needs more memory than the {most} MB that the server gives to one log"
    return f"the process that worked on it ended (code {code}), perhaps for want of memory: it may use {most} MB"


def log_file(settings: Settings, identity: str) -> Path:
    """Return the path of a stored log; its format is detected by content, so its name needs no suffix."""
    return settings.logs / identity


def page_file(settings: Settings, identity: str) -> Path:
    """Return the path of a log's page."""
    return settings.pages / f"{identity}.html"


def phase_file(settings: Settings, identity: str) -> Path:
    """Return the file that holds the current step of the work on a log."""
    return settings.work / identity
