"""The queue: unfinished work of a server that ended is resumed, and lost work is reported."""

import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from pebble import ProcessExpired

from experiments.serve.jobs import KEEPING, MOST_TRIES, MOST_VIEWS, BusyError, Jobs, log_file, page_file, phase_file
from experiments.serve.service import Service
from experiments.serve.settings import MB, Settings
from experiments.serve.store import Store, StoredLog
from experiments.serve.work import NO_MEMORY, LogResult, tell_phase
from plant.errors import HydrostateError


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    made = Settings(folder=tmp_path)
    for folder in (made.logs, made.pages, made.work):
        folder.mkdir()
    return made


@pytest.fixture
def store(settings: Settings) -> Iterator[Store]:
    opened = Store(settings.database)
    yield opened
    opened.close()


class Ending:
    """A pool in which each job ends as the test sets it."""

    ends: Callable[["Future[Any]"], None]

    def __init__(self, **_: Any) -> None:
        self.asked = 0

    def schedule(self, *_: Any, **__: Any) -> "Future[Any]":
        future: Future[Any] = Future()
        type(self).ends(future)
        return future

    def stop(self) -> None: ...

    def join(self) -> None: ...


def added(store: Store, settings: Settings, identity: str) -> StoredLog:
    log_file(settings, identity).write_bytes(b"a,b\n1,2\n2,3\n")
    return store.add(identity, f"{identity}.csv", "inspect", 12)


def until(asked: Callable[[], bool], seconds: float = 30.0) -> None:
    due = time.monotonic() + seconds
    while not asked():
        assert time.monotonic() < due
        time.sleep(0.01)


def test_unfinished_logs_are_resumed_in_order_except_those_that_ended_the_server(
    settings: Settings, store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    taken: list[str] = []
    monkeypatch.setattr(Ending, "ends", staticmethod(lambda _: None), raising=False)
    monkeypatch.setattr("experiments.serve.jobs.ProcessPool", Ending)
    for identity in ("first", "deadly", "second", "gone"):
        added(store, settings, identity)
    log_file(settings, "gone").unlink()
    (settings.work / "half.part").write_bytes(b"x")
    submit = Jobs.submit
    monkeypatch.setattr(Jobs, "submit", lambda self, log: (taken.append(log.id), submit(self, log))[1])
    for _ in range(MOST_TRIES):
        phase_file(settings, "deadly").write_text("working")
        Jobs(settings, store).resume()
    assert taken[:3] == ["first", "deadly", "second"]
    assert taken[-2:] == ["first", "second"]
    deadly, gone = store.get("deadly"), store.get("gone")
    assert deadly is not None
    assert gone is not None
    assert (deadly.state, gone.state) == ("interrupted", "interrupted")
    assert f"ended {MOST_TRIES} times" in str(deadly.message)
    assert "no longer in the server's folder" in str(gone.message)
    assert not list(settings.work.glob("*.part"))


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (TimeoutError(), "took longer than 300 s"),
        (ProcessExpired("gone", code=-9), "code -9"),
        (ProcessExpired("gone", code=NO_MEMORY), "needs more memory than the 3072 MB"),
        (ValueError("odd"), "please report it"),
    ],
)
def test_a_log_whose_process_fails_gets_the_reason(
    settings: Settings, store: Store, monkeypatch: pytest.MonkeyPatch, error: Exception, words: str
) -> None:
    monkeypatch.setattr(Ending, "ends", staticmethod(lambda future: future.set_exception(error)), raising=False)
    monkeypatch.setattr("experiments.serve.jobs.ProcessPool", Ending)
    jobs = Jobs(settings, store)
    jobs.submit(added(store, settings, "a"))
    found = store.get("a")
    assert found is not None
    assert (found.state, jobs.waiting) == ("failed", 0)
    assert words in str(found.message)


