"""Outlook for the severities of an actuator over its logs: level, growth, and the time to a limit."""

import math
from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from experiments.fleet.dates import HOURS, OUT_OF_SIGHT, date_interval_text, date_text
from experiments.fleet.naming import place_of, table_rows
from experiments.fleet.rows import LogRow
from faults.trend.crossing import HORIZON
from faults.trend.trend import FEWEST, Series, Trend, trends

REACHED = "reached"
"""Shown in place of a date if the limit has already been reached."""

LEAST_STD = 1e-3
"""Smallest standard deviation of a log, as a share of the distance from healthy to the limit [fraction]."""


@dataclass(frozen=True, eq=False)
class Outlook:
    """One severity of an actuator over its logs."""

    name: str
    unit: str
    logs: tuple[LogRow, ...]
    series: Series

    @property
    def course(self) -> list[Trend]:
        """Estimated trend after each log; not kept, since each takes 25 kB."""
        return list(trends(self.series))

    @cached_property
    def trend(self) -> Trend:
        """Estimated trend after the last log."""
        return deque(trends(self.series), maxlen=1)[0].alone

    @cached_property
    def quantiles(self) -> tuple[float, ...] | None:
        """Logs until the limit is crossed, at `QUANTILES` [step]; None if the median is beyond the horizon."""
        crossing = self.trend.crossing if self.trend.certain else None
        if crossing is None or not math.isfinite(crossing.quantiles[2]):
            return None
        return tuple(float(one) for one in crossing.quantiles)

    @property
    def left(self) -> tuple[float, float, float] | None:
        """Logs until the limit is reached: 5 %, median and 95 % [step]; None if the median is beyond the horizon."""
        return None if self.quantiles is None else (self.quantiles[0], self.quantiles[2], self.quantiles[4])

    @property
    def has_common_error(self) -> bool:
        """Whether the rig file's error is known."""
        return self.series.common is not None

    @cached_property
    def total_quantiles(self) -> tuple[float, ...] | None:
        """Logs until the limit is crossed with the rig file's error [step]; None before `FEWEST` logs of the stretch.

        The median is that without it, and each interval contains that without it.
        """
        own, total = self.trend.crossing, self.trend.total_crossing
        if own is None or total is None:
            return None
        pairs = zip((min, min, min, max, max), own.quantiles, total.quantiles, strict=True)
        found = [float(pick(one, other)) for pick, one, other in pairs]
        return (*found[:2], float(own.quantiles[2]), *found[3:])

    @property
    def alarm(self) -> bool:
        """Whether there is an alarm after the last log."""
        return self.trend.alarm

    @property
    def days_apart(self) -> float | None:
        """Usual time between two logs [day]; None if they have no calendar dates."""
        return (
            self.series.step if len(self.logs) > 1 and all(one.named.has_calendar_date for one in self.logs) else None
        )

    @property
    def past(self) -> str:
        """Since when the severity has been past its limit without a break to the last log; empty if it is not."""
        within = [place for place, one in enumerate(self.logs) if one.amounts[self.name].share <= 1.0]
        first = within[-1] + 1 if within else 0
        count = len(self.logs) - first
        if not count:
            return ""
        if not first:
            return "past the limit in every log" if count > 1 else "past the limit in the only log"
        day = self.logs[first].named.day
        return f"past the limit since {day}" if day else f"past the limit for {count} log{'s' if count > 1 else ''}"

    @property
    def doubt(self) -> str:
        """Advice if the last logs are past the limit but the trend is not; empty if they agree."""
        level = self.trend.level[0] - self.series.healthy
        if not self.past or level / (self.series.limit - self.series.healthy) > 1.0:
            return ""
        return "; its trend is still within it: log again to see whether this lasts"

    def when(self, low: int, high: int, *, total: bool = False) -> str:
        """Return when the limit is reached, between two of `QUANTILES`: as dates if logs have them, else in logs.

        Parameters
        ----------
        low, high : int
            Indices into `QUANTILES` [index].
        total : bool
            Whether with the rig file's error.
        """
        if self.trend.crossing is None:
            return ""
        quantiles = (total and self.total_quantiles) or self.trend.crossing.quantiles.tolist()
        ends = [quantiles[place] for place in (low, high)]
        if ends[1] <= 0.0:
            return REACHED
        growth, std = self.trend.growth
        if math.copysign(1.0, self.series.size) * growth + std < 0.0:
            return OUT_OF_SIGHT  # it recedes; some futures may still turn round, but readers do not ask for those
        if self.days_apart is None:
            return f"{span_of(*ends)} logs" if low != high else f"{ends[0]:.0f} log{'' if round(ends[0]) == 1 else 's'}"
        hours = any(len(one.named.shown) > len(one.named.day) for one in self.logs)
        ahead = [max(self.days_apart * end, 0.0 if hours else HOURS) for end in ends]  # no hour if file names have none
        places = [(self.logs[-1].named.place or 0.0) + self.days_apart * end for end in ends]
        if low != high:
            return date_interval_text(places, ahead)
        farthest = self.days_apart * quantiles[-1]
        return date_text(places[0], max(ahead[0], min(farthest, HOURS)))  # no hour if the interval is one of days

    @property
    def words(self) -> str:
        """The forecast in one clause."""
        if self.past:
            return self.past
        if len(self.logs) - self.trend.begin < FEWEST:
            return "too few logs"
        if self.left is None and self.alarm:  # the last log alone may still be within the limit
            return "the trend is past the limit"
        if self.left is None:
            return "growing" if self.trend.certain else "no certain growth"
        if self.left[1] <= 0.0:
            return "the trend is past the limit"
        middle, ends = self.when(2, 2), self.when(0, 4, total=True).removesuffix(" logs")
        around = "" if middle == ends else f" ({ends})"
        return f"limit {'in ' if self.days_apart is None else ''}{middle}{around}"

    @property
    def in_full(self) -> str:
        """The forecast in one sentence for the page of the actuator, without a full stop."""
        if self.past or self.left is None or self.left[1] <= 0.0 or len(self.logs) - self.trend.begin < FEWEST:
            return f": {self.words}{self.doubt}"
        middle = self.left[1]
        exact = f"; 90 % if the rig file is exact: {self.when(0, 4)}" if self.has_common_error else ""
        logs = (
            f"in about {middle:.0f} log{'' if round(middle) == 1 else 's'}" if middle >= 1.0 else "before the next log"
        )
        if self.days_apart is None:
            half = self.when(1, 3, total=True).removesuffix(" logs")
            return f" reaches its limit {logs} (50 % interval: {half} logs; 90 %: {self.when(0, 4, total=True)}{exact})"
        ends = f"50 % interval: {self.when(1, 3, total=True)}; 90 %: {self.when(0, 4, total=True)}{exact}"
        return f" reaches its limit {logs}: {self.when(2, 2)} ({ends})"


