"""Streams: gauges of the received rows, stored events, and the messages to a view."""

import asyncio
import errno
import json
import multiprocessing
import os
import threading
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from benchmarks.server.server_trials import send_rows
from experiments.serve import gauges as module
from experiments.serve import live
from experiments.serve.events import event_stream
from experiments.serve.gauges import Gauges
from experiments.serve.live import MOST_GAUGES, Stream, Streams
from experiments.serve.settings import Settings
from experiments.serve.store import Store


@pytest.fixture
def stream(tmp_path: Path) -> Iterator[Stream]:
    store = Store(tmp_path / "a.sqlite")
    yield Stream("bench", "tcp://127.0.0.1:1", Settings(folder=tmp_path), store)
    store.close()


def fill(store: Store) -> None:
    """Let a database accept no more data, as on a full disk."""
    store._connection.execute("PRAGMA max_page_count = 1")


def heard(stream: Stream, *messages: tuple[str, dict[str, Any]]) -> None:
    """Let a stream receive its process's messages, and then the end of the process."""
    ours, theirs = multiprocessing.Pipe(duplex=False)

    def say() -> None:
        with theirs:
            for one in messages:
                theirs.send(one)

    saying = threading.Thread(target=say)
    saying.start()
    with ours:
        stream._listen(ours)
    saying.join()


def test_gauges_contain_the_range_since_the_previous_ones_and_the_number_of_whole_rows(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, "GAUGE_INTERVAL", 0.0)
    sent: list[Any] = []
    found = Gauges(SimpleNamespace(send=sent.append))  # type: ignore[arg-type]
    found.watch = SimpleNamespace(balances=("flow",), scores=(1.0,), thresholds=(np.inf,), unlearnt=87.0)  # type: ignore[assignment]
    found.process_samples({"a": np.array([1.0, np.nan, -2.0]), "b": np.array([5.0, 5.0, 5.0])}, 0.3, False)
    found.process_samples({"a": np.array([4.0]), "b": np.array([6.0])}, 0.4, True)
    (_, first), (_, second) = sent
    assert (first["rows"], second["rows"], second["gaps"]) == (2, 3, 1)
    assert (first["low"], first["high"]) == ({"a": -2.0, "b": 5.0}, {"a": 1.0, "b": 5.0})
    assert (second["low"], second["values"]) == ({"a": 4.0, "b": 6.0}, {"a": 4.0, "b": 6.0})
    assert (first["thresholds"], first["unlearnt_s"]) == ({"flow": None}, 87.0)


def test_a_reconnected_view_gets_the_missed_messages_up_to_the_number_kept(stream: Stream) -> None:
    heard(stream, *[("gauges", {"time_s": float(k)}) for k in range(MOST_GAUGES + 5)])
    assert [one["number"] for one in stream.since(MOST_GAUGES + 3)] == [MOST_GAUGES + 4, MOST_GAUGES + 5]
    assert len(stream.since(0)) == MOST_GAUGES
    assert stream.since(MOST_GAUGES + 5) == []


def test_the_state_of_a_stream_follows_its_last_event_and_events_are_stored(stream: Stream) -> None:
    assert stream.state["state"] == "connecting"
    heard(stream, ("event", {"event": "start", "time_s": 0.0, "message": "learning"}))
    assert stream.state["state"] == "failed"  # its process ended without a final event
    for _ in range(3):
        heard(stream, ("event", {"event": "end", "time_s": None, "outcome": "failed", "message": "nobody answers"}))
    assert (stream.state["state"], stream.state["message"]) == ("failed", "nobody answers")
    heard(stream, ("event", {"event": "ready", "time_s": 1.0, "message": "alarms can come"}))
    assert [one["event"] for one in stream.events()] == ["start", "end", "ready"]


def test_an_alarm_that_cannot_be_stored_is_still_reported_and_the_watch_goes_on(
    stream: Stream, capsys: pytest.CaptureFixture[str]
) -> None:
    """Before, the listening thread ended when the disk was full, and the stream stayed "watching" for ever."""
    fill(stream._store)
    heard(stream, ("event", {"event": "alarm", "message": "x" * 100_000}), ("gauges", {"time_s": 2.0}))
    assert (stream.alarms, stream.revision[0]) == (1, 1)
    assert "alarm is told, but not kept" in capsys.readouterr().err


def test_a_stream_without_a_process_fails_with_the_reason_and_is_retried(
    stream: Stream, monkeypatch: pytest.MonkeyPatch
) -> None:
    tried: list[str] = []

    def pipe(duplex: bool) -> Any:
        tried.append(stream.state["message"])
        if len(tried) == 2:
            stream._closed.set()
        raise OSError(errno.EMFILE, "Too many open files", str(duplex))

    monkeypatch.setattr(live, "multiprocessing", SimpleNamespace(get_context=lambda _: SimpleNamespace(Pipe=pipe)))
    monkeypatch.setattr(live, "RETRY_DELAY", 0.01)
    stream.start()
    stream._thread.join(10.0)
    assert tried == ["", "it cannot be watched: Too many open files"]
    assert stream.state["state"] == "failed"


def test_a_stream_without_its_rig_file_fails_with_the_reason_and_is_retried(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "press.toml").write_text("")
    store = Store(tmp_path / "a.sqlite")
    one = Stream("bench", "tcp://127.0.0.1:1", Settings(folder=tmp_path, rigs=tmp_path), store)
    failed = threading.Event()
    monkeypatch.setattr(live, "RETRY_DELAY", 0.01)
    monkeypatch.setattr(
        one, "_fail", lambda said: failed.set() if "no rig file: the actuator is 'bench'" in said else 0
    )
    one.start()
    assert failed.wait(10.0)
    failed.clear()
    assert failed.wait(10.0)
    one._closed.set()
    one._thread.join(10.0)
    store.close()


