"""Separators of thousands: removed where they are certain, refused elsewhere."""

import re
from collections.abc import Iterable, Sequence

import numpy as np

from plant.arrays import Array
from plant.errors import LogError

THOUSANDS_SEPARATORS = " '\u2019\u00a0\u2009\u202f"
"""What separates thousands and can be no decimal sign: blanks of several widths, and apostrophes as the Swiss write."""

GROUPS = rf"\d{{1,3}}(?P<apart>[{THOUSANDS_SEPARATORS}])\d{{3}}(?:(?P=apart)\d{{3}})*"
"""A whole number with such separators, as a part of a regular expression."""

_UNAMBIGUOUS = {
    point: re.compile(
        rf"[-+\u2212]?(?:{GROUPS}(?:{one}\d*)?|\d{{1,3}}(?:{by}\d{{3}}){{2,}}|\d{{1,3}}(?:{by}\d{{3}})+{one}\d*)"
    )
    for point, one, by in ((".", r"\.", ","), (",", ",", r"\."))
}
"""Numbers whose separators of thousands can be nothing else, by decimal point: 1,234 may be either."""

_PARTS = re.compile(rf"[{THOUSANDS_SEPARATORS}]")

_GROUPED = re.compile(r"[-+\u2212]?[1-9]\d{0,2}[.,]\d{3}")
_SMALL = re.compile(r"[-+\u2212]?\d{1,3}")
_WHOLE = re.compile(r"[-+\u2212]?\d+")
_SMALL_OR_GROUPED = re.compile(rf"{_SMALL.pattern}|{_GROUPED.pattern}")

FEWEST_CELLS = 30
"""Cells with a separator from which a column may be judged [count]: decimals of as many would not all be three."""


def without_thousands(cell: str, decimal_point: str) -> str | None:
    """Return a number with a decimal point and no separators of thousands; None if they may be decimal signs.

    Parameters
    ----------
    cell : str
        Such as 1'234.5.
    decimal_point : str
        Of the log.

    Examples
    --------
    >>> without_thousands("1'234.5", "."), without_thousands("1.234.567", ","), without_thousands("1,234", ".")
    ('1234.5', '1234567', None)
    """
    text = cell.strip()
    if not _UNAMBIGUOUS[decimal_point].fullmatch(text):
        return None
    other = "," if decimal_point == "." else "."
    return _PARTS.sub("", text).replace(other, "").replace(",", ".").replace("\u2212", "-")


def decimal_point_of(numbers: Iterable[str]) -> str:
    """Return the decimal sign of numbers with points, commas or both.

    Parameters
    ----------
    numbers : iterable of str
        As they are written.

    Returns
    -------
    str
        A comma if no number has a point, or if all points, but not all commas, can only part thousands.

    Examples
    --------
    >>> decimal_point_of(["0,5", "12"]), decimal_point_of(["0,5", "1.2"]), decimal_point_of(["0,5", "12.500"])
    (',', '.', ',')
    """
    found = list(numbers)
    commas = [one for one in found if "," in one]
    points = [one for one in found if "." in one]
    if not commas or not points:
        return "," if commas else "."
    whole = all(is_grouped(one) or without_thousands(one, ",") for one in points)
    return "," if whole and not all(is_grouped(one) or without_thousands(one, ".") for one in commas) else "."


def groups_thousands(cells: Sequence[str]) -> bool:
    """Return whether a column holds whole numbers with separators of thousands, such as 998 and 1,002.

    Decimals have other numbers of digits after the comma, or a zero before it.

    Parameters
    ----------
    cells : sequence of str
        Numbers of a column, as text.

    Examples
    --------
    >>> groups_thousands(["998", "1,002"] * 40), groups_thousands(["0", "0,998", "1,002"] * 40)
    (True, False)
    """
    if not all(map(_SMALL_OR_GROUPED.fullmatch, cells)):
        return False
    return FEWEST_CELLS <= sum(map(is_grouped, cells)) < len(cells)


