from collections.abc import Callable, Generator
from concurrent.futures import CancelledError, Executor, Future
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from pathlib import Path
from threading import Event
from typing import Any

import pyarrow as pa
import pytest

from experiments.batch.part_store import open_store
from experiments.batch.runner import WORKER_ENDED
from experiments.running.executors import SerialExecutor
from plant.errors import HydrostateError
from tests.experiments.batch.conftest import rows_in_parts, run_into, small_plan


def test_a_repeated_study_runs_no_case_again(tmp_path: Path, reference: pa.Table) -> None:
    store = open_store(tmp_path / "store")
    assert run_into(store, small_plan()).done == 24
    assert run_into(store, small_plan()).done == 0
    assert store.rows().equals(reference)


def test_a_changed_study_runs_only_its_new_cases_and_a_study_changed_back_runs_none(
    tmp_path: Path, reference: pa.Table
) -> None:
    store = open_store(tmp_path / "store")
    run_into(store, small_plan())
    assert run_into(store, small_plan(seeds=[0, 1, 9], starts_pa=[0.0, 2e8])).done == 4
    assert len(store.rows()) == 12
    assert run_into(store, small_plan()).done == 0
    assert store.rows().equals(reference)


def test_an_interrupted_study_keeps_its_finished_cases_and_can_be_resumed(tmp_path: Path, reference: pa.Table) -> None:
    store, stop = open_store(tmp_path / "store"), Event()
    tally = run_into(store, small_plan(), stop=stop, on_part=lambda *_: stop.set())
    assert (tally.stopped, tally.done) == ("interrupted", len(store.rows()))
    assert 0 < tally.done < 24
    assert run_into(store, small_plan()).done == 24 - tally.done
    assert store.rows().equals(reference)
    assert rows_in_parts(store) == 24


def test_too_many_failures_end_a_study(tmp_path: Path) -> None:
    store = open_store(tmp_path / "store")
    # too slow for the velocity window of these sensors
    plan = small_plan(sensors=["rig"], sample_time_s=4e-3, duration_s=0.4)
    tally = run_into(store, plan, max_failures=2)
    assert "--max-failures is 2" in tally.stopped
    assert tally.failed == tally.done < 24
    assert run_into(store, plan).failed == 24 - tally.done


def test_failed_cases_are_run_again_on_demand_and_count_once(tmp_path: Path) -> None:
    store = open_store(tmp_path / "store")
    plan = small_plan(sensors=["rig"], sample_time_s=4e-3, duration_s=0.4)
    run_into(store, plan)
    assert run_into(store, plan).done == 0
    assert run_into(store, plan, again=True).done == 24
    assert len(store.rows()) == 24


class _Deadly(SerialExecutor):
    """Ends its worker at each task with a certain case."""

    def __init__(self, key: str) -> None:
        self._key, self._broken = key, False

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        if self._broken:
            raise BrokenProcessPool
        if self._key in args[0].keys:
            self._broken = True
            future: Future[Any] = Future()
            future.set_exception(BrokenProcessPool("a process ended"))
            return future
        return super().submit(fn, *args, **kwargs)


def test_a_case_that_ends_its_worker_fails_alone(tmp_path: Path, reference: pa.Table) -> None:
    plan, store = small_plan(), open_store(tmp_path / "store")
    deadly = plan.keys[10]

    @contextmanager
    def opener() -> Generator[tuple[Executor, int]]:
        yield _Deadly(deadly), 2

    tally = run_into(store, plan, opener=opener)
    rows = store.rows().to_pylist()
    assert (tally.done, tally.failed) == (24, 1)
    assert [row["reason"] for row in rows if row["outcome"] == "failed"] == [WORKER_ENDED]
    assert [row for row in rows if row["key"] != deadly] == [
        row for row in reference.to_pylist() if row["key"] != deadly
    ]
    assert rows_in_parts(store) == 24


class KilledWorker(Exception):  # noqa: N818  Dask's name for it, by which it is known where Dask is not installed
    """A worker of a cluster ended while it had a task."""


class _Failing(SerialExecutor):
    """Fails with a given error at each task with a certain case."""

    def __init__(self, key: str, error: BaseException) -> None:
        self._key, self._error = key, error

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        if self._key not in args[0].keys:
            return super().submit(fn, *args, **kwargs)
        future: Future[Any] = Future()
        future.set_exception(self._error)
        return future


def _open_failing(key: str, error: BaseException) -> Any:
    @contextmanager
    def opener() -> Generator[tuple[Executor, int]]:
        yield _Failing(key, error), 2

    return opener


def test_a_case_that_ends_its_worker_on_a_cluster_fails_alone(tmp_path: Path, reference: pa.Table) -> None:
    plan, store = small_plan(), open_store(tmp_path / "store")
    tally = run_into(store, plan, opener=_open_failing(plan.keys[10], KilledWorker("it ended")))
    rows = store.rows().to_pylist()
    assert (tally.done, tally.failed) == (24, 1)
    assert [row["key"] for row in rows if row["reason"] == WORKER_ENDED] == [plan.keys[10]]
    kept = [row for row in rows if row["key"] != plan.keys[10]]
    assert kept == [row for row in reference.to_pylist() if row["key"] != plan.keys[10]]


@pytest.mark.parametrize(
    ("error", "raised", "words"),
    [
        (CancelledError(), HydrostateError, "the cluster went away; run the same command again to go on"),
        (ZeroDivisionError("ours"), ZeroDivisionError, "ours"),
    ],
)
def test_a_lost_cluster_or_an_internal_error_ends_the_study_and_loses_no_kept_row(
    error: BaseException, raised: type[Exception], words: str, tmp_path: Path, reference: pa.Table
) -> None:
    plan, store = small_plan(), open_store(tmp_path / "store")
    with pytest.raises(raised, match=words):
        run_into(store, plan, opener=_open_failing(plan.keys[-1], error))
    before = len(store.rows())
    assert 0 < before < 24
    assert run_into(store, plan).done == 24 - before
    assert store.rows().equals(reference)
