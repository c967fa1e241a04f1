"""Runs independent cases in parallel: threads in one process, `concurrent.futures` executors for several.

The compiled kernels release the interpreter's lock, so threads are enough within one process. Meanwhile, linear algebra
libraries are limited to one thread each: their threads and ours together would oversubscribe the cores. A batch study
uses an executor: this process itself, several processes on this machine, or a Dask cluster.
"""

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager
from multiprocessing.connection import wait
from typing import Any, TypeVar

from threadpoolctl import threadpool_limits

from plant.errors import HydrostateError

Case = TypeVar("Case")
Found = TypeVar("Found")


def map_in_parallel(run: Callable[[Case], Found], cases: Iterable[Case]) -> Iterator[Found]:
    """Run every case and yield the results in the order of the cases.

    Parameters
    ----------
    run : callable
        From a case to its result; must depend only on the case.

    Yields
    ------
    object
        One result per case. Cases not yet started are dropped when the consumer stops early or is interrupted.

    Examples
    --------
    >>> list(map_in_parallel(abs, [-2, 3]))
    [2, 3]
    """
    executor = ThreadPoolExecutor(max_workers=os.cpu_count() or 1)
    try:
        with threadpool_limits(limits=1, user_api="blas"):
            yield from executor.map(run, cases)
    finally:
        executor.shutdown(wait=True, cancel_futures=True)


class SerialExecutor(Executor):
    """Runs submitted functions immediately, in this process."""

    def submit(self, fn: Callable[..., Found], /, *args: Any, **kwargs: Any) -> Future[Found]:
        """Run a function and return its finished future."""
        future: Future[Found] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


@contextmanager
def open_executor(workers: int = 1, cluster: str | None = None) -> Generator[tuple[Executor, int]]:
    """Open an executor for the tasks of a batch study.

    Parameters
    ----------
    workers : int
        Number of processes on this machine; 1 means this process itself.
    cluster : str, optional
        Address of a Dask scheduler, ``tcp://host:8786``, which is used instead.

    Yields
    ------
    tuple of Executor and int
        The executor, and how many tasks it runs at a time.

    Raises
    ------
    HydrostateError
        If Dask is requested but not installed, or no scheduler answers.

    Examples
    --------
    >>> with open_executor() as (executor, width):
    ...     executor.submit(abs, -2).result(), width
    (2, 1)
    """
    if cluster is not None:
        with _dask(cluster) as client:
            yield client.get_executor(pure=False), max(1, sum(client.ncores().values()))
        return
    if workers == 1:
        with threadpool_limits(limits=1, user_api="blas"):
            yield SerialExecutor(), 1
        return
    others = multiprocessing.active_children()
    executor = process_pool(workers)
    try:
        yield executor, workers
    except KeyboardInterrupt:  # the user does not want to wait for tasks in flight
        for process in multiprocessing.active_children():
            if process not in others:
                process.terminate()
        raise
    finally:
        executor.shutdown(wait=True, cancel_futures=True)


def process_pool(workers: int) -> ProcessPoolExecutor:
    """Return a pool of single-threaded processes, which leave Ctrl-C to the parent and end with it."""
    return ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"), _begin_worker)


def _begin_worker() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threadpool_limits(limits=1, user_api="blas")
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """End this process when its parent has been killed; otherwise it would wait for work forever."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


@contextmanager
def _dask(address: str) -> Generator[Any]:
    try:
        from distributed import Client
    except ImportError as error:
        raise HydrostateError("--cluster needs Dask: pip install 'hydrostate[cluster]'") from error
    try:
        client = Client(address, timeout="20s")
    except (OSError, ValueError) as error:
        raise HydrostateError(f"--cluster {address}: no Dask scheduler answers there: {error}") from error
    with client:
        yield client
