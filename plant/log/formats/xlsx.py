"""Excel workbooks: every sheet with rows of numbers is a table with the layout of a text log."""

import re
import warnings
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import date, datetime, time, timedelta
from itertools import islice
from pathlib import Path
from typing import Any
from zipfile import BadZipFile, ZipFile

from plant.arrays import Array
from plant.errors import LogError
from plant.log.columns import Column
from plant.log.formats.csv_cells import read_cells
from plant.log.formats.csv_layout import LINES, layout_of_lines
from plant.log.formats.extras import library
from plant.log.formats.packed import most_unpacked, too_large
from plant.log.headings import Heading, unit_or_none
from plant.log.table import Table

LONGEST_ROW = 8 << 20
"""Bytes of a row: a sheet has 16,384 columns, and a row is held as a whole before its first cell is seen."""

MOST_CELLS = 40_000_000
"""Cells of the largest workbook that is read; a sheet has 1,048,576 rows."""

_BLOCK = 1 << 18
_UNIT = re.compile(r"\W*(?:units?|einheit(?:en)?|unités?|unidad(?:es)?|unità|eenheid|dimension)\W*", re.IGNORECASE)
"""What a list of channels calls its column of units."""

_UNCOMPUTED = re.compile(rb"</f>\s*(?:<v>\s*</v>|<v\s*/>|</c>)")
Cells = Sequence[Sequence[Any]]


def open_xlsx(path: Path) -> tuple[Table, ...]:
    """Open an Excel workbook.

    Returns
    -------
    tuple of Table
        One a sheet that has rows of numbers.

    Raises
    ------
    LogError
        If openpyxl is not installed, it is no workbook, unpacks to more than a log does, or holds no numbers.
    """
    openpyxl = library("openpyxl", "Excel", str(path))
    uncomputed = _check_workbook(path)
    made: list[Table] = []
    units: dict[str, str] = {}
    with warnings.catch_warnings(), path.open("rb") as file:  # of a path, openpyxl would judge the suffix
        warnings.simplefilter("ignore")
        reader = openpyxl.reader.excel.ExcelReader(file, read_only=True, data_only=True, keep_links=False)
        reader.read_chartsheet = _skip_charts
        reader.read()
        book = reader.wb
        try:
            for sheet in book.worksheets:
                sheet.reset_dimensions()
                cells = _cells(sheet, str(path))
                units |= _listed_units(cells)
                if (table := _table(path, sheet.title, cells, uncomputed)) is not None:
                    made.append(table)
        finally:
            book.close()
    if not made:
        raise LogError("no sheet has rows of numbers", str(path))
    return tuple(replace(one, headings=tuple(_with_unit(heading, units) for heading in one.headings)) for one in made)


def _listed_units(rows: Cells) -> dict[str, str]:
    """Return the units that a sheet lists, by each text in their rows; one of these is the name of a channel.

    A text with several units, such as the type of a sensor, is ignored.
    """
    found = (
        (below, place)
        for below, row in enumerate(islice(rows, LINES), start=1)
        for place, cell in enumerate(row)
        if isinstance(cell, str) and _UNIT.fullmatch(cell)
    )
    first, column = next(found, (len(rows), 0))
    told: dict[str, set[str]] = {}
    for row in islice(rows, first, first + LINES):
        unit = row[column] if column < len(row) else None
        if isinstance(unit, str):
            for place, name in enumerate(row):
                if isinstance(name, str) and place != column:
                    told.setdefault(_cell_text(name), set()).add(unit.strip())
    return {name: units.pop() for name, units in told.items() if len(units) == 1}


def _with_unit(heading: Heading, units: Mapping[str, str]) -> Heading:
    """Return a heading with the unit that another sheet lists for it, if it has none."""
    if heading.unit is not None or heading.stamped or heading.name not in units:
        return heading
    return replace(heading, said=unit_or_none(units[heading.name]))


def _skip_charts(*_: object) -> None:
    """Skip a sheet of charts, which holds no cells; openpyxl fails on an empty one."""


