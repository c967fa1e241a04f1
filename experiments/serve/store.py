"""Store of a server for logs and alarms, in SQLite with a write-ahead log: a kill loses no finished result."""

import json
import os
import sqlite3
import threading
import time
from collections.abc import Generator, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from experiments.running.refusal import refused
from plant.errors import HydrostateError

VERSION = 1
"""Of the tables; a folder that a later version wrote is refused."""

MOST_EVENTS = 10_000
"""Events of streams that are kept [count]."""

TABLES = """
CREATE TABLE logs (
  number INTEGER PRIMARY KEY AUTOINCREMENT, id TEXT NOT NULL UNIQUE, name TEXT NOT NULL, verb TEXT NOT NULL,
  size INTEGER NOT NULL, state TEXT NOT NULL, tries INTEGER NOT NULL DEFAULT 0, received REAL NOT NULL, ended REAL,
  outcome TEXT, message TEXT, result TEXT, entries TEXT
);
CREATE INDEX logs_by_state ON logs (state);
CREATE VIEW kept AS
  SELECT number, id, name, verb, size, state, tries, received, ended, outcome, message FROM logs;
CREATE TABLE events (
  number INTEGER PRIMARY KEY AUTOINCREMENT, stream TEXT NOT NULL, received REAL NOT NULL, event TEXT NOT NULL
);
CREATE INDEX events_by_stream ON events (stream, number);
"""

UNFINISHED, DONE, FAILED, INTERRUPTED = "unfinished", "done", "failed", "interrupted"
"""States of a log: to be worked on, worked on, not usable, and given up since the server ended in the middle of it."""


@dataclass(frozen=True)
class StoredLog:
    """A log in the store, with its state.

    Parameters
    ----------
    number : int
        Later logs have larger ones.
    id : str
        What it is asked for by.
    name : str
        Of the file, as the client called it.
    verb : str
        What is done with it.
    size : int
        Of the file [bytes].
    state : str
        ``unfinished``, ``done``, ``failed`` or ``interrupted``.
    tries : int
        How often work on it was begun by a server that then ended.
    received, ended : float, float or None
        When it came and when the work was over, since 1970 [s].
    outcome, message : str or None
        What came of it, and that in a sentence.
    """

    number: int
    id: str
    name: str
    verb: str
    size: int
    state: str
    tries: int
    received: float
    ended: float | None
    outcome: str | None
    message: str | None


