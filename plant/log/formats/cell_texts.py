"""Contents of a text cell: a number, a number with its unit, a stamp, or a word for a missing value."""

import re
from collections.abc import Sequence
from functools import lru_cache

from plant.log.clock.stamps import is_stamp
from plant.log.formats.cells import MISSING
from plant.log.formats.thousands import GROUPS
from plant.log.headings import is_unit

_GROUPED = rf"{GROUPS}(?:[.,]\d*)?|\d{{1,3}}(?:(?:,\d{{3}})+(?:\.\d*)?|(?:\.\d{{3}})+(?:,\d*)?)"
_DIGITS = rf"[-+\u2212]?(?:\d+[.,]?\d*|[.,]\d+|{_GROUPED})(?:[eEdD][-+]?\d+)?"
NUMBER = re.compile(_DIGITS)
"""A number, with a decimal comma or point, and with its thousands apart or not."""

_NUMBER_WITH_UNIT = re.compile(rf"(?P<number>{_DIGITS})\s*(?P<unit>[^\W\d_].*|[%°\[].*)")
"""A number and what may be its unit, in one cell."""


def is_value(cell: str) -> bool:
    """Return whether a cell is data: a number with or without a unit, a stamp, or a word for a missing value."""
    text = cell.strip()
    if not text or len(text) > 60:
        return False
    plain = bool(NUMBER.fullmatch(text)) or text in MISSING or text.lower() in ("inf", "-inf")
    return plain or bool(unit_behind(text)) or is_stamp(text)


def is_text(cell: str) -> bool:
    """Return whether a cell is neither empty nor data."""
    return bool(cell.strip()) and not is_value(cell)


def unit_behind(cell: str) -> str:
    """Return the unit that follows the number in a cell; empty if there is none.

    Examples
    --------
    >>> unit_behind("12.3 mm/s"), unit_behind("9.81 m/s^2"), unit_behind("12.3"), unit_behind("12 pieces")
    ('mm/s', 'm/s^2', '', '')
    """
    last, before = cell[-1:], cell[-2:-1]
    ends_as_unit = last.isalpha() or last in "%°²³]" or before.isalpha() or before in "^-"
    if not ends_as_unit or NUMBER.fullmatch(cell):
        return ""
    _, unit = split_unit(cell)
    return unit if unit and _is_known_unit(unit) else ""


def split_unit(text: str) -> tuple[str, str]:
    """Return a number as written, and the text that follows it; that text is empty if the cell is not such a pair.

    Examples
    --------
    >>> split_unit("1,08 L"), split_unit("8cc/rev"), split_unit("30"), split_unit("bar")
    (('1,08', 'L'), ('8', 'cc/rev'), ('30', ''), ('bar', ''))
    """
    found = _NUMBER_WITH_UNIT.fullmatch(text)
    return (found["number"], found["unit"]) if found else (text, "")


@lru_cache(maxsize=256)
def _is_known_unit(text: str) -> bool:
    return is_unit(text)


def without_unit(cell: str) -> str:
    """Return a cell without the unit that follows its number."""
    return cell.removesuffix(unit_behind(cell)).rstrip()


def without_that_unit(cell: str, unit: str) -> str:
    """Return a cell of a column with one unit, without that unit. Words for missing values stay complete.

    Examples
    --------
    >>> without_that_unit(" 12.3 N", "N"), without_that_unit("NaN", "N"), without_that_unit("N/A", "A")
    ('12.3', 'NaN', 'N/A')
    """
    text = cell.strip()
    return text if text in MISSING else text.removesuffix(unit).rstrip()


def mostly_stamps(cells: Sequence[str]) -> bool:
    """Return whether most cells are dates or times of the day.

    Examples
    --------
    >>> mostly_stamps(["12:00:00", "12:00:01", ""]), mostly_stamps(["20260301", "20260302"])
    (True, False)
    """
    return 2 * sum(is_stamp(cell) and not NUMBER.fullmatch(cell) for cell in cells) > len(cells)


def is_data_row(cells: Sequence[str], width: int) -> bool:
    """Return whether a line is a row of data, though a broken one: not names, of which some may be numbers.

    Examples
    --------
    >>> is_data_row(["0.0", "oops", "oops"], 3), is_data_row(["time", "speed", "3"], 3), is_data_row(["0.0"], 3)
    (True, False, False)
    """
    texts = {cell.strip() for cell in cells if not NUMBER.fullmatch(cell.strip()) and not is_stamp(cell)} - {""}
    return len(cells) == width and sum(cell.strip() not in {*texts, ""} for cell in cells) >= max(len(texts), 1)


def is_label_row(row: Sequence[str], numeric: Sequence[bool]) -> bool:
    """Return whether a cell in a column of numbers is text, as in ``Rate, 1000``.

    Parameters
    ----------
    row : sequence of str
        Cells.
    numeric : sequence of bool
        Whether their column holds numbers.

    Examples
    --------
    >>> is_label_row(["Rate", "1000"], [True, True]), is_label_row(["ok", "1000"], [False, True])
    (True, False)
    """
    return any(one and cell and not is_value(cell) for one, cell in zip(numeric, row, strict=True))
