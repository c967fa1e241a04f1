"""Remembers layouts of CSV logs, so that only the first of many similar files in a folder is analysed.

A file has a known layout if its bytes up to the first row of data are the same, and if its rows are plain numbers in as
many columns, with decimal points and commas between them. Everything that decides a layout is then the same.
"""

import re
from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from plant.log.formats.csv_layout import Layout

MOST_KEPT = 8
"""Headers that are remembered; when another one comes all of them are forgotten [count]."""

MOST_ABOVE = 20
"""Lines above the data that a remembered header has at most [count]."""

FEWEST_COLUMNS = 3
"""Two columns of whole numbers may be one with a decimal comma [count]."""

FEWEST_ROWS = 100
"""Rows of plain numbers that must follow: many more than lines above them, so that they alone decide [count]."""

_NUMBER = rb"[-+]?\d{1,17}(?:\.\d{0,35})?(?:[eE][-+]?\d{1,3})?"
"""No longer than a cell that is read as a number."""

_seen: dict[bytes, "Layout"] = {}


def remembered_layout(start: bytes, lines: int) -> "Layout | None":
    """Return the layout of an earlier file with the same header.

    Parameters
    ----------
    start : bytes
        What a file begins with.
    lines : int
        Lines of it that would be looked at.
    """
    for header, layout in _matching_layouts(start).items():
        if _has_plain_rows(start, header, layout, lines):
            return layout
    return None


def _matching_layouts(start: bytes) -> Mapping[bytes, "Layout"]:
    return {header: layout for header, layout in tuple(_seen.items()) if start.startswith(header)}


def remember_layout(start: bytes, lines: int, layout: "Layout") -> None:
    """Keep a layout for files with the same header.

    Parameters
    ----------
    start : bytes
        What its file begins with.
    lines : int
        Lines of it that were looked at.
    layout : Layout
        How it is written.
    """
    usual = layout.delimiter == "," and layout.decimal_point == "." and layout.encoding == "utf-8"
    if not usual or layout.stamped or layout.skipped > MOST_ABOVE or len(layout.headings) < FEWEST_COLUMNS:
        return
    header = b"".join(line + b"\n" for line in start.split(b"\n", layout.skipped)[: layout.skipped])
    if header.count(b"\r") == header.count(b"\r\n") and _has_plain_rows(start, header, layout, lines):
        if len(_seen) >= MOST_KEPT:
            _seen.clear()
        _seen[header] = layout


def _has_plain_rows(start: bytes, header: bytes, layout: "Layout", lines: int) -> bool:
    """Return whether all inspected lines below the header are rows of plain numbers."""
    wanted = lines - layout.skipped
    found = _rows(len(layout.headings), wanted).match(start, len(header))
    if found is None:
        return False
    rows = start.count(b"\n", len(header), found.end())
    return rows >= FEWEST_ROWS and (rows == wanted or found.end() == len(start))


@cache
def _rows(columns: int, most: int) -> re.Pattern[bytes]:
    return re.compile(rb"(?:(?:%b,){%d}%b\r?\n){1,%d}+" % (_NUMBER, columns - 1, _NUMBER, most))
