"""Rows of a CSV that is still being written: lines go in, samples on a uniform clock come out."""

import csv
import warnings
from collections.abc import Iterable, Iterator, Mapping
from itertools import chain, islice, pairwise
from statistics import median
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from plant.errors import LogError, LogWarning
from plant.log.columns import TIME, TRUTH_PREFIX, Column, list_in_words, resolve_columns
from plant.log.formats.cells import MOST_STRANGE, not_a_number, number, wrong_width
from plant.log.guess import unused_column_notes
from plant.log.headings import headings_of
from plant.log.lost_values import LostInStream

FIRST_ROWS = 50
"""Rows from which the time between samples is found."""

LONGEST_GAP = 1.0
"""Missing rows are filled with missing samples up to here [s]; after a longer gap the stream begins again."""

SAME_RATE = 0.01
"""By how much the rates of a stream, and of what it is continued or compared with, may differ [fraction]."""

MOST_GARBAGE = 50.0
"""Rows in a row that may be garbage in a stream that was clean for long [count]."""

MOST_INITIAL_GARBAGE = 5.0
"""Rows that may be garbage before any was clean [count]."""

LEAST_FORWARD_STEP = 1e-6
"""Least step in time, as a share of the time between samples, that counts as forward [fraction]."""

_Placed: TypeAlias = tuple[int, NDArray[np.float64]]
"""A row with its place below the header."""


