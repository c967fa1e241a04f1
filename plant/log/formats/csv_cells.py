"""A log of text, or of a sheet, cell by cell: which lines are rows of data, and which cell is no number."""

import re
import warnings
from array import array
from collections.abc import Iterable, Sequence
from itertools import takewhile
from typing import Any

import numpy as np

from plant.arrays import Array
from plant.errors import LogError, LogWarning
from plant.log.clock.stamps import is_stamp, read_stamps
from plant.log.columns import TRUTH, Column
from plant.log.formats.cells import MISSING, not_a_number, number, wrong_width
from plant.log.formats.csv_layout import COMMENT, Layout
from plant.log.notes import LogCode

MOST_AFTER, SHARE_AFTER = 20, 0.01
"""Lines below the last row of data that are left out: at most so many [count], and of the rows above [fraction]."""

TOGETHER = 1000
"""Rows that are put into columns at once [count]."""

_THOUSANDS = {
    ".": re.compile(r"[-+]?\d{1,3}(?:,\d{3})+\.\d*"),
    ",": re.compile(r"[-+]?\d{1,3}(?:\.\d{3})+,\d*"),
}
"""Numbers with separators of thousands, by decimal point: those that say both, for 1,234 may be either."""


def read_cells(
    rows: Iterable[Sequence[str]], layout: Layout, chosen: Sequence[Column], source: str
) -> dict[Column, Array]:
    """Return columns of rows; a line of comment, a header that comes again and a few lines at the end are left out.

    A logger that is switched off leaves its last line cut, and some write sums below the data.

    Parameters
    ----------
    rows : iterable of sequence of str
        Cells of each line below the header.
    chosen : sequence of Column
        Columns that are read; of the truth, those that hold no numbers are left out.

    Returns
    -------
    dict[Column, ndarray of shape (n,)]
        Numbers, NaN in empty cells; stamps as datetime64[ns].

    Raises
    ------
    LogError
        If a row has another width than the header, or a cell is no number, and rows of data come after it.

    Warns
    -----
    LogWarning
        If lines were left out.
    """
    names = [heading.name for heading in layout.headings]
    kept: dict[Column, Any] = {one: [] if one.position in layout.stamped else array("d") for one in chosen}
    waiting: list[list[float | str | None]] = []
    strange: list[LogError] = []
    between = taken = 0
    for row, cells in enumerate(cells for cells in rows if cells):
        first = cells[0].strip()
        comment = COMMENT.match(first) and first not in MISSING
        if comment or (first == names[0] and [cell.strip() for cell in cells] == names):
            between += 1
            continue
        try:
            values = _values(cells, layout, kept, source, row)
        except LogError as error:
            strange.append(error)
            continue
        if strange and None not in values:
            raise strange[0]
        waiting.append(values)
        if len(waiting) == TOGETHER:
            _keep(kept, waiting)
            taken += TOGETHER
            waiting.clear()
    lacking = sum(1 for _ in takewhile(lambda values: None in values, reversed(waiting)))
    taken += len(waiting) - lacking
    if len(strange) + lacking > min(MOST_AFTER, SHARE_AFTER * taken):
        if strange:
            raise strange[0]
        lacking = 0
    _keep(kept, waiting[: len(waiting) - lacking])
    if between:
        warnings.warn(LogWarning(LogCode.LINES_SKIPPED.note(count=between), source), stacklevel=2)
    if lacking or strange:
        left_out = LogCode.END_LEFT_OUT.note(count=lacking + len(strange), taken=taken)
        warnings.warn(LogWarning(left_out, source), stacklevel=2)
    return {
        one: stamps(values, one, source) if one.position in layout.stamped else _array(values)
        for one, values in kept.items()
    }


def stamps(cells: Sequence[str | None], column: Column, source: str) -> Any:
    """Return a column of dates or times of the day.

    Raises
    ------
    LogError
        If a cell is none.
    """
    return read_stamps([cell or "" for cell in cells], lambda row, cell: not_a_number(source, column.name, row, cell))


def _keep(kept: dict[Column, Any], rows: Sequence[Sequence[float | str | None]]) -> None:
    """Add rows; a column of the truth that has no number in one of them is read no further."""
    for place, column in enumerate(list(kept)):
        cells = [row[place] for row in rows]
        if None in cells:
            del kept[column]
        else:
            kept[column].extend(cells)


def _array(values: "array[float]") -> Array:
    return np.frombuffer(values, dtype=np.float64) if len(values) else np.empty(0)


def _values(
    cells: Sequence[str], layout: Layout, columns: Iterable[Column], source: str, row: int
) -> list[float | str | None]:
    """Return what a row holds; None in a column of the truth whose cell is no number."""
    if len(cells) != len(layout.headings):
        raise wrong_width(source, len(layout.headings), len(cells), row)
    found: list[float | str | None] = []
    for column in columns:
        cell = cells[column.position]
        if column.position in layout.stamped:
            if cell.strip() not in MISSING and not is_stamp(cell):
                raise not_a_number(source, column.name, row, cell)
            found.append(cell)
            continue
        try:
            found.append(_number(cell, layout.decimal_point))
        except ValueError as error:
            if not column.channel.startswith(TRUTH):
                raise not_a_number(source, column.name, row, cell) from error
            found.append(None)
    return found


def _number(cell: str, decimal_point: str) -> float:
    """Return a cell as a number, also one with its thousands apart; ValueError for others."""
    try:
        return number(cell if decimal_point == "." else cell.replace(",", "."))
    except ValueError:
        if not _THOUSANDS[decimal_point].fullmatch(cell.strip()):
            raise
        between = "," if decimal_point == "." else "."
        return float(cell.replace(between, "").replace(",", "."))
