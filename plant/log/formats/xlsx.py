"""Excel workbooks: every sheet with rows of numbers is a table, laid out as a text log would be."""

import zlib
from collections.abc import Sequence
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
from plant.log.table import Table

LONGEST_ROW = 8 << 20
"""Bytes of a row: a sheet has 16,384 columns, and a row is held as a whole before its first cell is seen."""

MOST_CELLS = 40_000_000
"""Cells of the largest workbook that is read; a sheet has 1,048,576 rows."""

_BLOCK = 1 << 18
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
    _bounded(path)
    import warnings

    made: list[Table] = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        book = openpyxl.load_workbook(path, read_only=True, data_only=True, keep_links=False)
        try:
            for sheet in book.worksheets:
                sheet.reset_dimensions()
                if (table := _table(path, sheet.title, _cells(sheet, str(path)))) is not None:
                    made.append(table)
        finally:
            book.close()
    if not made:
        raise LogError("no sheet has rows of numbers", str(path))
    return tuple(made)


def _bounded(path: Path) -> None:
    """Refuse what unpacks to more than a log does, whatever the archive says of its sizes."""
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
                    row = len(text) - ended if (ended := text.rfind(b"row")) >= 0 else row + len(text)
                    part = machine.unconsumed_tail
                    if left < 0:
                        raise too_large(str(path), most)
                    if row > LONGEST_ROW and one.filename.startswith("xl/worksheets/"):
                        raise LogError(f"a row of {one.filename} is longer than any of a sheet", str(path))


def _cells(sheet: Any, source: str) -> Cells:
    rows: list[Sequence[Any]] = []
    count = 0
    for row in sheet.iter_rows(values_only=True):
        rows.append(row)
        count += len(row) + 1
        if count > MOST_CELLS:
            raise LogError(f"sheet {sheet.title!r} has more than {MOST_CELLS} cells; save it as CSV", source)
    return rows


def _said(cell: Any) -> str:
    """Return a cell as a text log would have it."""
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
        return str(int(cell))
    return " ".join(str(cell).split()) if isinstance(cell, str) else repr(cell)


def _table(path: Path, title: str, rows: Cells) -> Table | None:
    """Return a sheet as a table, None where it has no rows of numbers."""
    width = max((len(row) for row in islice(rows, LINES)), default=0)
    while width and all(len(row) < width or row[width - 1] is None for row in islice(rows, LINES)):
        width -= 1
    if width < 2:
        return None
    lines = ["\t".join(_said(cell) for cell in _wide(row, width)) for row in islice(rows, LINES)]
    if not any(line.strip() for line in lines):
        return None
    layout = layout_of_lines(lines, "utf-8", str(path))
    if layout.delimiter != "\t" or len(layout.headings) != width:
        return None

    def read(chosen: Sequence[Column]) -> dict[Column, Array]:
        texts = (
            [_said(cell) for cell in _wide(row, width)] if any(cell is not None for cell in row) else []
            for row in rows[layout.skipped :]
        )
        return read_cells(texts, layout, chosen, str(path))

    return Table(str(path), layout.headings, read, label=title)


def _wide(row: Sequence[Any], width: int) -> list[Any]:
    return [*row[:width], *[None] * (width - len(row))]
