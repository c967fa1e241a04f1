"""Parallel descents, each with the result that it would have in sequence."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from estimation.fits.greybox.descent import FIRST_RADIUS, LEAST_GAIN, Point, search
from plant.arrays import Array

PARALLEL_SEARCHES = 4
"""Searches that run in parallel [count]: with nine to twelve runs each they fill nine tenths of a kernel's lanes, and
few run in vain."""


class Way(NamedTuple):
    """Start of one search, see `descend`.

    Parameters
    ----------
    at_each : callable
        The costs at several coordinates; ways with the same function are evaluated together.
    start : ndarray, shape (unknowns,)
        Where to begin [dimensionless].
    bounds : tuple of ndarray, shape (unknowns,)
        Lowest and highest coordinates [dimensionless].
    """

    at_each: Callable[[Sequence[Array]], Sequence[Point]]
    start: Array
    bounds: tuple[Array, Array]


def descend_in_turn(
    ways: Sequence[Way],
    evaluations: int,
    wanted: float,
    after: Callable[[int, Point], float],
    *,
    radius: float = FIRST_RADIUS,
    least_share: float = 0.0,
) -> list[Point]:
    """Return the results of `descend` for starts in sequence; each result may bound the later ones.

    Several run in parallel, since one evaluation seldom fills a kernel. A way that ran ahead is cut back to where the
    bound from the ways before it would have ended it, once that is known. So each result is the same, to the bit, as in
    sequence.

    Parameters
    ----------
    ways : sequence of Way
        The ways, in their order.
    evaluations : int
        Most evaluations of the cost per way [count].
    wanted : float
        See `descend`; of the first way [dimensionless].
    after : callable
        ``after(i, point)``: bound for the ways after way ``i``, given its result; called in order.
    radius : float
        Length of the longest first step [dimensionless].
    least_share : float
        Share of the remaining cost that a further step must promise [fraction].

    Returns
    -------
    list of Point
        The best point of each way.
    """
    waiting = [_SearchAhead(way, evaluations, radius, least_share) for way in ways]
    found: list[Point] = []
    while waiting:
        first = waiting[0]
        beside = (one for one in waiting[1:] if one.way.at_each == first.way.at_each)
        some = [one for one in (first, *beside) if one.goes_on(wanted)][:PARALLEL_SEARCHES]
        if first.ended is not None:
            found.append(first.ended)
            wanted = min(wanted, after(len(found) - 1, found[-1]))
            del waiting[0]
            continue
        for one, point in zip(some, first.way.at_each([one.asked for one in some]), strict=True):
            one.take(point)
    return found


class _SearchAhead:
    """A search that runs ahead for as long as no known bound ends it."""

    def __init__(self, way: Way, evaluations: int, radius: float, least_share: float) -> None:
        self.way = way
        self.ended: Point | None = None
        self._wanted, self._past = np.inf, list[tuple[Point, float]]()
        self._search = search(way.start, evaluations, way.bounds, LEAST_GAIN, radius, self._worth, least_share)
        self.asked = next(self._search)

    def _worth(self, best: Point, hoped: float) -> bool:
        self._past.append((best, hoped))
        return not hoped > self._wanted

    def goes_on(self, wanted: float) -> bool:
        """Return whether the search goes on under this bound."""
        self._wanted = wanted
        self.ended = next((best for best, hoped in self._past if hoped > wanted), self.ended)
        return self.ended is None

    def take(self, point: Point) -> None:
        """Continue with the cost that was requested."""
        try:
            self.asked = self._search.send(point)
        except StopIteration as stop:
            self.ended = stop.value
