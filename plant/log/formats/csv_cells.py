"""Reads a text log or a sheet cell by cell: which lines are rows of data, and which cells are not numbers."""

import warnings
from array import array
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from plant.arrays import Array
from plant.errors import LogError, LogWarning
from plant.log.clock.stamps import is_stamp, read_stamps
from plant.log.columns import TIME, TRUTH_PREFIX, Column
from plant.log.formats.cell_texts import is_value, without_that_unit
from plant.log.formats.cells import (
    MISSING,
    MOST_SHOWN,
    MOST_STRANGE,
    not_a_number,
    not_numbers_note,
    number,
    wrong_width,
)
from plant.log.formats.csv_column import Cells
from plant.log.formats.csv_layout import Layout
from plant.log.formats.csv_lines import COMMENT
from plant.log.formats.csv_loggers import HEADER_ENDS
from plant.log.formats.thousands import without_thousands
from plant.log.headings import unit_or_none
from plant.log.notes import LogCode
from plant.notes import Note

BLOCK_ROWS = 1000
"""Rows that are put into columns at once [count]."""


def read_cells(
    rows: Iterable[Sequence[str]], layout: Layout, chosen: Sequence[Column], source: str
) -> dict[Column, Array]:
    """Return the columns of the rows. A few lines that are not rows of data are left out.

    Comments and repeated headers are skipped. At most 1 % of all rows may have too few or too many cells, or a cell
    that is not a number. Such a row is left out if its time is unknown or if it is one of the last; otherwise only the
    cell is missing. In a log without a time column, no row within the data is left out, because the rows below it would
    come too early.

    Parameters
    ----------
    rows : iterable of sequence of str
        Cells of each line below the header, none of a blank line.
    chosen : sequence of Column
        Columns that are read; of the truth, those that hold no numbers are left out.

    Returns
    -------
    dict[Column, ndarray of shape (n,)]
        Numbers, NaN in cells that are empty or no number; stamps as datetime64[ns].

    Raises
    ------
    LogError
        If more rows are no data, more cells of a column are no numbers, or another header stands among the rows.

    Warns
    -----
    LogWarning
        If lines were left out, or cells are no numbers.
    """
    names = [one.name for one in layout.headings]
    body = _Body(layout, {one: Cells([] if one.position in layout.stamped else array("d")) for one in chosen}, source)
    block: list[_Row] = []
    row = 0
    for line, cells in enumerate(rows, start=layout.skipped + 1):
        if len(cells) != len(names) and not "".join(cells).strip():
            continue
        first = cells[0].strip().removeprefix("\ufeff")
        comment = COMMENT.match(first) and first not in MISSING
        if comment or _repeats_header([first, *cells[1:]], names):
            body.skipped += 1
        elif len(cells) == len(names):
            block.append(_Row(line, row, cells))
            if len(block) == BLOCK_ROWS:
                body.append_rows(block)
                block = []
        else:
            body.note_width(_Row(line, row, cells), len(block))
        row += 1
    body.append_rows(block)
    found, notes = body.checked_columns()
    for note in notes:
        warnings.warn(LogWarning(note, source), stacklevel=2)
    return found


def _repeats_header(cells: Sequence[str], names: Sequence[str]) -> bool:
    """Return whether a row repeats the header. A column without a name has its number as name."""
    if cells[0] not in (names[0], "") or len(cells) != len(names):
        return False
    return [cell.strip() or f"column {place + 1}" for place, cell in enumerate(cells)] == list(names)


class _Row(NamedTuple):
    """A line of the file, and its row number below the header, from 0."""

    line: int
    row: int
    cells: Sequence[str]

    @property
    def said(self) -> str:
        """Excerpt of the row for a note."""
        return ", ".join(cell.strip() for cell in self.cells)[:MOST_SHOWN]


class _StrangeRow(NamedTuple):
    """A line that is not a row of data."""

    line: int
    said: str
    error: LogError
    is_header: bool = False


