"""`Table`: an open log file with one clock, the names of its columns, and a way to read some of them."""

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from plant.arrays import Array
from plant.errors import LogError, LogWarning, NoMemoryError
from plant.log.columns import TRUTH_PREFIX, Column
from plant.log.headings import Heading
from plant.log.notes import LogCode

Read: TypeAlias = Callable[[Sequence[Column]], dict[Column, Array]]
"""From columns to their values as logged; a column of the truth that holds no numbers is left out."""


MOST_VALUES = 120_000_000
"""Values that are held of all columns of a table at once: 1 GB [count]."""

ALWAYS_HELD = 8
"""Columns that are held whatever their length: files are bounded [count]."""


@dataclass(frozen=True, eq=False)
class Table:
    """A log file, or a group of channels in one, whose columns share a clock.

    Parameters
    ----------
    source : str
        What messages call it.
    headings : tuple of Heading
        What its columns are called.
    read : callable
        From columns to their values: numbers, shape (n,), or times as datetime64[ns].
    metadata : str or None
        The JSON text that `plant.log.files.write_record` left.
    step : float or None
        Time between rows [s], where the file gives it in place of stamps.
    began : datetime64 or None
        When its first row was taken, where the file gives a step.
    label : str
        What the group, struct or sheet is called in the file.
    offset : float
        Time of its first row [s], where the file gives a step; counted from `began`, if that is known.
    """

    source: str
    headings: tuple[Heading, ...]
    read: Read
    metadata: str | None = None
    step: float | None = None
    began: np.datetime64 | None = None
    label: str = ""
    offset: float = 0.0

    def column(self, place: int) -> Column:
        """Return the column at a place, whatever it is called, as one that is left out if it holds no numbers."""
        return Column(place, self.headings[place].name, f"{TRUTH_PREFIX}{place}")

    def read_quietly(self, places: Sequence[int]) -> dict[int, Array]:
        """Return columns by their places, without the warnings that are given when channels are read.

        Parameters
        ----------
        places : sequence of int
            Places of the columns.

        Returns
        -------
        dict[int, ndarray of shape (n,)]
            Values as logged, by place. Columns without numbers are left out, and all if the file cannot be read.
        """
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                found = self.read([self.column(place) for place in places])
        except LogError:
            return {}
        return {column.position: values for column, values in found.items()}

    def numbers(self, time: Column | None = None) -> dict[int, Array]:
        """Return every column that holds numbers or times.

        Parameters
        ----------
        time : Column, optional
            The column of time, of channel ``time_s``. A row without a time is then left out of every column alike.

        Returns
        -------
        dict[int, ndarray of shape (n,)]
            Values as logged, by the column's place; a column of text is left out.

        Raises
        ------
        NoMemoryError
            If there is not enough memory for them.
        LogError
            If the column of time cannot be read.
        """
        columns = [self.column(place) for place in range(len(self.headings))]
        if time is not None:
            columns[time.position] = time
        self._require_room(columns)
        try:
            found = self.read(columns)
        except LogError:
            found = {}
            for column in columns:
                try:
                    found |= self.read([column])
                except NoMemoryError:
                    raise
                except LogError:
                    if column is time:
                        raise
            if time is not None:
                found = self.read(list(found))
        return {column.position: values for column, values in found.items()}

    def _require_room(self, columns: Sequence[Column]) -> None:
        """Refuse a table that is too large for memory, before its columns are read."""
        if len(columns) <= ALWAYS_HELD:
            return
        first = next((values for column in columns if (values := self._read_if_numbers(column)) is not None), None)
        if first is not None and len(first) * len(columns) > MOST_VALUES:
            raise NoMemoryError(
                f"all {len(columns)} columns of {len(first):,} rows are more than is looked at at once "
                f"({MOST_VALUES:,} values); leave columns or rows out of it",
                self.source,
            )

    def _read_if_numbers(self, column: Column) -> Array | None:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # warnings are given when all columns are read
                return self.read([column]).get(column)
        except NoMemoryError:
            raise
        except LogError:
            return None


def table_of(
    source: str,
    named: Mapping[str, Any],
    *,
    units: Mapping[str, str | None] | None = None,
    scales: Mapping[str, tuple[float, float]] | None = None,
    **more: Any,
) -> Table:
    """Return a table of columns in memory, or of columns that are read on request.

    Parameters
    ----------
    named : Mapping[str, ndarray or callable]
        Values by name, or what reads them.
    units : Mapping[str, str or None], optional
        Unit by name, where the file gives it.
    scales : Mapping[str, tuple[float, float]], optional
        Factor [1] and offset [unit of the column] by name that the file states, applied already or not.
    **more
        As `Table` takes them.
    """
    from plant.log.formats.cells import numbers, read_each
    from plant.log.formats.times import is_time, universal_times

    names = list(named)

    def read_one(column: Column) -> Array:
        told = (scales or {}).get(names[column.position])
        if told is not None and not column.channel.startswith(TRUTH_PREFIX):
            note = LogCode.SCALE_IN_HEADER.note(factor=told[0], offset=told[1], column=column.name[:80])
            warnings.warn(LogWarning(note, source), stacklevel=2)
        values = named[names[column.position]]
        got = np.atleast_1d(np.asarray(values() if callable(values) else values))
        return universal_times(got, column.name, source) if is_time(got) else numbers(got, column.name, source)

    headings = tuple(
        Heading(name, (units or {}).get(name), not callable(values) and is_time(np.asarray(values)))
        for name, values in named.items()
    )
    return Table(source, headings, lambda columns: read_each(columns, read_one), **more)
