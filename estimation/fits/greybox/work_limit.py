"""`Work(most)`: limit on the work of all searches, in model steps: results do not depend on the machine's speed."""

from collections.abc import Generator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass

from estimation.fits.greybox.log import GreyBoxLog

MOST_STEPS = 600_000_000
"""Most steps of the model in all searches for unusual effects in a log, all runs together [count]; a step takes 20 to
50 ns. Of one log of each kind of the open benchmark, 54 take at most 280 million, and one 460 million."""


class WorkSpentError(Exception):
    """Searches have reached their limit of work."""


@dataclass
class Work:
    """Limit of the work of searches, and the work done.

    Parameters
    ----------
    most : int
        Most steps of the model in all runs, side by side or not [count].
    done : int
        The same so far [count].

    Examples
    --------
    >>> work = Work(most=100)
    >>> with work.counted():
    ...     pass
    >>> work.done
    0
    """

    most: int = MOST_STEPS
    done: int = 0

    @contextmanager
    def counted(self) -> Generator[None]:
        """Count this thread's work within the context; a `WorkSpentError` ends it before it exceeds the limit."""
        outer = _counted.set(self)
        try:
            yield
        finally:
            _counted.reset(outer)


def spend(log: GreyBoxLog, runs: int = 1) -> None:
    """Count runs over a log that are about to be made, if work is counted.

    Parameters
    ----------
    log : GreyBoxLog
        The log, with its steps.
    runs : int
        How many [count].

    Raises
    ------
    WorkSpentError
        If they are more than what is left.
    """
    work = _counted.get()
    if work is None:
        return
    steps = runs * int(log.steps.sum())
    if work.done + steps > work.most:
        raise WorkSpentError
    work.done += steps


_counted: ContextVar[Work | None] = ContextVar("counted", default=None)
