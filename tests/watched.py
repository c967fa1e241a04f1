"""What a function is asked for: noted as it is called, in a test's own process."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest


@contextmanager
def watched(
    place: Any, name: str, told: Callable[..., Any], instead: Callable[..., Any] | None = None
) -> Iterator[list[Any]]:
    """Note what a function is called with, and call it, or another in its place."""
    asked: list[Any] = []
    real = getattr(place, name)

    def spy(*args: Any, **kwargs: Any) -> Any:
        asked.append(told(*args, **kwargs))
        return (instead or real)(*args, **kwargs)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(place, name, spy)
        yield asked