def test_a_result_that_cannot_be_stored_is_stored_as_soon_as_there_is_room(
    settings: Settings, store: Store, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    worked = LogResult({"outcome": "ok", "message": "x" * 100_000}, None)
    monkeypatch.setattr(Ending, "ends", staticmethod(lambda future: future.set_result(worked)), raising=False)
    monkeypatch.setattr("experiments.serve.jobs.ProcessPool", Ending)
    monkeypatch.setattr("experiments.serve.jobs.KEEP_DELAY", 0.01)
    jobs, logs = Jobs(settings, store), [added(store, settings, identity) for identity in ("a", "b", "c")]
    store._connection.execute("PRAGMA max_page_count = 1")
    for log in logs:
        jobs.submit(log)
    assert "the result of a.csv cannot be stored yet" in capsys.readouterr().err
    assert [one.id for one in store.unfinished()] == ["a", "b", "c"]
    assert (jobs.waiting, jobs.phase("a")) == (3, KEEPING)
    assert not phase_file(settings, "a").exists()  # a server that ends now did not end because of this log
    store.delete("b")
    jobs.cancel("b")
    log_file(settings, "b").unlink(missing_ok=True)  # as the service does
    assert jobs.phase("b") is None
    store._connection.execute("PRAGMA max_page_count = 100000")
    until(lambda: jobs.waiting == 0)
    assert store.unfinished() == []
    assert jobs.phase("a") is None
    assert (store.result("a"), store.result("c")) == (worked.result, worked.result)
    assert files_of(settings, "b") == []
    jobs.close()


def test_a_result_that_is_no_json_fails_its_log(
    settings: Settings, store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    worked = LogResult({"outcome": "ok", "message": "", "value": float("inf")}, None)
    monkeypatch.setattr(Ending, "ends", staticmethod(lambda future: future.set_result(worked)), raising=False)
    monkeypatch.setattr("experiments.serve.jobs.ProcessPool", Ending)
    jobs = Jobs(settings, store)
    jobs.submit(added(store, settings, "a"))
    found = store.get("a")
    assert found is not None
    assert (found.state, jobs.waiting) == ("failed", 0)
    assert "please report it" in str(found.message)


def test_a_process_that_outlives_its_deleted_log_leaves_no_file(
    settings: Settings, store: Store, pending: list["Future[Any]"]
) -> None:
    jobs = Jobs(settings, store)
    jobs.submit(added(store, settings, "a"))
    tell_phase(phase_file(settings, "a"), "reading the log")
    tell_phase(phase_file(settings, "a"), "working")
    assert jobs.phase("a") == "working"
    jobs.cancel("a")
    assert pending[0].cancelled()
    tell_phase(phase_file(settings, "a"), "writing the page")  # its process ends a moment later than its log
    assert files_of(settings, "a") == []


@pytest.fixture
def pending(monkeypatch: pytest.MonkeyPatch) -> list["Future[Any]"]:
    """Return the futures of a pool whose jobs are still running."""
    futures: list[Future[Any]] = []
    monkeypatch.setattr(Ending, "ends", staticmethod(futures.append), raising=False)
    monkeypatch.setattr("experiments.serve.jobs.ProcessPool", Ending)
    return futures


def worked(outcome: str = "ok") -> LogResult:
    return LogResult({"file": "a.csv", "outcome": outcome, "message": "said"}, None)


def files_of(settings: Settings, identity: str) -> list[Path]:
    return [
        path for path in (place(settings, identity) for place in (log_file, page_file, phase_file)) if path.exists()
    ]


@pytest.mark.parametrize(("outcome", "state"), [("ok", "done"), ("mismatch", "done"), ("failed", "failed")])
def test_a_finished_log_keeps_its_page_and_leaves_the_queue(
    settings: Settings, store: Store, pending: list["Future[Any]"], outcome: str, state: str
) -> None:
    jobs = Jobs(settings, store)
    jobs.submit(added(store, settings, "a"))
    assert (jobs.waiting, jobs.phase("a")) == (1, None)
    phase_file(settings, "a").write_text("reading the log")
    page_file(settings, "a").write_text("a page")
    assert jobs.phase("a") == "reading the log"
    pending[0].set_result(worked(outcome))
    found = store.get("a")
    assert found is not None
    assert (found.state, found.outcome, jobs.waiting, jobs.phase("a")) == (state, outcome, 0, None)
    assert files_of(settings, "a") == [log_file(settings, "a"), page_file(settings, "a")]


def test_a_cancelled_log_leaves_no_file_even_if_its_page_is_written_later(
    settings: Settings, store: Store, pending: list["Future[Any]"]
) -> None:
    jobs = Jobs(settings, store)
    for identity in ("a", "b"):
        jobs.submit(added(store, settings, identity))
    pending[0].set_running_or_notify_cancel()
    jobs.cancel("a")  # too late to leave the queue: a process is already working on it
    page_file(settings, "a").write_text("half")
    pending[0].set_result(worked())
    jobs.cancel("b")  # still in the queue
    jobs.cancel("b")
    assert files_of(settings, "a") == files_of(settings, "b") == []
    assert jobs.waiting == 0
    unfinished = [one.id for one in store.unfinished()]
    assert unfinished == ["a", "b"]  # the caller of `cancel` deletes the log in the store


def test_a_log_deleted_during_its_processing_leaves_no_page(
    settings: Settings, store: Store, pending: list["Future[Any]"]
) -> None:
    jobs = Jobs(settings, store)
    jobs.submit(added(store, settings, "a"))
    page_file(settings, "a").write_text("a page")
    store.delete("a")
    pending[0].set_result(worked())
    assert files_of(settings, "a") == []
    assert (store.get("a"), jobs.waiting) == (None, 0)


def test_a_log_in_progress_stays_unfinished_if_the_server_closes(
    settings: Settings, store: Store, pending: list["Future[Any]"]
) -> None:
    jobs = Jobs(settings, store)
    jobs.submit(added(store, settings, "a"))
    jobs.close()
    pending[0].set_exception(ProcessExpired("the pool was stopped", code=-15))
    assert [one.id for one in store.unfinished()] == ["a"]
    assert files_of(settings, "a") == [log_file(settings, "a"), phase_file(settings, "a")]
    assert jobs.phase("a") is None  # its work had not begun, so the next server does not count this as a try


def test_a_cancelled_diagnosis_has_a_failed_row_in_the_fleet_and_an_estimate_has_none(
    settings: Settings, store: Store, pending: list["Future[Any]"]
) -> None:
    jobs = Jobs(settings, store)
    for identity, verb in (("a", "diagnose"), ("b", "estimate")):
        log_file(settings, identity).write_bytes(b"")
        jobs.submit(store.add(identity, f"{identity}.csv", verb, 0))
        pending[-1].cancel()
    ((identity, name, entries),) = store.diagnosed()
    assert (identity, name) == ("a", "a.csv")
    assert entries == {"outcome": "failed", "reason": "it was cancelled"}
    said = [one.message for one in store.latest(2)]
    assert said == ["it was cancelled"] * 2


def test_the_number_of_fleet_pages_in_progress_is_limited(
    settings: Settings, store: Store, pending: list["Future[Any]"]
) -> None:
    jobs = Jobs(settings, store)
    for _ in range(MOST_VIEWS):
        jobs.view(len, "page")
    with pytest.raises(BusyError):
        jobs.view(len, "page")
    assert len(pending) == MOST_VIEWS
    pending[3].set_result(4)
    pending[5].set_exception(TimeoutError())
    for _ in range(2):
        jobs.view(len, "page")
    with pytest.raises(BusyError):
        jobs.view(len, "page")


def test_resuming_removes_partial_uploads_and_keeps_other_files(
    settings: Settings, store: Store, pending: list["Future[Any]"]
) -> None:
    (settings.work / "half.part").write_bytes(b"x")
    (settings.work / "other").write_bytes(b"x")
    Jobs(settings, store).resume()
    assert [path.name for path in settings.work.iterdir()] == ["other"]
    assert pending == []


def test_a_second_server_on_a_folder_is_refused_and_stray_pages_are_removed(
    tmp_path: Path,
    in_threads: None,  # noqa: ARG001
) -> None:
    settings = Settings(folder=tmp_path / "kept")
    service = Service(settings)
    service.open()
    try:
        with pytest.raises(HydrostateError, match="another server works in it"):
            Service(settings).open()
        page_file(settings, "0123456789abcdef").write_text("left")
    finally:
        service.close()
    again = Service(settings)
    again.open()
    again.close()
    assert not list(settings.pages.iterdir())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("limits", "words"),
    [({"seconds": 1.0}, "took longer than 1 s"), ({"memory": 500 * MB}, "memory")],
)
def test_a_log_beyond_its_limits_fails_and_the_next_one_is_processed(
    settings: Settings, store: Store, log: bytes, limits: dict[str, Any], words: str
) -> None:
    jobs = Jobs(replace(settings, **limits), store)
    try:
        kept = added(store, settings, "greedy")
        log_file(settings, "greedy").write_bytes(b"a,b\n" + b"1.5,2.5\n" * 20_000_000)
        jobs.submit(kept)
        until(lambda: not jobs.waiting)
        greedy = store.get("greedy")
        assert greedy is not None
        assert greedy.state == "failed"
        assert words in str(greedy.message)
        if "seconds" in limits:
            return
        kept = added(store, settings, "fine")
        log_file(settings, "fine").write_bytes(log)
        jobs.submit(kept)
        until(lambda: not jobs.waiting)
        fine = store.get("fine")
        assert fine is not None
        assert fine.state == "done", fine.message
        assert page_file(settings, "fine").read_text("utf-8").startswith("<!DOCTYPE html>")
    finally:
        jobs.close()