class Store:
    """The database of a server.

    Raises
    ------
    HydrostateError
        If the file is no such database, or of a later version; later on, whenever it cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self._lock = threading.Lock()
        with refused(f"{path}: the server's database cannot be opened"):
            # results are for the server's own user; SQLite gives its other files the same mode
            os.close(os.open(path, os.O_RDWR | os.O_CREAT, 0o600))
        self._connection = sqlite3.connect(path, check_same_thread=False, isolation_level=None)
        try:
            self._connection.execute("PRAGMA journal_mode = WAL")
            self._connection.execute("PRAGMA synchronous = FULL")
            (version,) = self._connection.execute("PRAGMA user_version").fetchone()
            if version == 0:
                self._connection.executescript(f"BEGIN; {TABLES} PRAGMA user_version = {VERSION}; COMMIT;")
        except sqlite3.Error as error:
            self._connection.close()
            raise HydrostateError(f"{path}: must be a database of this server: {error}") from error
        if version > VERSION:
            self._connection.close()
            raise HydrostateError(f"{path}: must be of version {VERSION}, a later Hydrostate wrote version {version}")

    def close(self) -> None:
        """Close the file."""
        with self._lock:
            self._connection.close()

    def add(self, identity: str, name: str, verb: str, size: int) -> StoredLog:
        """Keep a log that came, to be worked on.

        Parameters
        ----------
        size : int
            Of its file [bytes].
        """
        with self._writing() as connection:
            connection.execute(
                "INSERT INTO logs (id, name, verb, size, state, received) VALUES (?, ?, ?, ?, ?, ?)",
                (identity, name, verb, size, UNFINISHED, time.time()),
            )
        found = self.get(identity)
        if found is None:
            raise HydrostateError(f"{name}: was deleted during the upload")
        return found

    def get(self, identity: str) -> StoredLog | None:
        """Return a stored log; None if there is none of that identity."""
        rows = self._asked("SELECT * FROM kept WHERE id = ?", identity)
        return StoredLog(*rows[0]) if rows else None

    def latest(self, most: int, before: int | None = None) -> list[StoredLog]:
        """Return logs, the latest first.

        Parameters
        ----------
        before : int, optional
            Number that theirs are below.
        """
        below = before if before is not None else 1 << 62
        rows = self._asked("SELECT * FROM kept WHERE number < ? ORDER BY number DESC LIMIT ?", below, most)
        return [StoredLog(*row) for row in rows]

    def unfinished(self) -> list[StoredLog]:
        """Return the logs that are to be worked on, the first first."""
        rows = self._asked("SELECT * FROM kept WHERE state = ? ORDER BY number", UNFINISHED)
        return [StoredLog(*row) for row in rows]

    def counts(self) -> dict[str, int]:
        """Return the number of logs in each state."""
        return {str(state): int(count) for state, count in self._asked("SELECT state, COUNT(*) FROM logs GROUP BY 1")}

    def tried(self, identity: str) -> None:
        """Count that a server ended in the middle of the work on a log."""
        with self._writing() as connection:
            connection.execute("UPDATE logs SET tries = tries + 1 WHERE id = ?", (identity,))

    def finish(
        self,
        identity: str,
        state: str,
        result: Mapping[str, Any],
        entries: Mapping[str, Any] | None = None,
        said: str = "",
    ) -> None:
        """Keep the result of a log; a log that was deleted meanwhile stays deleted.

        Parameters
        ----------
        state : str
            ``done``, ``failed`` or ``interrupted``.
        result : Mapping
            Entries of the JSON contract, ``outcome`` and ``message`` among them.
        entries : Mapping, optional
            Those of a row of a batch, for the fleet.
        said : str
            The result in one sentence, if another than its ``message``.
        """
        text = json.dumps(result, allow_nan=False)
        told = None if entries is None else json.dumps(entries, allow_nan=False)
        with self._writing() as connection:
            connection.execute(
                "UPDATE logs SET state = ?, ended = ?, outcome = ?, message = ?, result = ?, entries = ? WHERE id = ?",
                (state, time.time(), result["outcome"], said or result["message"], text, told, identity),
            )

    def result(self, identity: str) -> dict[str, Any] | None:
        """Return the result of a log as entries of the JSON contract, None before it is there."""
        rows = self._asked("SELECT result FROM logs WHERE id = ?", identity)
        return json.loads(rows[0][0]) if rows and rows[0][0] else None

    def delete(self, identity: str) -> bool:
        """Forget a log; return whether there was one."""
        with self._writing() as connection:
            return connection.execute("DELETE FROM logs WHERE id = ?", (identity,)).rowcount > 0

    def diagnosed(self) -> Iterator[tuple[str, str, dict[str, Any]]]:
        """Yield identity, name and entries of a row for each log that was diagnosed, the first first."""
        for identity, name, text in self._asked(
            "SELECT id, name, entries FROM logs WHERE entries IS NOT NULL ORDER BY number"
        ):
            yield identity, name, json.loads(text)

    def revision(self) -> str:
        """Return a text that changes whenever what `diagnosed` yields does."""
        query = "SELECT COUNT(*), COALESCE(MAX(ended), 0), COALESCE(SUM(number), 0) FROM logs WHERE entries IS NOT NULL"
        return "-".join(str(one) for one in self._asked(query)[0])

    def add_event(self, stream: str, event: Mapping[str, Any]) -> None:
        """Keep what a watch told; the oldest go when there are too many."""
        with self._writing() as connection:
            connection.execute(
                "INSERT INTO events (stream, received, event) VALUES (?, ?, ?)",
                (stream, time.time(), json.dumps(event, allow_nan=False)),
            )
            connection.execute(
                "DELETE FROM events WHERE number <= (SELECT MAX(number) FROM events) - ?", (MOST_EVENTS,)
            )

    def events(self, stream: str, most: int) -> list[dict[str, Any]]:
        """Return the last events of a stream, the latest last, each with ``received`` [s since 1970]."""
        rows = self._asked(
            "SELECT number, received, event FROM events WHERE stream = ? ORDER BY number DESC LIMIT ?", stream, most
        )
        return [{"number": number, "received": received, **json.loads(text)} for number, received, text in rows[::-1]]

    def _asked(self, query: str, *values: object) -> list[Any]:
        with self._lock:
            return self._connection.execute(query, values).fetchall()

    @contextmanager
    def _writing(self) -> Generator[sqlite3.Connection]:
        with self._lock:
            try:
                self._connection.execute("BEGIN IMMEDIATE")
                yield self._connection
                self._connection.execute("COMMIT")
            except sqlite3.Error as error:
                raise HydrostateError(f"the server's database cannot be written: {error}") from error
            finally:
                if self._connection.in_transaction:  # SQLite itself rolls back where the disk is full
                    self._connection.execute("ROLLBACK")
