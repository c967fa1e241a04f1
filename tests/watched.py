"""Records the arguments with which a function is called, in the test's own process."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest


@contextmanager
def watched(
    place: Any, name: str, told: Callable[..., Any], instead: Callable[..., Any] | None = None
) -> Iterator[list[Any]]:
    """Record the arguments of each call of a function, and call it, or another one instead."""
    asked: list[Any] = []
    real = getattr(place, name)

    def spy(*args: Any, **kwargs: Any) -> Any:
        asked.append(told(*args, **kwargs))
        return (instead or real)(*args, **kwargs)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(place, name, spy)
        yield asked
