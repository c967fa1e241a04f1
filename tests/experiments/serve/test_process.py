"""A process that a server starts ends with the server."""

from types import SimpleNamespace
from typing import Any

import pytest

from experiments.serve import process


def test_a_process_uses_one_thread_by_default_and_ends_with_its_server(monkeypatch: pytest.MonkeyPatch) -> None:
    begun, slept, ended = list[Any](), list[float](), list[int]()
    parents, environment = iter([41, 41, 1]), {"OMP_NUM_THREADS": "2"}

    def thread(**asked: Any) -> Any:
        return SimpleNamespace(start=lambda: begun.append(asked))

    system = {"environ": environment, "getppid": lambda: next(parents), "_exit": ended.append}
    monkeypatch.setattr(process, "os", SimpleNamespace(**system))
    monkeypatch.setattr(process, "threading", SimpleNamespace(Thread=thread))
    monkeypatch.setattr(process, "time", SimpleNamespace(sleep=slept.append))
    process.bind_to_server(41)
    assert environment == {"OMP_NUM_THREADS": "2", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
    (asked,) = begun
    assert asked["daemon"]
    asked["target"](*asked["args"])
    assert (slept, ended) == ([process.CHECK_INTERVAL] * 2, [1])