def _check_workbook(path: Path) -> bool:
    """Refuse a workbook that decompresses to more than a log can hold; return whether formulas lack values."""
    uncomputed = False
    most = left = most_unpacked(path.stat().st_size)
    with ZipFile(path) as archive, path.open("rb") as file:
        if not any(name.startswith("xl/workbook") for name in archive.namelist()):
            raise LogError("a zip archive is no log: unpack it first", str(path))
        for one in archive.infolist():
            file.seek(one.header_offset + 26)
            lengths = file.read(4)
            if len(lengths) < 4:
                raise BadZipFile("it ends too early")
            file.seek(int.from_bytes(lengths[:2], "little") + int.from_bytes(lengths[2:], "little"), 1)
            machine, packed, row = zlib.decompressobj(-15), one.compress_size, 0
            while one.compress_type and packed > 0 and (part := file.read(min(_BLOCK, packed))):
                packed -= len(part)
                while part:
                    text = machine.decompress(part, _BLOCK)
                    left -= len(text)
                    uncomputed = uncomputed or _UNCOMPUTED.search(text) is not None
                    row = len(text) - ended if (ended := text.rfind(b"row")) >= 0 else row + len(text)
                    part = machine.unconsumed_tail
                    if left < 0:
                        raise too_large(str(path), most)
                    if row > LONGEST_ROW and one.filename.startswith("xl/worksheets/"):
                        raise LogError(f"a row of {one.filename} is longer than any of a sheet", str(path))
    return uncomputed


def _cells(sheet: Any, source: str) -> Cells:
    rows: list[Sequence[Any]] = []
    count = 0
    for row in sheet.iter_rows(values_only=True):
        rows.append(row)
        count += len(row) + 1
        if count > MOST_CELLS:
            raise LogError(f"sheet {sheet.title!r} has more than {MOST_CELLS} cells; save it as CSV", source)
    return rows


def _cell_text(cell: Any, *, of_numbers: bool = False) -> str:
    """Return a cell as in a text log. Yes or no in a column of numbers is a word."""
    if cell is None:
        return ""
    if isinstance(cell, datetime):
        return cell.isoformat(sep=" ")
    if isinstance(cell, time):
        return cell.isoformat()
    if isinstance(cell, timedelta):
        return repr(cell.total_seconds())
    if isinstance(cell, date):
        return cell.isoformat()
    if isinstance(cell, bool):
        return str(cell).upper() if of_numbers else str(int(cell))
    return " ".join(str(cell).split()) if isinstance(cell, str) else repr(cell)


def _table(path: Path, title: str, rows: Cells, uncomputed: bool = False) -> Table | None:
    """Return a sheet as a table; None if it has no rows of numbers. Its formulas may lack values."""
    width = max((len(row) for row in islice(rows, LINES)), default=0)
    while width and all(len(row) < width or row[width - 1] is None for row in islice(rows, LINES)):
        width -= 1
    if width < 2:
        return None
    lines = ["\t".join(_cell_text(cell) for cell in _fit_width(row, width)) for row in islice(rows, LINES)]
    if not any(line.strip() for line in lines):
        return None
    layout = layout_of_lines(lines, "utf-8", str(path))
    if layout.delimiter != "\t" or len(layout.headings) != width:
        return None

    below = rows[layout.skipped :]
    # durations, which were converted to seconds
    lasting = {place for row in below[:1] for place, cell in enumerate(row[:width]) if isinstance(cell, timedelta)}
    headings = tuple(replace(one, said="s") if place in lasting else one for place, one in enumerate(layout.headings))
    numeric = [any(_is_number(row[place]) for row in below if place < len(row)) for place in range(width)]

    def read(chosen: Sequence[Column]) -> dict[Column, Array]:
        for column in chosen if uncomputed else ():
            empty = sum(column.position >= len(row) or row[column.position] is None for row in below)
            if 2 * empty > len(below):
                raise LogError(
                    f"column {column.name[:80]!r} is empty in {empty} rows, and values of formulas are not stored "
                    "in the workbook: open it in Excel, save it, and try again",
                    str(path),
                )
        texts = (
            [_cell_text(cell, of_numbers=one) for cell, one in zip(_fit_width(row, width), numeric, strict=True)]
            if any(cell is not None for cell in row)
            else []
            for row in below
        )
        return read_cells(texts, layout, chosen, str(path))

    return Table(str(path), headings, read, label=title)


def _is_number(cell: Any) -> bool:
    return isinstance(cell, int | float) and not isinstance(cell, bool)


def _fit_width(row: Sequence[Any], width: int) -> list[Any]:
    return [*row[:width], *[None] * (width - len(row))]
