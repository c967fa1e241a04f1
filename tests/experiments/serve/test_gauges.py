"""The process of a stream: its gauges of the received rows, and its end."""

import signal
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from experiments.serve import gauges
from experiments.serve.gauges import GAUGE_INTERVAL, Gauges, StreamTask, watch_stream
from faults.watch.events import Alarm

HEADER = "time_s,motor_speed_rad_s,velocity_m_s\n"


class Clock:
    """A monotonic clock that stands at a set time [s]."""

    now = 100.0

    def monotonic(self) -> float:
        return self.now


@pytest.fixture
def sent() -> list[Any]:
    return []


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    one = Clock()
    monkeypatch.setattr(gauges, "time", one)
    return one


def watching(sent: list[Any]) -> Gauges:
    found = Gauges(SimpleNamespace(send=sent.append))  # type: ignore[arg-type]
    found.watch = SimpleNamespace(balances=("flow",), scores=(1.0,), thresholds=(4.0,), unlearnt=0.0, last=7.0)  # type: ignore[assignment]
    return found


def test_gauges_are_sent_at_most_once_per_interval_and_keep_the_extremes(sent: list[Any], clock: Clock) -> None:
    found = watching(sent)
    found.process_samples({"a": np.array([1.0])}, 0.1, False)
    for seconds, value in ((0.2, 9.0), (0.6, -9.0), (1.01, 0.0)):
        clock.now = 100.0 + seconds * GAUGE_INTERVAL
        found.process_samples({"a": np.array([value])}, 0.2, False)
    assert [entries["rows"] for _, entries in sent] == [1, 4]
    last = sent[-1][1]
    assert (last["low"], last["high"], last["values"]) == ({"a": -9.0}, {"a": 9.0}, {"a": 0.0})


def test_the_score_of_an_alarm_is_sent_even_if_its_balance_is_reset(sent: list[Any], clock: Clock) -> None:
    found = watching(sent)
    found.events([Alarm(6.9, "flow", 6.5, (6.4, 6.6), 4.3, 4.0)])
    found.process_samples({"a": np.array([1.0])}, 7.0, False)
    clock.now += GAUGE_INTERVAL
    found.process_samples({"a": np.array([1.0])}, 7.3, False)
    assert [told["scores"] for kind, told in sent if kind == "gauges"] == [{"flow": 4.3}, {"flow": 1.0}]


def test_a_channel_without_values_has_no_range_and_its_rows_are_not_counted(sent: list[Any], clock: Clock) -> None:
    del clock
    watching(sent).process_samples({"a": np.array([np.nan, np.nan]), "b": np.array([1.0, 2.0])}, 0.1, False)
    ((_, told),) = sent
    assert (told["low"], told["high"], told["rows"]) == ({"b": 1.0}, {"b": 2.0}, 0)
    assert told["values"] == {"a": None, "b": 2.0}


def test_no_gauges_are_sent_before_the_watch_begins(sent: list[Any], clock: Clock) -> None:
    del clock
    Gauges(SimpleNamespace(send=sent.append)).process_samples({"a": np.array([1.0])}, 0.1, False)  # type: ignore[arg-type]
    assert sent == []


class Pipe:
    """The end of a pipe to a server that may have ended."""

    def __init__(self, gone: bool = False) -> None:
        self.sent: list[Any] = []
        self.gone, self.closed = gone, False

    def send(self, one: Any) -> None:
        if self.gone:
            raise BrokenPipeError
        self.sent.append(one)

    def close(self) -> None:
        self.closed = True


@pytest.fixture
def bound(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Return the servers to which the process binds itself; signal handlers are not changed."""
    servers: list[int] = []
    monkeypatch.setattr(gauges, "bind_to_server", servers.append)
    monkeypatch.setattr(gauges, "signal", SimpleNamespace(signal=lambda *_: None, SIGINT=signal.SIGINT, SIG_IGN=None))
    return servers


def run(pipe: Pipe, state: Path, server: int = 41) -> None:
    watch_stream(pipe, server, StreamTask("tcp://nowhere:1", None, (), 0.1, state))  # type: ignore[arg-type]


def rows(*_: object) -> list[str]:
    """Return three seconds of rows, then only garbage."""
    return [HEADER, *(f"{0.01 * k:.2f},20,0.01\n" for k in range(300)), *["x,x,0\n"] * 60]


def test_a_failed_stream_sends_its_last_gauges_before_its_end_event(
    bound: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("experiments.streams.watching.stream_lines", rows)
    pipe = Pipe()
    run(pipe, tmp_path / "state.npz")
    *_, (kind, last), (_, end) = pipe.sent
    assert (kind, last["rows"]) == ("gauges", 300)
    assert (end["event"], end["outcome"]) == ("end", "failed")
    assert "must hold numbers" in end["message"]
    assert pipe.closed
    assert bound == [41]
    assert (tmp_path / "state.npz").exists()


def test_a_closed_pipe_to_the_server_raises_no_error(
    bound: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    del bound
    monkeypatch.setattr("experiments.streams.watching.stream_lines", rows)
    pipe = Pipe(gone=True)
    run(pipe, tmp_path / "state.npz")
    assert pipe.closed