class CsvStream:
    r"""The rows of a CSV, read as they arrive.

    A row with too few or too many cells, or whose time is not a number or does not increase, is left out. A cell that
    is not a number is a missing sample. Both are counted in `left_out`. The stream is refused if they become too many:
    as in a log (`MOST_STRANGE`) in the long run, and more than `MOST_GARBAGE` in a row. A usual mark for lost samples,
    such as -9999, is also a missing sample if it stands out; it is counted, but never causes a refusal.

    Parameters
    ----------
    lines : iterable of str
        Header and rows, each with the line's end that says that it is whole.
    mapping : Mapping[str, str], optional
        Foreign column by channel, see `plant.log.columns.resolve_columns`.

    Raises
    ------
    LogError
        If there is no header, a column is missing or of an unknown unit, most of the first rows are garbage, they are
        fewer than two, or time does not increase.

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
        self._allowed = MOST_INITIAL_GARBAGE
        self.left_out = 0
        """Rows that were garbage or had a cell of it, so far [count]."""
        self.first_left_out = ""
        """What was wrong with the first of them."""
        self._lines = iter(lines)
        header = next((line for line in self._lines if line.strip()), "")
        if not header:
            raise LogError("a header line is needed, but nothing came", source)
        self._delimiter = max(",;\t", key=header.count)
        names = self._quoted(header)
        if names is None:
            raise LogError(f"the header cannot be split into names, got {header[:60]!r}", source)
        self._width = len(names)
        columns = [one for one in resolve_columns(names, mapping, source) if not one.channel.startswith(TRUTH_PREFIX)]
        time = [one for one in columns if one.channel == TIME]
        if not time:
            raise LogError(
                f"a column {TIME} is needed, or in another unit as time_ms, got {list_in_words(names)}", source
            )
        self._columns = time + [one for one in columns if one.channel != TIME]
        self._lost = {one.position: LostInStream() for one in columns if one.channel != TIME}
        read = {one.position for one in columns}
        left = [heading for place, heading in enumerate(headings_of(names)) if place not in read]
        for said in unused_column_notes(left, [one.channel for one in columns]):
            warnings.warn(LogWarning(said, source), stacklevel=2)
        self.channels = tuple(one.channel for one in self._columns[1:])
        """Channels of the samples, in order."""
        self.cut = False
        """Whether the stream ended within a row, or without its line's end; that row is left out."""
        rows = self._rows()
        first = self._without_strange_start(list(islice(rows, FIRST_ROWS)))
        if len(first) < 2:
            said = f", and {self.left_out} that were garbage; {self.first_left_out}" if self.left_out else ""
            raise LogError(
                f"at least two rows are needed to know the time between samples, got {len(first)}{said}", source
            )
        times = [float(row[0]) for _, row in first]
        self.sample_time = median(after - before for before, after in pairwise(times))
        """Time between samples [s]."""
        if not self.sample_time > 0.0:
            raise LogError(f"{TIME} must increase from row to row, got steps of {self.sample_time:g} s", source)
        self.start_time = times[0]
        """Time of the first row [s]."""
        self._pending = chain(first, rows)

    def samples(self, most: int) -> Iterator[tuple[float, NDArray[np.float64], bool]]:
        """Yield samples in small groups.

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
            If too many rows or cells are garbage.
        """
        waiting: list[NDArray[np.float64]] = []
        last, gap = self.start_time - self.sample_time, False
        for row in self._in_order():
            missing = round((float(row[0]) - last) / self.sample_time) - 1
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

    def _without_strange_start(self, first: list[_Placed]) -> list[_Placed]:
        """Return the first rows from one that most others follow. A time far in the future would end the stream."""
        while len(first) > 2:
            (place, begin), *others = first
            if 2 * sum(row[0] > begin[0] for _, row in others) >= len(others):
                break
            said = f"{TIME} must increase from row to row, but {begin[0]:g} s in row {place + 1} is ahead of later rows"
            self._leave_out(LogError(said, self._source))
            first = others
        return first

    def _in_order(self) -> Iterator[NDArray[np.float64]]:
        """Yield the rows whose time increases. A jump forward is accepted if the next row does not go back."""
        last, held = self.start_time - self.sample_time, None
        for place, row in self._pending:
            if held is not None:
                at, ahead = held
                if last < row[0] < ahead[0]:
                    self._leave_out(self._goes_back_error(float(row[0]), float(ahead[0]), at))
                else:
                    yield ahead
                    last = float(ahead[0])
                held = None
            time = float(row[0])
            if not (time - last) / self.sample_time > LEAST_FORWARD_STEP:
                self._leave_out(self._goes_back_error(time, last, place))
            elif time - last > LONGEST_GAP + self.sample_time:
                held = place, row
            else:
                yield row
                last = time
        if held is not None:
            yield held[1]

    def _goes_back_error(self, time: float, last: float, place: int) -> LogError:
        said = f"{TIME} must increase from row to row, got {time:g} s after {last:g} s in row {place + 1}"
        return LogError(said, self._source)

    def _leave_out(self, error: LogError) -> None:
        """Count bad rows and cells.

        Raises
        ------
        LogError
            As given, where there is too much of it.
        """
        self._allowed -= 1.0
        if self._allowed < 0.0:
            raise error
        self.left_out += 1
        self.first_left_out = self.first_left_out or error.message

    def _rows(self) -> Iterator[tuple[int, NDArray[np.float64]]]:
        """Yield rows with their number below the header, from 0."""
        for line in self._lines:
            if not line.strip():
                continue
            cells = line.rstrip("\r\n").split(self._delimiter)
            if '"' in line:
                cells = self._quoted(line) or []
            if not line.endswith(("\n", "\r")):  # it may be cut off within a number
                self.cut = True
                return
            place, self._row = self._row, self._row + 1
            if len(cells) != self._width:
                self._leave_out(wrong_width(self._source, self._width, len(cells), place))
                continue
            row, wrong = np.full(len(self._columns), np.nan), None
            for k, column in enumerate(self._columns):
                try:
                    row[k] = self._value(column, cells[column.position], place)
                except LogError as error:
                    wrong = wrong or error
            if wrong is not None:
                self._leave_out(wrong)
            if row[0] == row[0]:
                self._allowed = min(self._allowed + MOST_STRANGE, MOST_GARBAGE)
                yield place, row

    def _quoted(self, line: str) -> list[str] | None:
        """Return the cells of a line with quotes; None if it is empty or breaks the rules of CSV."""
        try:
            return next(csv.reader([line], delimiter=self._delimiter))
        except (csv.Error, StopIteration):
            return None

    def _value(self, column: Column, cell: str, place: int) -> float:
        try:
            value = number(cell.replace(",", ".") if self._delimiter != "," else cell)
        except ValueError as error:
            raise not_a_number(self._source, column.name, place, cell) from error
        if value in (float("inf"), float("-inf")) or (column.channel == TIME and value != value):
            raise not_a_number(self._source, column.name, place, cell or "an empty cell")
        if column.channel != TIME and self._lost[column.position].is_lost(value):
            self.left_out += 1
            said = f"column {column.name[:80]!r} has {value:g} in row {place + 1}, which stands for a lost sample"
            self.first_left_out = self.first_left_out or said
            return float("nan")
        return value * column.factor + column.offset
