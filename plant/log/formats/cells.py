"""Converts cells of a log to numbers: which are numbers, which are missing values, and which are refused."""

import re
import warnings
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from plant.arrays import Array
from plant.errors import LogError, LogWarning, TextColumnError
from plant.log.columns import TRUTH_PREFIX, Column
from plant.log.notes import LogCode
from plant.notes import Note

MISSING = (
    *("", "NaN", "nan", "NAN", "-NaN", "-nan", "NA", "N/A", "n/a", "NULL", "null", "None"),
    *("-", "--", "---", "OL", "#N/A", "#NUM!", "#DIV/0!", "#VALUE!", "#REF!"),
    *("1.#QNAN", "1.#IND", "-1.#IND", "-nan(ind)"),
)
"""Cells that say that nothing was measured, as loggers, multimeters, spreadsheets and C write it."""

_FORTRAN = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)[dD][-+]?\d+")
"""A number in double precision, as Fortran writes it."""

MOST_STRANGE = 0.01
"""Cells of a column that may be no numbers, or rows that are no data, of all rows of a log [fraction]."""

STAMP = "2026-03-04 12:00:00.001"
"""A time as every reader takes it, for errors."""

MOST_SHOWN = 60
"""Characters that a note shows of what is no number [count]."""


def number(text: str) -> float:
    """Return a text cell as a number; NaN if it is empty or a word for a missing value.

    Returns
    -------
    float
        Its value.

    Raises
    ------
    ValueError
        If the text is not a number.
    """
    cell = text.strip()
    if cell in MISSING:
        return float("nan")
    if "_" in cell:  # Python reads 1_000 as a number, but no logger writes it
        raise ValueError(cell)
    if _FORTRAN.fullmatch(cell):
        cell = cell.upper().replace("D", "E")
    return float(cell.replace("\u2212", "-") if "\u2212" in cell else cell)  # .NET writes this minus sign in Swedish


def numbers(values: NDArray[Any], name: str, source: str) -> Array:
    """Return a column as floats, shape (n,), with NaN for missing values and for a few cells that are not numbers.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Numbers, or objects and text that may be numbers.
    name, source : str
        The column and the log, for messages.

    Returns
    -------
    ndarray, shape (n,)
        The numbers.

    Raises
    ------
    LogError
        If the column is not one-dimensional, or over 1 % of the values are no real numbers; it names the first.

    Warns
    -----
    LogWarning
        If a few values, at most 1 %, are no real numbers.
    """
    if values.ndim != 1:
        raise LogError(f"column {name[:80]!r} must be one-dimensional, got shape {values.shape}", source)
    if values.dtype.kind == "c":
        if (imaginary := np.imag(values) != 0.0).any():
            row = int(np.argmax(imaginary))
            raise not_a_number(source, name, row, values[row])
        values = np.real(values)
    if values.dtype.kind in "fiub":
        return np.ascontiguousarray(values, dtype=np.float64)
    out = np.empty(len(values))
    bad: list[int] = []
    for row, value in enumerate(values):
        try:
            out[row] = np.nan if value is None else number(value) if isinstance(value, str) else float(value)
        except (TypeError, ValueError):
            out[row] = np.nan
            bad.append(row)
    if len(bad) > MOST_STRANGE * len(values):
        raise not_a_number(source, name, bad[0], values[bad[0]])
    if bad:
        note = not_numbers_note(name, len(bad), "row", bad[0] + 1, str(values[bad[0]]))
        warnings.warn(LogWarning(note, source), stacklevel=2)
    return out


def values_of(name: str, given: Any, source: str) -> Any:
    """Return a user's column as an array, with NaN for masked values.

    Parameters
    ----------
    name : str
        What the column is called.
    given : array_like
        Its values; a quantity of `pint` is returned as it is.
    source : str
        What messages call the log.

    Raises
    ------
    LogError
        If it is a list of lists of several lengths.

    Examples
    --------
    >>> values_of("position_m", np.ma.masked_array([1, 2], mask=[False, True]), "the table").tolist()
    [1.0, nan]
    """
    if hasattr(given, "magnitude") and hasattr(given, "to"):
        return given
    try:
        values = np.asarray(given)
    except ValueError:
        raise LogError(f"column {name[:80]!r} must be one-dimensional, got rows of several lengths", source) from None
    hidden = getattr(given, "mask", None)
    if hidden is not None and hasattr(given, "filled") and np.any(hidden):
        if values.dtype.kind == "M":
            return np.where(hidden, np.datetime64("NaT"), values)
        return np.where(hidden, np.nan if values.dtype.kind in "fiubc" else None, values)  # pyright: ignore[reportCallIssue, reportArgumentType]
    # a matrix of one column or one row, as MATLAB writes it, becomes a vector
    return values.ravel() if values.ndim == 2 and 1 in values.shape else values


def not_numbers_note(name: str, count: int, where: str, place: int, said: str) -> Note:
    """Return the note on a few cells of a column that are not numbers.

    Parameters
    ----------
    where : str
        What the place counts: ``line`` of a file, or ``row``.
    place : int
        Where the first one is, from 1.
    said : str
        What it holds.
    """
    shown = said.strip()[:MOST_SHOWN]
    return LogCode.CELLS_NO_NUMBERS.note(column=name[:80], count=count, where=where, place=place, said=shown)


def read_each(columns: Iterable[Column], read: Callable[[Column], Array]) -> dict[Column, Array]:
    """Return columns as they are read, without columns of simulated truth that hold no numbers.

    Parameters
    ----------
    read : callable
        From a column to its values, shape (n,).

    Returns
    -------
    dict[Column, ndarray of shape (n,)]
        The values.

    Raises
    ------
    LogError
        If a column beside the truth holds no numbers.
    """
    out: dict[Column, Array] = {}
    for column in columns:
        try:
            out[column] = read(column)
        except LogError:
            if not column.channel.startswith(TRUTH_PREFIX):
                raise
    return out


def wrong_width(source: str, wanted: int, got: int, row: int) -> LogError:
    """Return the error for a row whose number of cells differs from the header. Rows count from 0 here."""
    return LogError(
        f"every row must have {wanted} cells as the header has, got {got} in row {row + 1}, counted below the header",
        source,
    )


def not_a_number(source: str, name: str, row: int, value: object, *, stamped: bool = False) -> LogError:
    """Return the error for a cell that is not a number, or not a date in a column of dates.

    Parameters
    ----------
    row : int
        The row from 0; the sentence counts from 1, without the header.
    stamped : bool
        Whether the column holds dates or times of the day.
    """
    text = str(value)[:40]
    wanted = f"dates or times in every row, such as {STAMP}" if stamped else "numbers"
    wrote = "" if stamped else f"; write 1234.5, or a time as {STAMP}"
    said = f"column {name[:80]!r} must hold {wanted}, got {text!r} in row {row + 1}{wrote}"
    return TextColumnError(said, source, name, text)
