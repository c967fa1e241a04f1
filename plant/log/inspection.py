"""Contents of a log file: columns with range and gaps, and the clock of its rows."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from plant.arrays import Array
from plant.log.clock.jitter import usual_step
from plant.log.clock.stamps import seconds_from_first
from plant.log.clock.time_unit import unit_of_dates
from plant.log.headings import Heading
from plant.log.table import Table


@dataclass(frozen=True, eq=False)
class ColumnFacts:
    """A column of a log.

    Parameters
    ----------
    heading : Heading
        What it is called, and its unit where the file gives one.
    values : ndarray, shape (n,), or None
        Its values as logged; None where it is text.
    """

    heading: Heading
    values: Array | None

    @property
    def present(self) -> Array:
        """The finite values; empty for dates and for text."""
        if self.values is None or self.values.dtype.kind == "M":
            return np.empty(0)
        return self.values[np.isfinite(self.values)]

    @property
    def span(self) -> tuple[float, float] | None:
        """Least and largest value [unit of the column], None where there is no number."""
        present = self.present
        return (float(present.min()), float(present.max())) if len(present) else None

    @property
    def missing(self) -> int:
        """Number of cells without a value."""
        if self.values is None:
            return 0
        empty = np.isnat(self.values) if self.values.dtype.kind == "M" else ~np.isfinite(self.values)
        return int(np.count_nonzero(empty))


@dataclass(frozen=True)
class ClockFacts:
    """The time stamps of a log as written.

    Parameters
    ----------
    step : float
        Usual time between rows [s, or the unit of the column].
    duration : float
        From the first row to the last [s, or the unit of the column].
    gaps, repeats, backward : int
        Steps longer than one and a half of the usual one, stamps that are there twice, and steps back.
    jitter : float
        Root mean square by which other steps differ from the usual one, over it [fraction].
    """

    step: float
    duration: float
    gaps: int
    repeats: int
    backward: int
    jitter: float


@dataclass(frozen=True, eq=False)
class TableFacts:
    """A table of a log.

    Parameters
    ----------
    table : Table
        The table.
    rows : int
        Its length.
    columns : tuple of ColumnFacts
        In order.
    """

    table: Table
    rows: int
    columns: tuple[ColumnFacts, ...]

    @property
    def numbers(self) -> Mapping[int, Array]:
        """Values of the columns that hold numbers or dates, by their place."""
        return {place: one.values for place, one in enumerate(self.columns) if one.values is not None}


def inspect_table(table: Table) -> TableFacts:
    """Return the facts of a table: its rows and columns."""
    found = table.numbers()
    columns: list[ColumnFacts] = []
    for place, heading in enumerate(table.headings):
        values = found.get(place)
        dated = values is not None and values.dtype.kind == "M"
        said = heading.said if heading.unit is not None or dated or values is None else _unit_of_dates(values)
        columns.append(ColumnFacts(Heading(heading.name, said, heading.stamped or dated), values))
    rows = max((len(values) for values in found.values()), default=0)
    return TableFacts(table, rows, tuple(columns))


def _unit_of_dates(values: Array) -> str | None:
    """Return the unit in which a column that never decreases holds dates; None for others."""
    there = values[np.isfinite(values)]
    dates = unit_of_dates(there) if len(there) > 2 and bool((np.diff(there) >= 0.0).all()) else None
    return None if dates is None else dates[0]


def clock_facts(stamps: Any) -> ClockFacts | None:
    """Return the facts of a log's time stamps.

    Parameters
    ----------
    stamps : ndarray, shape (n,)
        Numbers, or datetime64[ns].

    Returns
    -------
    ClockFacts or None
        None where there are fewer than three stamps, none increases, or they are too far apart for a number.

    Examples
    --------
    >>> facts = clock_facts(np.array([0.0, 1.0, 2.0, 4.0, 5.0, 6.0]))
    >>> facts.step, facts.gaps
    (1.0, 1)
    """
    time = seconds_from_first(stamps) if stamps.dtype.kind == "M" else stamps
    time = time[np.isfinite(time)]
    if len(time) < 3:
        return None
    with np.errstate(over="ignore", invalid="ignore"):
        step = np.diff(time)
        if stamps.dtype.kind == "M" and (step < 0.0).all():  # the newest row stands first
            time, step = time[::-1], -step[::-1]
        forward, span = step[step > 0.0], float(time[-1] - time[0])
        if not len(forward) or not np.isfinite(forward).all() or not np.isfinite(span):
            return None
        usual = usual_step(forward)
        near = forward[forward < 1.5 * usual]
        jitter = float(np.sqrt(np.mean((near / usual - 1.0) ** 2))) if len(near) else 0.0
    return ClockFacts(
        usual,
        span,
        int(np.count_nonzero(forward >= 1.5 * usual)),
        int(np.count_nonzero(step == 0.0)),
        int(np.count_nonzero(step < 0.0)),
        jitter,
    )
