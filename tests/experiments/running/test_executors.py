"""Where a study's tasks run: a task's error is kept, and a missing cluster is reported."""

import sys
from types import SimpleNamespace
from typing import Any

import pytest

from experiments.running.executors import SerialExecutor, open_executor
from plant.errors import HydrostateError


def test_the_exception_of_a_task_is_raised_by_its_result() -> None:
    future = SerialExecutor().submit(int, "no number")
    assert isinstance(future.exception(), ValueError)
    with pytest.raises(ValueError, match="no number"):
        future.result()


def test_a_cluster_without_dask_is_refused_with_the_extra_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with (
        pytest.raises(HydrostateError, match=r"pip install 'hydrostate\[cluster\]'"),
        open_executor(cluster="tcp://a:1"),
    ):
        pass


@pytest.mark.parametrize("error", [OSError("timed out"), ValueError("no port")])
def test_a_scheduler_that_does_not_answer_is_named_by_its_address(
    error: Exception, monkeypatch: pytest.MonkeyPatch
) -> None:
    def client(*_: Any, **__: Any) -> None:
        raise error

    monkeypatch.setitem(sys.modules, "distributed", SimpleNamespace(Client=client))
    with pytest.raises(HydrostateError, match=f"tcp://a:1: no Dask scheduler answers there: {error}"):
        open_executor(cluster="tcp://a:1").__enter__()


def test_a_cluster_runs_as_many_tasks_as_it_has_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    closed: list[bool] = []

    class Client:
        def __init__(self, address: str, timeout: str) -> None:
            assert (address, timeout) == ("tcp://a:1", "20s")

        def __enter__(self) -> "Client":
            return self

        def __exit__(self, *_: object) -> None:
            closed.append(True)

        def ncores(self) -> dict[str, int]:
            return {"one": 2, "two": 3}

        def get_executor(self, *, pure: bool) -> SerialExecutor:
            assert not pure
            return SerialExecutor()

    monkeypatch.setitem(sys.modules, "distributed", SimpleNamespace(Client=Client))
    with open_executor(cluster="tcp://a:1") as (executor, width):
        assert (executor.submit(abs, -2).result(), width) == (2, 5)
        assert not closed
    assert closed


@pytest.mark.parametrize("stopped", [False, True])
def test_an_interruption_ends_the_processes_of_the_pool_and_no_others(
    stopped: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    from experiments.running import executors

    happened: list[str] = []
    pool = SimpleNamespace(shutdown=lambda **how: happened.append(f"shut {how}"))
    child, other = (SimpleNamespace(terminate=lambda name=name: happened.append(name)) for name in ("ours", "theirs"))
    children = [other]

    def begun(workers: int) -> Any:
        children.append(child)
        return pool if workers == 3 else None

    monkeypatch.setattr(executors, "process_pool", begun)
    monkeypatch.setattr(executors.multiprocessing, "active_children", lambda: list(children))

    def use() -> None:
        with open_executor(3) as (executor, width):
            assert (executor, width) == (pool, 3)
            if stopped:
                raise KeyboardInterrupt

    if stopped:
        with pytest.raises(KeyboardInterrupt):
            use()
    else:
        use()
    assert happened == ["ours"] * stopped + ["shut {'wait': True, 'cancel_futures': True}"]
