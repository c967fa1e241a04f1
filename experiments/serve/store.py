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

from experiments.running.refusal import os_errors_as
from plant.errors import HydrostateError

VERSION = 1
"""Version of the tables; a folder written by a later version is refused."""

MOST_EVENTS = 10_000
"""Largest number of stream events that are stored [count]."""

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
"""States of a log: not yet processed, processed, unusable, and given up because the server ended while processing
it."""


@dataclass(frozen=True)
class StoredLog:
    """A log in the store, with its state.

    Parameters
    ----------
    number : int
        Later logs have larger numbers.
    id : str
        Identity in requests.
    name : str
        File name given by the client.
    verb : str
        Verb that is run on it.
    size : int
        Size of the file [bytes].
    state : str
        ``unfinished``, ``done``, ``failed`` or ``interrupted``.
    tries : int
        How often a server started work on it and then ended.
    received, ended : float, float or None
        When it was received and when the work ended, since 1970 [s].
    outcome, message : str or None
        The outcome, and the result in a sentence.
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
        If the file is not such a database, or has a later version; afterwards, whenever it cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self._lock = threading.Lock()
        with os_errors_as(f"{path}: the server's database cannot be opened"):
            # only the server's own user may read results; SQLite gives its other files the same mode
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
        """Close the database file."""
        with self._lock:
            self._connection.close()

    def add(self, identity: str, name: str, verb: str, size: int) -> StoredLog:
        """Store a received log, to be processed.

        Parameters
        ----------
        size : int
            Size of its file [bytes].
        """
        with self._transaction() as connection:
            connection.execute(
                "INSERT INTO logs (id, name, verb, size, state, received) VALUES (?, ?, ?, ?, ?, ?)",
                (identity, name, verb, size, UNFINISHED, time.time()),
            )
        found = self.get(identity)
        if found is None:
            raise HydrostateError(f"{name}: was deleted during the upload")
        return found

    def get(self, identity: str) -> StoredLog | None:
        """Return a stored log; None if there is none with that identity."""
        rows = self._query("SELECT * FROM kept WHERE id = ?", identity)
        return StoredLog(*rows[0]) if rows else None

    def latest(self, most: int, before: int | None = None) -> list[StoredLog]:
        """Return logs, the latest first.

        Parameters
        ----------
        before : int, optional
            Return only logs with a smaller number.
        """
        below = before if before is not None else 1 << 62
        rows = self._query("SELECT * FROM kept WHERE number < ? ORDER BY number DESC LIMIT ?", below, most)
        return [StoredLog(*row) for row in rows]

    def unfinished(self) -> list[StoredLog]:
        """Return the logs still to be processed, the oldest first."""
        rows = self._query("SELECT * FROM kept WHERE state = ? ORDER BY number", UNFINISHED)
        return [StoredLog(*row) for row in rows]

    def counts(self) -> dict[str, int]:
        """Return the number of logs in each state."""
        return {str(state): int(count) for state, count in self._query("SELECT state, COUNT(*) FROM logs GROUP BY 1")}

    def count_try(self, identity: str) -> None:
        """Count that a server ended while processing a log."""
        with self._transaction() as connection:
            connection.execute("UPDATE logs SET tries = tries + 1 WHERE id = ?", (identity,))

    def finish(
        self,
        identity: str,
        state: str,
        result: Mapping[str, Any],
        entries: Mapping[str, Any] | None = None,
        said: str = "",
    ) -> None:
        """Store the result of a log; a log that was deleted meanwhile stays deleted.

        Parameters
        ----------
        state : str
            ``done``, ``failed`` or ``interrupted``.
        result : Mapping
            Entries of the JSON contract, including ``outcome`` and ``message``.
        entries : Mapping, optional
            Entries of a batch row, for the fleet.
        said : str
            The result in one sentence, if it differs from its ``message``.
        """
        text = json.dumps(result, allow_nan=False)
        told = None if entries is None else json.dumps(entries, allow_nan=False)
        with self._transaction() as connection:
            connection.execute(
                "UPDATE logs SET state = ?, ended = ?, outcome = ?, message = ?, result = ?, entries = ? WHERE id = ?",
                (state, time.time(), result["outcome"], said or result["message"], text, told, identity),
            )

    def reopen(self, identity: str) -> bool:
        """Forget what came of a log, so that it is processed again; return whether it was finished."""
        with self._transaction() as connection:
            return (
                connection.execute(
                    "UPDATE logs SET state = :new, tries = 0, ended = NULL, outcome = NULL, message = NULL, "
                    "result = NULL, entries = NULL WHERE id = :id AND state != :new",
                    {"new": UNFINISHED, "id": identity},
                ).rowcount
                > 0
            )

    def result(self, identity: str) -> dict[str, Any] | None:
        """Return the result of a log as entries of the JSON contract; None if it is not ready."""
        rows = self._query("SELECT result FROM logs WHERE id = ?", identity)
        return json.loads(rows[0][0]) if rows and rows[0][0] else None

    def delete(self, identity: str) -> bool:
        """Delete a log from the store; return whether it existed."""
        with self._transaction() as connection:
            return connection.execute("DELETE FROM logs WHERE id = ?", (identity,)).rowcount > 0

    def diagnosed(self) -> Iterator[tuple[str, str, dict[str, Any]]]:
        """Yield identity, name and batch row entries of each diagnosed log, the oldest first."""
        for identity, name, text in self._query(
            "SELECT id, name, entries FROM logs WHERE entries IS NOT NULL ORDER BY number"
        ):
            yield identity, name, json.loads(text)

    def revision(self) -> str:
        """Return a text that changes whenever the output of `diagnosed` changes."""
        query = "SELECT COUNT(*), COALESCE(MAX(ended), 0), COALESCE(SUM(number), 0) FROM logs WHERE entries IS NOT NULL"
        return "-".join(str(one) for one in self._query(query)[0])

    def add_event(self, stream: str, event: Mapping[str, Any]) -> None:
        """Store an event of a watch; the oldest are deleted if there are too many."""
        with self._transaction() as connection:
            connection.execute(
                "INSERT INTO events (stream, received, event) VALUES (?, ?, ?)",
                (stream, time.time(), json.dumps(event, allow_nan=False)),
            )
            connection.execute(
                "DELETE FROM events WHERE number <= (SELECT MAX(number) FROM events) - ?", (MOST_EVENTS,)
            )

    def events(self, stream: str, most: int) -> list[dict[str, Any]]:
        """Return the last events of a stream, the latest last, each with ``received`` [s since 1970]."""
        rows = self._query(
            "SELECT number, received, event FROM events WHERE stream = ? ORDER BY number DESC LIMIT ?", stream, most
        )
        return [{"number": number, "received": received, **json.loads(text)} for number, received, text in rows[::-1]]

    def _query(self, query: str, *values: object) -> list[Any]:
        with self._lock:
            return self._connection.execute(query, values).fetchall()

    @contextmanager
    def _transaction(self) -> Generator[sqlite3.Connection]:
        with self._lock:
            try:
                self._connection.execute("BEGIN IMMEDIATE")
                yield self._connection
                self._connection.execute("COMMIT")
            except sqlite3.Error as error:
                raise HydrostateError(f"the server's database cannot be written: {error}") from error
            finally:
                if self._connection.in_transaction:  # if the disk is full, SQLite itself rolls back
                    self._connection.execute("ROLLBACK")
