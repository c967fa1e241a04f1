"""A server whose work runs in threads of the test: what surrounds the work is tested, not how a process ends."""

from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient

from benchmarks.server.server_trials import bench_log
from experiments.serve.app import make_app
from experiments.serve.settings import Settings


class Threads:
    """Stands in for a pool of processes."""

    def __init__(self, max_workers: int, **_: Any) -> None:
        self._pool = ThreadPoolExecutor(max_workers)

    def schedule(self, function: Callable[..., Any], args: tuple[Any, ...], timeout: float) -> "Future[Any]":
        assert timeout > 0.0
        return self._pool.submit(function, *args)

    def stop(self) -> None:
        self._pool.shutdown(cancel_futures=True)

    def join(self) -> None:
        pass


@pytest.fixture
def in_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("experiments.serve.jobs.ProcessPool", Threads)


Served = Callable[..., TestClient]


@pytest.fixture
def served(tmp_path: Path, in_threads: None) -> Iterator[Served]:  # noqa: ARG001
    """Return a function that makes a server, with its folder and other settings."""
    with ExitStack() as stack:

        def make(**settings: Any) -> TestClient:
            told = replace(Settings(folder=tmp_path / "kept"), **settings)
            client = TestClient(make_app(told), base_url="http://127.0.0.1", follow_redirects=False)
            return stack.enter_context(client)

        yield make


@pytest.fixture(scope="session")
def log(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """Return a log of four seconds, as CSV."""
    return bench_log(tmp_path_factory.mktemp("log") / "run.csv")
