"""Progress of a long search, reported to any listener; the search need not know who listens."""

from collections.abc import Callable, Generator
from contextlib import contextmanager
from contextvars import ContextVar

_LISTENER: ContextVar[Callable[[str], None] | None] = ContextVar("listener", default=None)


@contextmanager
def listening(listener: Callable[[str], None]) -> Generator[None]:
    """Hear what is tried within a block.

    Parameters
    ----------
    listener : callable
        Called with what is being tried, once for each model.

    Examples
    --------
    >>> heard = list[str]()
    >>> with listening(heard.append):
    ...     tell("linear models")
    >>> tell("nobody listens")
    >>> heard
    ['linear models']
    """
    token = _LISTENER.set(listener)
    try:
        yield
    finally:
        _LISTENER.reset(token)


def tell(what: str) -> None:
    """Say what is tried next, if anybody listens.

    Parameters
    ----------
    what : str
        Kind of model, in the plural.
    """
    listener = _LISTENER.get()
    if listener is not None:
        listener(what)
