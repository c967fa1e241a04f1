"""Figures beside their targets, as the plants' benchmarks print them."""

import time
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")

misses: list[str] = []
"""What fell short since a benchmark began."""


def say(what: str, value: float, bound: float, *, most: bool = True) -> None:
    """Print a figure beside its target, and note it if it falls short."""
    met = value <= bound if most else value >= bound
    print(
        f"{'met   ' if met else 'MISSED'} {what}: {value:.4g} (wanted: {'at most' if most else 'at least'} {bound:g})"
    )
    if not met:
        misses.append(what)


def timed(work: Callable[[], T]) -> tuple[float, T]:
    """Return the processor time that some work took [s], and its result."""
    start = time.process_time()
    found = work()
    return time.process_time() - start, found
