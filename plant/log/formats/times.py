"""Columns of dates and times in memory: from NumPy, from Python, or as text."""

from datetime import UTC, datetime
from typing import Any

import numpy as np

from plant.log.clock.stamps import is_stamp, read_stamps
from plant.log.formats.cells import not_a_number


def is_time(values: "np.ndarray[Any, Any]") -> bool:
    """Return whether a column holds dates or times of day, by its first value.

    Parameters
    ----------
    values : ndarray, shape (n,)
        The column.

    Examples
    --------
    >>> is_time(np.array(["2026-03-01 12:00:00"])), is_time(np.array(["1.5"])), is_time(np.arange(3.0))
    (True, False, False)
    """
    if values.dtype.kind == "M":
        return True
    if values.dtype.kind not in "OU" or values.ndim != 1 or not len(values):
        return False
    first = values[0]
    return isinstance(first, datetime) or (isinstance(first, str) and is_stamp(first))


def universal_times(values: "np.ndarray[Any, Any]", name: str, source: str) -> Any:
    """Return a column of dates and times in universal time.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Such that `is_time` holds.
    name, source : str
        The column and the log, for messages.

    Returns
    -------
    ndarray of datetime64[ns], shape (n,)
        The times; what has no zone is taken for universal time.

    Raises
    ------
    LogError
        If a value is no time.
    """
    if values.dtype.kind == "M":
        return values.astype("datetime64[ns]")
    texts = ["" if one is None else _moment_text(one) for one in values]
    return read_stamps(texts, lambda row, cell: not_a_number(source, name, row, cell, stamped=True))


def _moment_text(value: Any) -> str:
    """Return a moment as text; a moment with a zone in universal time."""
    if not isinstance(value, datetime):
        return str(value)
    plain = value if value.tzinfo is None else value.astimezone(UTC).replace(tzinfo=None)
    return plain.isoformat(sep=" ")
