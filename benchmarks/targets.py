"""Figures with their targets: the common output of all benchmarks, which also keeps figures for the history."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from math import inf, isfinite
from typing import TypeVar

T = TypeVar("T")


@dataclass(frozen=True)
class Check:
    """One figure and its target range."""

    what: str
    """Measured quantity, with its unit."""

    value: float

    least: float = -inf

    most: float = inf

    @property
    def met(self) -> bool:
        """Whether the figure is in the range."""
        return self.least <= self.value <= self.most

    @property
    def wanted(self) -> str:
        """The range in words."""
        if not isfinite(self.least):
            return f"at most {self.most:g}" if isfinite(self.most) else "no target"
        return f"{self.least:g} to {self.most:g}" if isfinite(self.most) else f"at least {self.least:g}"

    def __str__(self) -> str:
        return f"{'met   ' if self.met else 'MISSED'} {self.what}: {self.value:.4g} (wanted: {self.wanted})"


misses: list[str] = []
"""Figures that missed their target since a benchmark began."""

kept: list[Check] = []
"""Every figure since the benchmarks began, for the history."""


def keep_figure(check: Check) -> Check:
    """Keep a figure for the history, without printing it."""
    kept.append(check)
    return check


def print_and_keep(checks: list[Check]) -> list[Check]:
    """Print figures, keep them for the history, and return them."""
    print("\n".join(str(keep_figure(check)) for check in checks), flush=True)
    return checks


def check_target(what: str, value: float, bound: float, *, most: bool = True) -> None:
    """Print a figure with its target, and record a miss."""
    [check] = print_and_keep([Check(what, value, most=bound) if most else Check(what, value, least=bound)])
    if not check.met:
        misses.append(what)


def processor_time(work: Callable[[], T]) -> tuple[float, T]:
    """Return the processor time of some work [s], and its result."""
    start = time.process_time()
    found = work()
    return time.process_time() - start, found