def test_a_view_gets_the_history_and_then_new_messages(stream: Stream, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("experiments.serve.events.GAUGE_INTERVAL", 0.0)
    heard(stream, ("gauges", {"time_s": 1.0}))
    streams = SimpleNamespace(looking=0)
    looks = iter([False, False, True])

    async def gone() -> bool:
        return next(looks)

    async def looked() -> list[tuple[str, Any]]:
        found: list[tuple[str, Any]] = []
        async for text in event_stream(stream, streams, gone):  # type: ignore[arg-type]
            assert streams.looking == 1
            head, data = text.decode().removeprefix("event: ").rstrip("\n").split("\ndata: ")
            found.append((head, json.loads(data)))
            if len(found) == 1:
                heard(stream, ("gauges", {"time_s": 2.0}), ("event", {"event": "alarm", "time_s": 2.0}))
        return found

    found = asyncio.run(looked())
    assert [head for head, _ in found] == ["history", "state", "gauges"]
    assert [one["time_s"] for one in found[0][1]["history"]] == [1.0]
    assert found[2][1]["time_s"] == 2.0
    assert streams.looking == 0


def test_a_stream_that_ended_is_watched_again_and_its_hung_process_is_killed(
    stream: Stream, monkeypatch: pytest.MonkeyPatch
) -> None:
    happened: list[str] = []

    class Hangs:
        """A process that sends one message and does not end."""

        def __init__(self, target: Any, args: tuple[Any, ...], daemon: bool) -> None:
            assert daemon
            assert args[2].address == stream.address
            self._out, self.alive = args[0], True
            del target

        def start(self) -> None:
            happened.append("started")
            self._out.send(("gauges", {"time_s": 1.0}))

        def join(self, _: float) -> None: ...

        def is_alive(self) -> bool:
            return self.alive

        def terminate(self) -> None:
            self.kill()

        def kill(self) -> None:
            happened.append("killed")
            self.alive = False
            if happened.count("killed") == 2:
                stream._closed.set()

    context = SimpleNamespace(Pipe=multiprocessing.Pipe, Process=Hangs)
    monkeypatch.setattr(live, "multiprocessing", SimpleNamespace(get_context=lambda _: context))
    monkeypatch.setattr(live, "RETRY_DELAY", 0.05)
    stream.start()
    assert stream._closed.wait(10.0)
    stream.close()
    assert happened == ["started", "killed"] * 2
    assert [one["number"] for one in stream.since(0)] == [1, 2]


def test_a_quiet_stream_sends_keep_alive_comments(stream: Stream, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("experiments.serve.events.GAUGE_INTERVAL", 0.0)
    monkeypatch.setattr("experiments.serve.events.KEEP_ALIVE_INTERVAL", -1.0)
    looks = iter([False, False, True])

    async def gone() -> bool:
        return next(looks)

    async def looked() -> list[bytes]:
        return [text async for text in event_stream(stream, SimpleNamespace(looking=0), gone)]  # type: ignore[arg-type]

    history, *rest = asyncio.run(looked())
    assert history.startswith(b"event: history")
    assert rest == [b": still here\n\n"] * 2


def test_closing_the_server_ends_the_process_of_every_stream_and_starts_no_new_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    happened: list[str] = []
    begun = threading.Semaphore(0)

    class Watches:
        """A process that runs until it is terminated."""

        def __init__(self, target: Any, args: tuple[Any, ...], daemon: bool) -> None:
            del target, daemon
            self._out, self._name, self._ended = args[0], args[2].address, threading.Event()

        def start(self) -> None:
            self._kept = self._out  # the process's end of the pipe, which only the process keeps open
            self._theirs = os.dup(self._out.fileno())
            begun.release()

        def join(self, _: float) -> None:
            self._ended.wait(10.0)

        def is_alive(self) -> bool:
            return not self._ended.is_set()

        def terminate(self) -> None:
            happened.append(f"ended {self._name}")
            self._ended.set()
            os.close(self._theirs)

        def kill(self) -> None:
            happened.append("killed")

    context = SimpleNamespace(Pipe=multiprocessing.Pipe, Process=Watches)
    monkeypatch.setattr(live, "multiprocessing", SimpleNamespace(get_context=lambda _: context))
    monkeypatch.setattr(live, "RETRY_DELAY", 10.0)
    store = Store(tmp_path / "a.sqlite")
    streams = Streams(Settings(folder=tmp_path, streams={"bench": "tcp://a:1", "press": "tcp://b:2"}), store)
    streams.start()
    assert all(begun.acquire(timeout=10.0) for _ in streams.by_name)
    streams.close()
    assert sorted(happened) == ["ended tcp://a:1", "ended tcp://b:2"]
    assert not any(one._thread.is_alive() for one in streams.by_name.values())
    store.close()


@pytest.mark.slow
def test_a_stream_is_watched_in_a_process_up_to_its_end(tmp_path: Path) -> None:
    store = Store(tmp_path / "a.sqlite")
    with send_rows(3.0, 1000.0) as (address, sent):
        streams = Streams(Settings(folder=tmp_path, streams={"bench": address}), store)
        streams.start()
        (one,) = streams.by_name.values()
        try:
            while not sent.ended or one.state["state"] not in ("ended", "failed"):
                asyncio.run(asyncio.sleep(0.05))
        finally:
            streams.close()
    assert one.state["gauges"]["rows"] == sent.rows == 3000
    assert [event["event"] for event in store.events("bench", 10)] == ["start", "end"]
    store.close()
