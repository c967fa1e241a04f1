"""Rows of a CSV that is still being written: lines in, samples on a uniform clock out."""

import csv
import warnings
from collections.abc import Iterable, Iterator, Mapping
from itertools import chain, islice, pairwise
from statistics import median

import numpy as np
from numpy.typing import NDArray

from plant.errors import LogError, LogWarning
from plant.log.columns import TIME, TRUTH, Column, resolve_columns
from plant.log.formats.cells import not_a_number, number, wrong_width
from plant.log.guess import overlooked
from plant.log.headings import cleaned

FIRST_ROWS = 50
"""Rows from which the time between samples is found."""

LONGEST_GAP = 1.0
"""Missing rows are filled with missing samples up to here [s]; after a longer gap the stream begins again."""

SAME_RATE = 0.01
"""By how much the rates of a stream, and of what it is continued or compared with, may differ [fraction]."""

BEHIND = 1e-6
"""Least step in time, as a share of the time between samples, that counts as forward [fraction]."""


class CsvStream:
    r"""The rows of a CSV, read as they come.

    Parameters
    ----------
    lines : iterable of str
        Header and rows, each with the line's end that says that it is whole.
    mapping : Mapping[str, str], optional
        Foreign column by channel, see `plant.log.columns.resolve_columns`.

    Raises
    ------
    LogError
        If there is no header, a column is missing or of an unknown unit, the first rows are broken or fewer than two,
        or time does not increase.

    Warns
    -----
    LogWarning
        If a column that was not read may be pressure, or a second signal of motion.

    Examples
    --------
    >>> rows = ["time_s,motor_speed_rpm,position_m\n", "0.0,60,0\n", "0.1,60,0\n", "0.2,60,0\n"]
    >>> stream = CsvStream(rows, source="example")
    >>> stream.channels, round(stream.sample_time, 9)
    (('motor_speed_rad_s', 'position_m'), 0.1)
    """

    def __init__(self, lines: Iterable[str], mapping: Mapping[str, str] | None = None, *, source: str) -> None:
        self._source, self._row = source, 0
        self._lines = iter(lines)
        header = next((line for line in self._lines if line.strip()), "")
        if not header:
            raise LogError("a header line is needed, but nothing came", source)
        self._delimiter = max(",;\t", key=header.count)
        names = next(csv.reader([header], delimiter=self._delimiter))
        self._width = len(names)
        columns = [one for one in resolve_columns(names, mapping, source) if not one.channel.startswith(TRUTH)]
        time = [one for one in columns if one.channel == TIME]
        if not time:
            raise LogError(f"a column {TIME} is needed, or in another unit as time_ms, got {', '.join(names)}", source)
        self._columns = time + [one for one in columns if one.channel != TIME]
        read = {one.position for one in columns}
        left = [heading for place, heading in enumerate(cleaned(names)) if place not in read]
        for said in overlooked(left, [one.channel for one in columns]):
            warnings.warn(LogWarning(said, source), stacklevel=2)
        self.channels = tuple(one.channel for one in self._columns[1:])
        """Channels of the samples, in order."""
        self.cut = False
        """Whether the stream ended within a row, or without its line's end; that row is left out."""
        rows = self._rows()
        first = list(islice(rows, FIRST_ROWS))
        if len(first) < 2:
            raise LogError(f"at least two rows are needed to know the time between samples, got {len(first)}", source)
        self.sample_time = median(float(after[0] - before[0]) for before, after in pairwise(first))
        """Time between samples [s]."""
        if not self.sample_time > 0.0:
            raise LogError(f"{TIME} must increase from row to row, got steps of {self.sample_time:g} s", source)
        self.start_time = float(first[0][0])
        """Time of the first row [s]."""
        self._pending = chain(first, rows)

    def samples(self, most: int) -> Iterator[tuple[float, NDArray[np.float64], bool]]:
        """Yield samples, a few at a time.

        Yields
        ------
        time : float
            Time of the last row [s].
        samples : ndarray, shape (n, channels)
            Values in SI; missing rows as NaN.
        gap : bool
            Whether a gap too long to be filled came before them.

        Raises
        ------
        LogError
            If a row has too few or too many cells, a cell is not a number, or time does not increase.
        """
        waiting: list[NDArray[np.float64]] = []
        last, gap = self.start_time - self.sample_time, False
        for number_of_row, row in enumerate(self._pending, start=1):
            steps = (float(row[0]) - last) / self.sample_time
            if not steps > BEHIND:
                raise LogError(
                    f"{TIME} must increase from row to row, got {row[0]:g} s after {last:g} s in row {number_of_row}",
                    self._source,
                )
            missing = round(steps) - 1
            if missing * self.sample_time > LONGEST_GAP:
                if waiting:
                    yield last, np.array(waiting), gap
                waiting, gap = [], True
            else:
                waiting += [np.full(len(row) - 1, np.nan)] * missing
            waiting.append(row[1:])
            last = float(row[0])
            if len(waiting) >= most:
                yield last, np.array(waiting), gap
                waiting, gap = [], False
        if waiting:
            yield last, np.array(waiting), gap

    def _rows(self) -> Iterator[NDArray[np.float64]]:
        for line in self._lines:
            if not line.strip():
                continue
            cells = line.rstrip("\r\n").split(self._delimiter)
            if '"' in line:
                cells = next(csv.reader([line], delimiter=self._delimiter))
            if not line.endswith(("\n", "\r")):  # it may end in the middle of a digit
                self.cut = True
                return
            if len(cells) != self._width:
                raise wrong_width(self._source, self._width, len(cells), self._row)
            yield np.array([self._value(one, cells[one.position]) for one in self._columns])
            self._row += 1

    def _value(self, column: Column, cell: str) -> float:
        try:
            value = number(cell.replace(",", ".") if self._delimiter != "," else cell)
        except ValueError as error:
            raise not_a_number(self._source, column.name, self._row, cell) from error
        if value in (float("inf"), float("-inf")) or (column.channel == TIME and value != value):
            raise not_a_number(self._source, column.name, self._row, cell or "an empty cell")
        return value * column.factor + column.offset
