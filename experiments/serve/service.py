"""The server's state: its folder, its store and its jobs."""

import asyncio
import fcntl
import os
from contextlib import ExitStack, closing, suppress
from pathlib import Path
from typing import Any, TextIO

from pebble import ProcessExpired

from experiments.log_pages.comparison import compare_view
from experiments.running.refusal import os_errors_as
from experiments.serve.fleet_view import Repairs, actuator_view, fleet_view
from experiments.serve.jobs import BusyError, Jobs, log_file, page_file
from experiments.serve.limits import FreeSpace, RefusedError
from experiments.serve.live import Stream, Streams
from experiments.serve.settings import Settings
from experiments.serve.store import FAILED, INTERRUPTED, UNFINISHED, Store, StoredLog
from plant.errors import HydrostateError

LOCK = "in-use"


class Service:
    """A server's folder, and all work done in it."""

    store: Store
    jobs: Jobs
    streams: Streams
    room: FreeSpace
    _lock: TextIO

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self._fleet: tuple[str, asyncio.Future[str]] | None = None

    def open(self) -> None:
        """Open the folder and resume unfinished work.

        Raises
        ------
        HydrostateError
            If it cannot be written, is used by another server, or contains something else.
        """
        settings = self.settings
        if settings.folder.is_file():
            raise HydrostateError(f"{settings.folder}: a folder is needed, got a file")
        with os_errors_as(f"{settings.folder}: the server's folder cannot be made"):
            for folder in (settings.folder, settings.logs, settings.pages, settings.work):
                folder.mkdir(parents=True, exist_ok=True, mode=0o700)
            self._lock = (settings.folder / LOCK).open("a+")
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            self._lock.close()
            raise HydrostateError(f"{settings.folder}: must be free, another server works in it") from error
        with ExitStack() as undone:  # closes what is already open if a later step fails
            undone.callback(self._lock.close)
            self.store = undone.enter_context(closing(Store(settings.database)))
            self.room = FreeSpace(settings)
            delete_orphans(settings, self.store)
            self.jobs = undone.enter_context(closing(Jobs(settings, self.store)))
            self.jobs.resume()
            self.streams = Streams(settings, self.store)
            self.streams.start()
            undone.pop_all()

    def close(self) -> None:
        """Stop current work and release the folder."""
        self.streams.close()
        self.jobs.close()
        self.store.close()
        self._lock.close()

    def require_place(self) -> None:
        """Refuse a log that would wait too long.

        Raises
        ------
        RefusedError
            If the queue is full.
        """
        if self.jobs.waiting + self.room.uploads >= self.settings.waiting:
            raise RefusedError(429, f"{self.settings.waiting} logs are waiting, try again later")

    def take_in(self, identity: str, part: Path, name: str, verb: str, size: int) -> StoredLog:
        """Store a received log, and put it into the queue.

        Parameters
        ----------
        part : Path
            Its file, complete and on the disk.
        size : int
            Size of the file [bytes].

        Raises
        ------
        RefusedError
                If folder or database accept no more; the file is then deleted.
        """
        place = log_file(self.settings, identity)
        try:
            part.replace(place)
            folder = os.open(place.parent, os.O_RDONLY)
            try:
                os.fsync(folder)
            finally:
                os.close(folder)
            kept = self.store.add(identity, name, verb, size)
        except (HydrostateError, OSError) as error:
            part.unlink(missing_ok=True)
            place.unlink(missing_ok=True)
            raise RefusedError(413, f"the server's folder takes no more: {error}") from error
        self.room.add_received(size)
        self.jobs.submit(kept)
        return kept

    def require_log(self, identity: str) -> StoredLog:
        """Return a log.

        Raises
        ------
        RefusedError
            If there is none.
        """
        found = self.store.get(identity)
        if found is None:
            raise RefusedError(404, f"there is no log {identity}")
        return found

    def result(self, identity: str) -> dict[str, Any]:
        """Return the result of a log.

        Raises
        ------
        RefusedError
            If there is no such log, or it is not done.
        """
        log, found = self.require_log(identity), self.store.result(identity)
        if found is None:
            raise RefusedError(409, f"the work on {log.name} is not finished yet")
        return found

    def page(self, identity: str) -> Path:
        """Return the page of a log.

        Raises
        ------
        RefusedError
            If there is none, or none yet.
        """
        log, path = self.require_log(identity), page_file(self.settings, identity)
        if log.state == UNFINISHED:
            raise RefusedError(409, f"the work on {log.name} is not finished yet")
        if log.state in (FAILED, INTERRUPTED) or not path.exists():
            raise RefusedError(404, f"there is no page of {log.name}. {log.message}")
        return path

    def again(self, identity: str) -> StoredLog:
        """Put a finished log into the queue once more.

        Raises
        ------
        RefusedError
            If there is none, its file is gone, it is not finished, or the queue or the disk is full.
        """
        log = self.require_log(identity)
        if not log_file(self.settings, identity).exists():
            raise RefusedError(404, f"the file of {log.name} is no longer on the server")
        self.require_place()
        try:
            finished = self.store.reopen(identity)
        except HydrostateError as error:
            raise RefusedError(413, f"the server's folder takes no more: {error}") from error
        if not finished:
            raise RefusedError(409, f"the work on {log.name} is not finished yet")
        found = self.require_log(identity)
        self.jobs.submit(found)
        return found

    def delete(self, identity: str) -> None:
        """Delete a log with its results.

        Raises
        ------
        RefusedError
            If there is none, or the disk is so full that its row cannot be deleted.
        """
        try:
            known = self.store.delete(identity)
        except HydrostateError:  # the disk is full: the log's own files make room for the change
            self.require_log(identity)
            self._delete_files(identity)
            try:
                known = self.store.delete(identity)
            except HydrostateError as error:
                raise RefusedError(413, f"the log's files are deleted, its row is not: {error}") from error
        if not known:
            raise RefusedError(404, f"there is no log {identity}")
        self._delete_files(identity)

    def _delete_files(self, identity: str) -> None:
        self.jobs.cancel(identity)
        self.jobs.delete_files(identity)

    def stream(self, name: str) -> Stream:
        """Return a stream.

        Raises
        ------
        RefusedError
            If there is none.
        """
        found = self.streams.by_name.get(name)
        if found is None:
            raise RefusedError(404, f"no stream {name!r} is watched")
        return found

    async def fleet(self) -> str:
        """Return the page of the fleet; it is made anew when a log was diagnosed or deleted since.

        Raises
        ------
        RefusedError
            If no log was diagnosed yet, or there are too many requests at once.
        """
        repairs = await asyncio.to_thread(self._repairs)
        revision = f"{await asyncio.to_thread(self.store.revision)} {repairs}"
        page = self._page_of(revision)
        if page is None:
            rows = await asyncio.to_thread(lambda: list(self.store.diagnosed()))
            if not rows:
                raise RefusedError(404, "no log was diagnosed yet")
            # another request may have started it meanwhile
            page = self._page_of(revision) or self._start_fleet_page(revision, rows, repairs)
        try:
            return await asyncio.shield(page)
        except RefusedError:
            self._fleet = None
            raise

    def _page_of(self, revision: str) -> "asyncio.Future[str] | None":
        """Return the fleet page that is ready or in progress; None if it has to be made."""
        known = self._fleet
        return None if known is None or known[0] != revision or known[1].cancelled() else known[1]

    def _start_fleet_page(
        self, revision: str, rows: list[tuple[str, str, dict[str, Any]]], repairs: Repairs
    ) -> "asyncio.Future[str]":
        """Start to make the fleet page."""
        settings = self.settings
        name = settings.folder.resolve().name
        made = self._view(fleet_view, rows, settings.pattern, dict(settings.limits), repairs, name)
        page = asyncio.ensure_future(made)
        self._fleet = (revision, page)
        return page

    async def comparison(self, first: str, second: str) -> str:
        """Return the page of two logs side by side.

        Raises
        ------
        RefusedError
            If one is missing or unfinished, or there are too many requests at once.
        """
        pair = [await asyncio.to_thread(self.result, one) for one in (first, second)]
        return await self._view(compare_view, *pair, (first, second))

    async def actuator(self, name: str) -> str:
        """Return the page of an actuator.

        Parameters
        ----------
        name : str
            As the page of the fleet has it.

        Raises
        ------
        RefusedError
            If that actuator has no log, or there are too many requests at once.
        """
        rows = await asyncio.to_thread(lambda: list(self.store.diagnosed()))
        repairs = await asyncio.to_thread(self._repairs)
        asked = self.settings.pattern, dict(self.settings.limits), repairs, name
        page = await self._view(actuator_view, rows, *asked)
        if not page:
            raise RefusedError(404, f"no log is of an actuator {name!r}")
        return page

    def _repairs(self) -> Repairs:
        """Return the times at which actuators were repaired, as currently in the table."""
        from experiments.fleet.outlook import read_maintenance

        try:
            return read_maintenance(self.settings.maintenance)
        except HydrostateError as error:
            raise RefusedError(409, f"the table of repairs cannot be used: {error}") from error

    async def _view(self, make: Any, *args: Any) -> str:
        try:
            return await asyncio.wrap_future(self.jobs.view(make, *args))
        except BusyError as error:
            raise RefusedError(429, "too many pages over several logs are being made, try again later") from error
        except (TimeoutError, ProcessExpired) as error:
            raise RefusedError(429, "the page took too long to make, try again later") from error


def delete_orphans(settings: Settings, store: Store) -> None:
    """Delete files of logs that were deleted while they were processed."""
    for folder in (settings.logs, settings.pages, settings.work):
        for path in folder.iterdir():
            if store.get(path.stem) is None:
                with suppress(OSError):
                    path.unlink()
