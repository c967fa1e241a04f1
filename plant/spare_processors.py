"""Use of processors that would be idle during the analysis of one log.

Compiled kernels release the interpreter's lock, so threads share the work of a single log. A process of a pool works
alone, since its neighbours use the other processors; so does a thread, which was started to use one of them.
"""

import multiprocessing
import os
import threading
from collections.abc import Callable, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from contextvars import copy_context
from functools import partial
from typing import TypeVar

Case = TypeVar("Case")
Found = TypeVar("Found")


def spare_processors() -> int:
    """Return the number of processors that this thread may use besides its own [count]."""
    if multiprocessing.parent_process() is not None or threading.current_thread() is not threading.main_thread():
        return 0
    allowed = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return allowed - 1


def start_if_idle(work: Callable[[], Found]) -> Callable[[], Found] | None:
    """Start work that may be needed later, if a processor is idle.

    Parameters
    ----------
    work : callable
        The work; it changes nothing that others see.

    Returns
    -------
    callable or None
        Waits for the work, and returns its result or raises its exception. None if no processor is idle.

    Examples
    --------
    >>> waiting = start_if_idle(lambda: 6 * 7)
    >>> waiting is None or waiting() == 42
    True
    """
    if not spare_processors():
        return None
    executor = ThreadPoolExecutor(max_workers=1)
    future: Future[Found] = executor.submit(copy_context().run, work)
    executor.shutdown(wait=False)  # the thread ends when the work is done, even if nobody takes the result
    return future.result


def map_cases(run: Callable[[Case], Found], cases: Iterable[Case]) -> list[Found]:
    """Return the results of independent cases, in their order; idle processors take part.

    Parameters
    ----------
    run : callable
        Function of a case; it depends only on the case.
    cases : iterable
        The cases.

    Examples
    --------
    >>> map_cases(abs, [-2, 3])
    [2, 3]
    """
    waiting = list(cases)
    threads = min(spare_processors() + 1, len(waiting))
    if threads < 2:
        return [run(case) for case in waiting]
    with ThreadPoolExecutor(max_workers=threads) as executor:
        futures = [executor.submit(copy_context().run, partial(run, case)) for case in waiting]
        try:
            return [future.result() for future in futures]
        finally:
            executor.shutdown(wait=True, cancel_futures=True)
