"""A system's error as a sentence for the user."""

from collections.abc import Generator
from contextlib import contextmanager

from plant.errors import HydrostateError


@contextmanager
def refused(said: str) -> Generator[None]:
    """Turn a system's error in this block into one that begins with these words."""
    try:
        yield
    except OSError as error:
        raise HydrostateError(f"{said}: {error.strerror or error}") from error
