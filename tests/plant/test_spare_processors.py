"""Spare processors change when an answer arrives, but never the answer."""

import threading
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest

from plant import spare_processors
from plant.spare_processors import map_cases, start_if_idle


@pytest.fixture
def two(monkeypatch: pytest.MonkeyPatch) -> None:
    """A machine with two processors."""
    monkeypatch.setattr(spare_processors, "spare_processors", lambda: 1)


def _no_number(case: float) -> float:
    if case < 0.0:
        raise ValueError(case)
    return case


def test_no_processor_is_spare_in_a_pools_process_or_in_a_thread() -> None:
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        assert pool.submit(spare_processors.spare_processors).result() == 0
    found: list[int] = []
    thread = threading.Thread(target=lambda: found.append(spare_processors.spare_processors()))
    thread.start()
    thread.join()
    assert found == [0]


@pytest.mark.usefixtures("two")
def test_a_begun_task_runs_in_a_thread_that_ends_before_its_result_is_requested() -> None:
    began, others = threading.Event(), set(threading.enumerate())
    waiting = start_if_idle(began.set)
    assert waiting is not None
    assert began.wait(5.0)
    until = time.monotonic() + 5.0
    while (left := set(threading.enumerate()) - others) and time.monotonic() < until:
        time.sleep(0.01)
    assert not left
    waiting()


@pytest.mark.usefixtures("two")
def test_an_error_of_a_begun_task_is_raised_when_its_result_is_requested() -> None:
    waiting = start_if_idle(lambda: _no_number(-1.0))
    assert waiting is not None
    with pytest.raises(ValueError, match="-1"):
        waiting()
    with pytest.raises(ValueError, match="-2"):
        map_cases(_no_number, [1.0, -2.0, 3.0])


@pytest.mark.usefixtures("two")
def test_each_keeps_the_order_of_cases_and_the_error_settings_of_numpy() -> None:
    def slow_first(case: int) -> tuple[int, str]:
        time.sleep(0.02 / (1 + case))
        return case, np.geterr()["divide"]

    with np.errstate(divide="ignore"):
        assert map_cases(slow_first, range(4)) == [(case, "ignore") for case in range(4)]


def test_nothing_is_begun_without_a_spare_processor(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(spare_processors, "spare_processors", lambda: 0)
    names: list[str] = []
    assert start_if_idle(lambda: names.append("begun")) is None
    map_cases(lambda _: names.append(threading.current_thread().name), [1, 2])
    assert names == [threading.current_thread().name] * 2