def span_of(low: float, high: float, horizon: float = HORIZON) -> str:
    """Return the interval of a crossing in words; predictions end at the horizon.

    Parameters
    ----------
    low, high : float
        Ends of the interval, infinite if beyond the horizon [logs, a count, or a unit of time].
    horizon : float
        How far predictions reach [the same unit].

    Examples
    --------
    >>> span_of(3.4, 12.0), span_of(80.0, math.inf), span_of(math.inf, math.inf)
    ('3 to 12', '80 to more than 300', 'more than 300')
    """
    first, last = (f"{end:.0f}" if math.isfinite(end) else f"more than {horizon:.0f}" for end in (low, high))
    return f"{first} to {last}" if math.isfinite(low) else first


def outlook_of(logs: Sequence[LogRow], name: str, maintained: Sequence[float] = ()) -> Outlook | None:
    """Return the outlook of a severity.

    Parameters
    ----------
    logs : sequence of LogRow
        Logs of one actuator, by date; without dates they count as evenly spaced.
    maintained : sequence of float
        Times of repairs, in the form of `experiments.fleet.naming.place_of` [day].

    Returns
    -------
    Outlook or None
        None if no log has both a verdict and a value of the severity.
    """
    told = tuple(one for one in logs if name in one.amounts and one.has_verdict)
    if not told:
        return None
    amounts = [one.amounts[name] for one in told]
    last = amounts[-1]
    places = [one.named.place for one in told]
    dated = all(place is not None for place in places)
    times = np.array(places if dated else range(len(told)), dtype=np.float64)
    least = LEAST_STD * abs(last.limit - last.healthy)
    series = Series(
        times,
        np.array([one.value for one in amounts]),
        np.maximum([one.std for one in amounts], least),
        last.healthy,
        last.limit,
        tuple(maintained) if dated else (),
        np.array([one.common for one in amounts]) if any(one.total for one in amounts) else None,
    )
    return Outlook(name, last.unit, told, series)


def read_maintenance(table: Path | None) -> Mapping[str, list[float]]:
    """Return the times at which actuators were repaired.

    Parameters
    ----------
    table : Path or None
        CSV with columns ``actuator`` and ``date``.

    Returns
    -------
    Mapping[str, list of float]
        Dates as numbers, by actuator.

    Raises
    ------
    HydrostateError
        If it cannot be read, or a date is invalid.
    """
    found: dict[str, list[float]] = {}
    rows: Iterable[Mapping[str, str]] = [] if table is None else table_rows(table, ("actuator", "date"))
    for row in rows:
        found.setdefault(row["actuator"], []).append(place_of(row["date"], str(table)))
    return found
