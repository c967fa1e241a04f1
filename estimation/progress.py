"""Progress of a long search, reported to any listener; the search does not depend on who listens."""

from collections.abc import Callable, Generator
from contextlib import contextmanager
from contextvars import ContextVar

_LISTENER: ContextVar[Callable[[str], None] | None] = ContextVar("listener", default=None)


@contextmanager
def reporting_to(listener: Callable[[str], None]) -> Generator[None]:
    """Report to a listener what is tried within a block.

    Parameters
    ----------
    listener : callable
        Called with the kind of model that is tried next, once for each model.

    Examples
    --------
    >>> heard = list[str]()
    >>> with reporting_to(heard.append):
    ...     report_progress("linear models")
    >>> report_progress("nobody listens")
    >>> heard
    ['linear models']
    """
    token = _LISTENER.set(listener)
    try:
        yield
    finally:
        _LISTENER.reset(token)


def report_progress(what: str) -> None:
    """Report what is tried next, if there is a listener.

    Parameters
    ----------
    what : str
        Kind of model, in the plural.
    """
    listener = _LISTENER.get()
    if listener is not None:
        listener(what)
