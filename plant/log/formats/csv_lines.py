"""The cells of a line of a text log, and the lines of names and units right above its data."""

import csv
import re
from collections.abc import Sequence

from plant.log.formats.cell_texts import is_text
from plant.log.headings import begins_with_time, is_unit_row

BLANKS = " "
"""The delimiter of a log whose cells are apart by any number of blanks."""

COMMENT = re.compile(r"^\s*(?:#|%|//)\s*")
"""How a line of comment begins."""


def cells_of(line: str, delimiter: str) -> list[str]:
    """Return the cells of a line."""
    if delimiter == BLANKS:
        return line.split()
    if line.count('"') % 2 or '"' not in line:  # an unclosed quote is an ordinary character
        return line.split(delimiter)
    try:
        return next(csv.reader([line], delimiter=delimiter))
    except (csv.Error, StopIteration):
        return line.split(delimiter)


def lines_above(lines: Sequence[str], delimiter: str, width: int, *, closed: bool) -> list[list[str]]:
    """Return the lines right above the data that are as wide as it, from the top.

    A delimiter may close every row of data and not the header, or the header alone.
    """
    found: list[list[str]] = []
    for line in reversed(lines):
        if not line.strip():
            if found:
                break
            continue
        plain = COMMENT.sub("", line)
        cells = [cell.strip().removeprefix("\ufeff") for cell in cells_of(plain, delimiter)]
        if delimiter == BLANKS and len(cells) != width:
            cells = [cell.strip() for cell in re.split(r"\s{2,}|\t", plain.strip())]
        if (closed and len(cells) == width - 1) or (1 < len(cells) < width and begins_with_time(cells)):
            cells += [""] * (width - len(cells))
        cells = cells[:-1] if len(cells) == width + 1 and not cells[-1] else cells
        if len(cells) != width or not any(cells):
            break
        found.insert(0, cells)
    return found


def unplaced_names(lines: Sequence[str], delimiter: str, width: int) -> tuple[str, ...]:
    """Return the names right above data that have another number of columns; empty if that line holds something else.

    Parameters
    ----------
    lines : sequence of str
        Those above the data.
    delimiter : str
        Between cells.
    width : int
        Columns of the data.

    Examples
    --------
    >>> unplaced_names(["time,u,y,spare"], ",", 3), unplaced_names(["Bench 2, run, 5"], ",", 2)
    (('time', 'u', 'y', 'spare'), ())
    """
    split = ([cell.strip() for cell in cells_of(COMMENT.sub("", line), delimiter)] for line in reversed(lines))
    names = next((cells for cells in split if any(cells) and not is_unit_row(cells)), [])
    while names and not names[-1]:
        names.pop()
    # a title may have a comma
    several = len(names) > 2 or (len(names) == 2 and not any(" " in name for name in names))
    told = several and all(map(is_text, names)) and len(set(names)) == len(names)
    return tuple(names) if told and width <= 2 * len(names) <= 4 * width else ()
