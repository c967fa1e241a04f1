"""Work on processors that would idle while one log is answered.

Compiled kernels release the interpreter's lock, so threads share the work of a single log. A process of a pool has
neighbours that use the other processors, and a thread was started to use its own: both work alone.
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
    """Return the number of processors that this thread may take beside its own [count]."""
    if multiprocessing.parent_process() is not None or threading.current_thread() is not threading.main_thread():
        return 0
    allowed = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return allowed - 1


def begun(work: Callable[[], Found]) -> Callable[[], Found] | None:
    """Begin work that may be wanted later, if a processor is spare.

    Parameters
    ----------
    work : callable
        What is done; it changes nothing that others see.

    Returns
    -------
    callable or None
        Waits for the work, and returns its result or raises what it raised. None if no processor is spare.

    Examples
    --------
    >>> waiting = begun(lambda: 6 * 7)
    >>> waiting is None or waiting() == 42
    True
    """
    if not spare_processors():
        return None
    executor = ThreadPoolExecutor(max_workers=1)
    future: Future[Found] = executor.submit(copy_context().run, work)
    executor.shutdown(wait=False)  # its thread ends with the work, wanted or not
    return future.result


def each(run: Callable[[Case], Found], cases: Iterable[Case]) -> list[Found]:
    """Return the results of independent cases, in their order; spare processors take part.

    Parameters
    ----------
    run : callable
        From a case to its result; depends on nothing but the case.
    cases : iterable
        The cases.

    Examples
    --------
    >>> each(abs, [-2, 3])
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