@dataclass
class _Body:
    """The rows of a log during reading."""

    layout: Layout
    columns: dict[Column, Cells]
    source: str
    rows: list[tuple[int, int]] = field(default_factory=list[tuple[int, int]])
    timeless: dict[int, str] = field(default_factory=dict[int, str])
    strange: list[_StrangeRow] = field(default_factory=list[_StrangeRow])
    skipped: int = 0

    def note_width(self, row: _Row, waiting: int) -> None:
        """Remember a row of another width; refuse the log if most of its rows have one."""
        wanted, got = len(self.layout.headings), len(row.cells)
        is_header = row.cells[0].startswith(HEADER_ENDS) or (got == wanted - 1 and _is_header(row.cells))
        error = self._header_error(row) if is_header else wrong_width(self.source, wanted, got, row.row)
        self.strange.append(_StrangeRow(row.line, row.said, error, is_header))
        if len(self.strange) > BLOCK_ROWS + len(self.rows) + waiting:
            raise self.strange[0].error

    def append_rows(self, block: Sequence[_Row]) -> None:
        """Append rows to the columns, without repeated headers and units."""
        odd = {place for column in self.columns for place in self._read(column, self._cells(column, block))[1]}
        headers = {place for place in odd if _is_header(block[place].cells)}
        for row in (block[place] for place in sorted(headers)):
            if self._repeats_units(row.cells):
                self.skipped += 1
                continue
            self.strange.append(_StrangeRow(row.line, row.said, self._header_error(row), is_header=True))
        kept = [row for place, row in enumerate(block) if place not in headers]
        for column, cells in self.columns.items():
            texts = self._cells(column, kept)
            values, bad = self._read(column, texts)
            for place in bad:
                cells.bad[len(self.rows) + place] = kept[place].cells[column.position]
                if column.channel == TIME:
                    self.timeless[len(self.rows) + place] = kept[place].said
            cells.values.extend(values)
            if column.position not in self.layout.stamped:
                cells.note_parted(texts, len(self.rows), self.layout.decimal_point)
        self.rows.extend((row.line, row.row) for row in kept)

    def _header_error(self, row: _Row) -> LogError:
        return LogError(
            f"every row must hold numbers, got another header in row {row.row + 1} ({row.said!r}), counted below "
            "the first; save what stands below it as a log of its own",
            self.source,
        )

    def _repeats_units(self, cells: Sequence[str]) -> bool:
        units = [unit_or_none(cell.strip().strip("[]()")) for cell in cells]
        return any(one.said for one in self.layout.headings) and all(
            one.stamped or one.said == unit for one, unit in zip(self.layout.headings, units, strict=True)
        )

    def _cells(self, column: Column, rows: Sequence[_Row]) -> list[str]:
        """Return the cells of a column without the unit that follows each number."""
        cells = [row.cells[column.position] for row in rows]
        unit = self.layout.in_cells.get(column.position)
        return cells if unit is None else [without_that_unit(cell, unit) for cell in cells]

    def _read(self, column: Column, cells: list[str]) -> tuple[list[Any], list[int]]:
        """Return values of some rows, and the places of cells that are no numbers."""
        if column.position in self.layout.stamped:
            bad = [place for place, cell in enumerate(cells) if cell.strip() not in MISSING and not is_stamp(cell)]
            return [cell if cell.strip() else "" for cell in cells], bad
        point = self.layout.decimal_point
        joined = "\n".join(cells)
        if "_" not in joined and cells:
            try:
                values = list(map(float, (joined if point == "." else joined.replace(",", ".")).split("\n")))
            except ValueError:
                pass
            else:
                return values, []
        values, bad = [], []
        for place, cell in enumerate(cells):
            try:
                values.append(_number(cell, point))
            except ValueError:
                values.append(float("nan"))
                bad.append(place)
        return values, bad

    def checked_columns(self) -> tuple[dict[Column, Array], list[Note]]:
        """Return the columns without bad rows, and what was left out. Refuse a log with too many bad rows."""
        for column, cells in self.columns.items():
            cells.settle(column, self.layout.decimal_point, self.source)
            if column.channel == TIME:
                self.timeless = {row: said for row, said in self.timeless.items() if row in cells.bad}
        found = {one: self._values(one, cells) for one, cells in self.columns.items()}
        allowed = MOST_STRANGE * len(self.rows)
        for column in [one for one in found if len(self.columns[one].bad) > allowed]:
            if column.channel.startswith(TRUTH_PREFIX):
                del found[column]
        bad = set[int]().union(*(self.columns[one].bad for one in found))
        taken = len(self.rows)
        while taken - 1 in bad:
            taken -= 1
        last = self.rows[taken - 1][0] if taken else 0
        within = [one for one in self.strange if one.line < last]
        self._note_out_of_order(found)
        # a single line below the data marks its end, however short the log is
        below = len(self.rows) - taken + len(self.strange) - len(within)
        self._refuse(found, within, taken, allowed, spared=below == 1)
        timeless = {row: said for row, said in self.timeless.items() if row < taken}
        notes = self._notes(found, taken, within, timeless)
        if below:
            notes.append(LogCode.END_LEFT_OUT.note(count=below, taken=taken))
        return {one: np.delete(values[:taken], sorted(timeless)) for one, values in found.items()}, notes

    def _may_leave_out(self) -> bool:
        """Return whether rows may be left out: each has a time of its own, or they are only shown."""
        channels = [one.channel for one in self.columns]
        return TIME in channels or all(one.startswith(TRUTH_PREFIX) for one in channels)

    def _values(self, column: Column, cells: Cells) -> Any:
        if column.position not in self.layout.stamped:
            return np.frombuffer(cells.values, dtype=np.float64) if len(cells.values) else np.empty(0)

        def refuse(row: int, cell: str) -> None:  # the cell looks like a stamp, but is no valid time, such as day 93
            cells.bad[row] = cell
            if column.channel == TIME:
                self.timeless[row] = cell

        return read_stamps(["" if row in cells.bad else one for row, one in enumerate(cells.values)], refuse)

    def _note_out_of_order(self, found: Mapping[Column, Any]) -> None:
        """Count a row with a text cell as bad if its time does not lie between those of its neighbours."""
        for time in (values for column, values in found.items() if column.channel == TIME):
            for bad in (self.columns[column].bad for column in found):
                for row, cell in bad.items():
                    here = time[row]
                    late = row + 1 < len(time) and here >= time[row + 1]
                    if (late or (row and here <= time[row - 1])) and row not in self.timeless:
                        self.timeless[row] = cell

    def _refuse(
        self, found: Iterable[Column], within: Sequence[_StrangeRow], taken: int, allowed: float, *, spared: bool
    ) -> None:
        """Refuse rows if too many are not data. The error names the first one, or a repeated header if there is one."""
        for one in within:
            if one.is_header:
                raise one.error
        reasons: list[tuple[int, LogError]] = []
        if (count := len(self.strange) + len(self.timeless) - spared) > allowed:
            total = len(self.rows) + len(self.strange)
            more = f"; {count} of {total} rows cannot be read, at most 1 % may be so"
            reasons += [(one.line, LogError(f"{one.error.message}{more}", self.source)) for one in self.strange[:1]]
        for column in found:
            bad = self.columns[column].bad
            if len(bad) - (spared and taken in bad) > allowed:
                place = min(bad)
                line, row = self.rows[place]
                stamped = column.position in self.layout.stamped
                reasons.append((line, not_a_number(self.source, column.name, row, bad[place], stamped=stamped)))
        if reasons:
            raise min(reasons, key=lambda one: one[0])[1]
        if within and not self._may_leave_out():
            raise within[0].error

    def _notes(
        self, found: Iterable[Column], taken: int, within: Sequence[_StrangeRow], timeless: Mapping[int, str]
    ) -> list[Note]:
        notes = [LogCode.LINES_SKIPPED.note(count=self.skipped)] if self.skipped else []
        left = [(one.line, one.said) for one in within]
        if left := [*left, *((self.rows[row][0], said) for row, said in timeless.items())]:
            line, said = min(left)
            notes.append(LogCode.ROWS_LEFT_OUT.note(count=len(left), line=line, said=said))
        for column in found:
            bad = self.columns[column].bad
            if rows := sorted(row for row in bad if row < taken and row not in timeless):
                notes.append(not_numbers_note(column.name, len(rows), "line", self.rows[rows[0]][0], bad[rows[0]]))
        return notes


def _is_header(cells: Sequence[str]) -> bool:
    """Return whether a row looks like a header: different texts and no number."""
    texts = {cell.strip() for cell in cells} - set(MISSING)
    return len(texts) > 1 and not any(map(is_value, texts))


def _number(cell: str, decimal_point: str) -> float:
    """Return a cell as a number, with or without separators of thousands; ValueError for others."""
    try:
        return number(cell if decimal_point == "." else cell.replace(",", "."))
    except ValueError:
        if (plain := without_thousands(cell, decimal_point)) is None:
            raise
        return float(plain)