def is_grouped(cell: str) -> bool:
    """Return whether a cell may have separators of thousands, or three decimals: 1.002, not 0.998 or 1.02."""
    return _GROUPED.fullmatch(cell) is not None


def may_group_thousands(values: Array) -> bool:
    """Return whether numbers read as decimals may be whole ones, such as 998 and 1.002. Only their text decides.

    Parameters
    ----------
    values : ndarray, shape (n,)
        A column; NaN where nothing was measured.

    Examples
    --------
    >>> may_group_thousands(np.tile([998.0, 1.002], 40)), may_group_thousands(np.tile([998.0, 1.02, 0.5], 40))
    (True, False)
    """
    if not _all_grouped(values[-1000:]) or not _all_grouped(values):
        return False
    known = values[np.isfinite(values)]
    small = known == np.trunc(known)
    return bool(small.any()) and bool((np.abs(known[small]) < 1000.0).all()) and int((~small).sum()) >= FEWEST_CELLS


def _all_grouped(values: Array) -> bool:
    known = values[np.isfinite(values)]
    parted = np.abs(known[known != np.trunc(known)])
    thousands = 1e3 * parted
    return bool((parted > 1.0).all() and (np.abs(thousands - np.rint(thousands)) < 1e-9 * thousands).all())


def thousands_error(name: str, shown: str, source: str) -> LogError:
    """Return the error for a column whose numbers have separators of thousands.

    Parameters
    ----------
    name, shown : str
        The column, and a cell of it.
    source : str
        What messages call the log.
    """
    return LogError(
        f"column {name[:80]!r} has separators of thousands, as in {shown!r}, which cannot be told from "
        "decimals everywhere; write the log without them",
        source,
    )


def require_ungrouped(rows: Sequence[Sequence[str]], names: Sequence[str], source: str) -> None:
    """Refuse rows in which a column of numbers has separators of thousands.

    Parameters
    ----------
    rows : sequence of sequence of str
        Cells, all rows as wide as there are names.
    names : sequence of str
        What the columns are called.
    source : str
        What messages call the log.

    Raises
    ------
    LogError
        If a column does, by its name.
    """
    for name, cells in zip(names, zip(*rows, strict=True), strict=False):  # without rows there are no columns
        require_none_grouped(cells, name, source)


def require_none_grouped(cells: Iterable[str], name: str, source: str) -> None:
    """Refuse a column whose numbers have separators of thousands.

    Parameters
    ----------
    cells : iterable of str
        All of the column.
    name, source : str
        The column, and the log, for messages.

    Raises
    ------
    LogError
        If they have.
    """
    filled = [cell for cell in cells if cell]
    if groups_thousands(filled):
        raise thousands_error(name, next(cell for cell in filled if not _SMALL.fullmatch(cell)), source)


def require_decimal_points(rows: Sequence[Sequence[str]], above: Sequence[str], source: str) -> None:
    """Refuse rows in which commas split numbers: two whole numbers below each name.

    ``0,05,1,2`` below two names is such a row. A fraction has no sign, and one that begins with a zero is certain.
    Whole numbers below a title are not refused.

    Parameters
    ----------
    rows : sequence of sequence of str
        Cells between commas.
    above : sequence of str
        Cells of the line above.
    source : str
        What messages call the log.

    Raises
    ------
    LogError
        If the rows are such.
    """
    wide = len(above)
    if wide < 2 or any(len(row) != 2 * wide for row in rows) or any(_WHOLE.fullmatch(one.strip()) for one in above):
        return
    fractions = [cell.strip() for row in rows for cell in row[1::2]]
    whole = all(_WHOLE.fullmatch(cell.strip()) for row in rows for cell in row)
    if whole and all(one.isdigit() for one in fractions) and any(len(one) > 1 and one[0] == "0" for one in fractions):
        raise LogError(
            f"every row must have {wide} cells as the header has, got {2 * wide}: a comma is the decimal sign here, "
            "and stands between cells too; export the log with semicolons between cells, or with decimal points",
            source,
        )
