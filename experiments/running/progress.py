"""Progress of a study, with and without a display."""

from collections.abc import Callable, Iterable
from typing import Protocol, TypeVar

Piece = TypeVar("Piece")


class Track(Protocol):
    """Shows the progress of a study, as `rich.progress.Progress.track` does."""

    def __call__(
        self, sequence: Iterable[Piece], total: float | None = None, *, description: str = ...
    ) -> Iterable[Piece]:
        """Return the pieces, and move a bar as each is taken."""
        ...


def without_progress(
    sequence: Iterable[Piece], total: float | None = None, *, description: str = ""
) -> Iterable[Piece]:
    """Return the pieces without showing progress.

    Parameters
    ----------
    total : float, optional
        Number of pieces [count].
    """
    del total, description
    return sequence


def run_as_one_piece(track: Track, description: str, make: Callable[[], Piece]) -> Piece:
    """Run a single function that shows no progress of its own.

    Examples
    --------
    >>> run_as_one_piece(without_progress, "adding", lambda: 1 + 1)
    2
    """
    (done,) = [make() for _ in track([make], description=description)]
    return done
