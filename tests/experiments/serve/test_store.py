"""The store of a server: its content survives a restart, and no other file is taken for a store."""

import os
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from pathlib import Path

import pytest

from experiments.serve import store as module
from experiments.serve.store import DONE, FAILED, Store
from plant.errors import HydrostateError

RESULT = {"outcome": "ok", "message": "normal", "value": 1.5}

Opened = Callable[[str], Store]


@pytest.fixture
def opened(tmp_path: Path) -> Iterator[Opened]:
    """Return a function that opens a store by its name; it is closed after the test."""
    with ExitStack() as stack:
        yield lambda name: stack.enter_context(closing(Store(tmp_path / name)))


def test_finished_results_are_read_by_a_second_connection(opened: Opened) -> None:
    first = opened("a.sqlite")
    first.add("a", "run.csv", "diagnose", 10)
    first.add("b", "rest.csv", "diagnose", 10)
    first.finish("a", DONE, RESULT, {"outcome": "ok"})
    second = opened("a.sqlite")
    assert second.result("a") == RESULT
    assert [one.id for one in second.unfinished()] == ["b"]
    assert second.counts() == {"done": 1, "unfinished": 1}
    assert list(second.diagnosed()) == [("a", "run.csv", {"outcome": "ok"})]


def test_a_deleted_log_stays_deleted_if_its_processing_ends(opened: Opened) -> None:
    store = opened("a.sqlite")
    store.add("a", "run.csv", "diagnose", 10)
    assert store.delete("a")
    store.finish("a", FAILED, RESULT)
    assert store.get("a") is None
    assert store.result("a") is None
    assert not store.delete("a")


def test_the_revision_changes_with_each_finished_or_deleted_log(opened: Opened) -> None:
    store = opened("a.sqlite")
    seen = [store.revision()]
    for identity in ("a", "b"):
        store.add(identity, "run.csv", "diagnose", 10)
        assert store.revision() == seen[-1]
        store.finish(identity, DONE, RESULT, {"outcome": "ok"})
        seen.append(store.revision())
    store.delete("a")
    seen.append(store.revision())
    assert len(set(seen)) == 4


def test_events_are_stored_by_stream_and_the_oldest_are_removed(
    opened: Opened, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "MOST_EVENTS", 3)
    store = opened("a.sqlite")
    for number in range(5):
        store.add_event("press" if number % 2 else "lift", {"event": "alarm", "time_s": float(number)})
    assert [one["time_s"] for one in store.events("lift", 10)] == [2.0, 4.0]
    assert [one["time_s"] for one in store.events("press", 10)] == [3.0]


def test_a_result_that_is_not_valid_json_leaves_its_log_unfinished(opened: Opened) -> None:
    store = opened("a.sqlite")
    store.add("a", "run.csv", "diagnose", 10)
    with pytest.raises(ValueError, match="JSON"):
        store.finish("a", DONE, {**RESULT, "value": float("nan")})
    assert [one.id for one in store.unfinished()] == ["a"]


def test_a_file_that_is_not_a_database_of_this_version_is_refused(tmp_path: Path) -> None:
    (tmp_path / "words.sqlite").write_text("no database, but words enough to be taken for a header of one" * 10)
    with pytest.raises(HydrostateError, match=r"words\.sqlite: must be a database of this server"):
        Store(tmp_path / "words.sqlite")
    with sqlite3.connect(tmp_path / "later.sqlite") as connection:
        connection.execute("PRAGMA user_version = 99")
    connection.close()
    with pytest.raises(HydrostateError, match="a later Hydrostate wrote version 99"):
        Store(tmp_path / "later.sqlite")


def test_a_log_deleted_while_it_is_added_is_refused(tmp_path: Path, opened: Opened) -> None:
    store = opened("a.sqlite")
    with sqlite3.connect(tmp_path / "a.sqlite") as connection:
        connection.execute("CREATE TRIGGER gone AFTER INSERT ON logs BEGIN DELETE FROM logs WHERE id = new.id; END")
    connection.close()
    with pytest.raises(HydrostateError, match=r"run\.csv: was deleted during the upload"):
        store.add("a", "run.csv", "diagnose", 10)


def test_a_full_disk_is_reported_and_the_store_works_again_afterwards(opened: Opened) -> None:
    store = opened("a.sqlite")
    store.add("a", "run.csv", "diagnose", 10)
    store._connection.execute("PRAGMA max_page_count = 1")
    with pytest.raises(HydrostateError, match="cannot be written: database or disk is full"):
        store.finish("a", DONE, {**RESULT, "message": "x" * 100_000})
    store._connection.execute("PRAGMA max_page_count = 100000")
    store.finish("a", DONE, RESULT)
    assert store.result("a") == RESULT


@pytest.mark.skipif(os.name == "nt", reason="modes are another system's")
def test_database_files_are_readable_by_their_owner_only(tmp_path: Path, opened: Opened) -> None:
    opened("a.sqlite").add("a", "run.csv", "diagnose", 10)
    kept = sorted(tmp_path.iterdir())
    assert [one.name for one in kept] == ["a.sqlite", "a.sqlite-shm", "a.sqlite-wal"]
    assert [one.stat().st_mode & 0o077 for one in kept] == [0, 0, 0]
