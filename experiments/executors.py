"""Running independent cases side by side: threads, since the compiled kernels release the interpreter's lock.

Linear algebra libraries keep to one thread each meanwhile: theirs and ours together would oversubscribe the cores.
"""

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from threadpoolctl import threadpool_limits

Case = TypeVar("Case")
Found = TypeVar("Found")


def side_by_side(run: Callable[[Case], Found], cases: Iterable[Case], workers: int | None = None) -> Iterator[Found]:
    """Run every case and yield the results in the cases' order.

    Parameters
    ----------
    run : callable
        From a case to its result; depends on nothing but the case.
    cases : iterable
        The cases.
    workers : int, optional
        Threads; the machine's cores by default.

    Yields
    ------
    object
        One result a case. Cases not yet started are dropped when the consumer stops early or is interrupted.

    Examples
    --------
    >>> list(side_by_side(abs, [-2, 3]))
    [2, 3]
    """
    executor = ThreadPoolExecutor(max_workers=workers or os.cpu_count() or 1)
    try:
        with threadpool_limits(limits=1, user_api="blas"):
            yield from executor.map(run, cases)
    finally:
        executor.shutdown(wait=True, cancel_futures=True)
