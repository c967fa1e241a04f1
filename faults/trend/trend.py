"""`trends(series)`: after each log, whether a severity grows over an actuator's logs, and when it reaches its limit."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from faults.trend.changes import stretches
from faults.trend.crossing import Crossing, crossing, shared_shifts
from faults.trend.kalman import Belief, moments, settings
from faults.trend.rest import growth_evidence, jumped_share, rest_evidence
from plant.arrays import Array

FALSE_ALARMS = 0.01
"""Probability that a stretch without growth ever raises an alarm, whatever its length [probability]."""

ALARM_HORIZON = 25.0
"""Number of steps ahead: an alarm is raised if a crossing within them is more probable than not [count]."""

SURE = 0.95
"""Probability that the level has passed the limit at which an alarm is raised for that alone [probability]."""

FEWEST = 4
"""Least number of logs in a stretch for a forecast [count]."""


@dataclass(frozen=True, eq=False)
class Series:
    """One severity over an actuator's logs.

    Parameters
    ----------
    times : ndarray, shape (n,)
        Times of the logs, rising [any unit].
    values, stds : ndarray, shape (n,)
        Estimate and standard deviation of each log [the severity's unit].
    healthy, limit : float
        Value of the healthy actuator, and the limit [the severity's unit].
    maintained : tuple of float
        Times of repairs [unit of the times].
    common : ndarray, shape (n, 2)
        Standard deviation of an error that all logs share, such as that of the rig file, towards smaller and larger
        true values [the severity's unit]. By default there is none.

    Raises
    ------
    ValueError
        If the series is empty, its times fall, or its limit is its healthy value.
    """

    times: Array
    values: Array
    stds: Array
    healthy: float
    limit: float
    maintained: tuple[float, ...] = ()
    common: Array | None = None

    def __post_init__(self) -> None:
        if not len(self.values) or np.any(np.diff(self.times) < 0.0) or self.limit == self.healthy:
            raise ValueError("a series needs logs in the order of time, and a limit other than the healthy value")

    @cached_property
    def step(self) -> float:
        """Mean time between logs [unit of the times]: the median would be minutes where logs come in bursts."""
        span = float(self.times[-1] - self.times[0])
        return span / (len(self.times) - 1) if span > 0.0 else 1.0

    @property
    def size(self) -> float:
        """Distance from healthy to the limit; negative if the severity falls to its limit [the severity's unit]."""
        return self.limit - self.healthy


@dataclass(frozen=True, eq=False)
class Trend:
    """The trend of a series after a log.

    Parameters
    ----------
    series : Series
        The whole series.
    place : int
        Index of the log.
    begin : int
        Index of the first log of its stretch, after the last jump or repair.
    belief : Belief
        The belief after the log, on the scale of `faults.trend.kalman`.
    rest : float
        Logarithm of the probability of the stretch's logs for a level that rests, or jumped once [dimensionless].
    """

    series: Series
    place: int
    begin: int
    belief: Belief
    rest: float

    @property
    def level(self) -> tuple[float, float]:
        """The severity without the scatter from log to log, and its standard deviation [the severity's unit]."""
        mean, std = moments(self.belief, settings())
        return self.series.healthy + self.series.size * mean, abs(self.series.size) * std

    @property
    def level_deviations(self) -> tuple[float, float]:
        """Standard deviations below and above the level, with the error that all logs share [the severity's unit]."""
        std = self.level[1]
        low, high = self._shared.tolist()
        return float(np.hypot(std, low)), float(np.hypot(std, high))

    @property
    def growth(self) -> tuple[float, float]:
        """Growth per step and its standard deviation [the severity's unit/log]."""
        mean, std = moments(self.belief, settings(), 1)
        return self.series.size * mean, abs(self.series.size) * std

    @cached_property
    def growing(self) -> float:
        """Log odds of the logs with growth against rest, with a jump or without [dimensionless]."""
        return growth_evidence(self.belief, settings(), self.rest)

    @property
    def alone(self) -> "Trend":
        """The same trend without the memory that it shares with those after other logs."""
        now = self.belief
        return replace(self, belief=Belief(now.mean.copy(), now.covariance.copy(), now.evidence.copy()))

    @property
    def _short(self) -> bool:
        return self.place - self.begin + 1 < FEWEST

    @cached_property
    def _future(self) -> Crossing:
        resting = jumped_share(self.belief, settings(), self.rest)
        return crossing(self.belief, settings(), np.random.default_rng(self.place), resting=resting)

    @property
    def crossing(self) -> Crossing | None:
        """When the limit is reached; None before `FEWEST` logs of the stretch."""
        return None if self._short else self._future

    @cached_property
    def total_crossing(self) -> Crossing | None:
        """The same with the error that all logs share: the limit is met early or late in all futures of a shift."""
        below, above = self._common
        if self._short or not below + above > 0.0:
            return self.crossing
        resting = jumped_share(self.belief, settings(), self.rest)
        shifts = shared_shifts(below, above, np.random.default_rng((self.place, 1)))
        return crossing(self.belief, settings(), np.random.default_rng(self.place), 1.0 - shifts, resting)

    @property
    def _shared(self) -> Array:
        """Deviations of the shared error of the last logs below and above, shape (2,) [the severity's unit]."""
        if self.series.common is None:
            return np.zeros(2)
        return np.median(self.series.common[max(self.begin, self.place + 1 - FEWEST) : self.place + 1], axis=0)

    @property
    def _common(self) -> tuple[float, float]:
        """The same with healthy at 0 and the limit at 1."""
        low, high = (self._shared / abs(self.series.size)).tolist()
        return (low, high) if self.series.size > 0.0 else (high, low)

    @property
    def certain(self) -> bool:
        """Whether it grows; the probability of ever claiming this wrongly is at most `FALSE_ALARMS`."""
        return self.growing >= -float(np.log(FALSE_ALARMS)) and moments(self.belief, settings(), 1)[0] > 0.0

    @property
    def alarm(self) -> bool:
        """Whether it certainly grows and probably reaches its limit within `ALARM_HORIZON`, or passed it (`SURE`)."""
        mean, std = moments(self.belief, settings())
        if self._short or (not self.certain and mean + 3.0 * std < 1.0):
            return False  # before futures are drawn, which is slow
        return self._future.within(0.0) >= SURE or (self.certain and self._future.within(ALARM_HORIZON) >= 0.5)


def trends(series: Series) -> Iterator[Trend]:
    """Yield the trend of a series after each log; later logs are not used."""
    scaled = (series.values - series.healthy) / series.size
    times, stds = series.times / series.step, series.stds / abs(series.size)
    known = first_logs_after(series.times, series.maintained)
    start, rest = 0, rest_evidence(times, scaled, stds, settings())
    for place, (begin, belief) in enumerate(stretches(times, scaled, stds, known, settings())):
        if begin != start:
            start, rest = begin, rest_evidence(times[begin:], scaled[begin:], stds[begin:], settings())
        yield Trend(series, place, begin, belief, float(rest[place - start]))


def first_logs_after(times: Array, events: Iterable[float]) -> set[int]:
    """Return the first log at or after each event; events after the last log are ignored.

    Parameters
    ----------
    times : ndarray, shape (n,)
        Times of the logs, rising [any unit].
    events : iterable of float
        Times of the events [the same unit].

    Examples
    --------
    >>> first_logs_after(np.array([1.0, 2.0, 3.0]), [1.5, 9.0])
    {1}
    """
    places = np.searchsorted(times, sorted(events))
    return {int(place) for place in places if place < len(times)}
