"""Times in two columns: whole seconds, and the milliseconds or nanoseconds beside them, as controllers write them."""

import re
import warnings
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from plant.errors import LogWarning
from plant.log.columns import TIME, TIME_NAMES, Column
from plant.log.headings import Heading
from plant.log.notes import LogCode
from plant.log.table import Table

_PARTS = (
    (re.compile(r"(^|_)(ms|msecs?|millis?|millitm|milli_?sec\w*)$"), 1_000_000),
    (re.compile(r"(^|_)(us|usecs?|micros?|micro_?sec\w*)$"), 1000),
    (re.compile(r"(^|_)(ns|nsecs?|nanos?|nano_?sec\w*)$"), 1),
)
"""What columns of parts of a second are called, and what they count in [ns]."""

_SECONDS = re.compile(r"(^|_)(s|secs?|seconds?|time|uhrzeit|zeit)$")
"""What columns of seconds are called."""

_SECOND = 1_000_000_000


def with_joined_seconds(table: Table) -> Table:
    """Return a table whose column of whole seconds also counts the parts of a second in the column on its right.

    The two are one time only if the parts stay below a second and fall wherever the seconds rise, in every row.

    Parameters
    ----------
    table : Table
        As a reader of its format gives it.

    Examples
    --------
    >>> from plant.log.table import table_of
    >>> parts = {"sec": np.arange(20) // 10, "nanosec": np.arange(20) % 10 * 100_000_000}
    >>> with_joined_seconds(table_of("log", parts)).numbers()[0][9:12]
    array([0.9, 1. , 1.1])
    """
    for place, (left, right) in enumerate(zip(table.headings, table.headings[1:], strict=False)):
        size = next((size for name, size in _PARTS if name.search(right.stem) and not right.stamped), None)
        if size is not None and _counts_seconds(left) and _are_one(table, place, size):
            return _joined(table, place, size)
    return table


def _counts_seconds(heading: Heading) -> bool:
    named = heading.stem in TIME_NAMES or _SECONDS.search(heading.stem) or heading.name == TIME
    return heading.stamped or bool(named and heading.unit in (None, "s", "sec"))


def _are_one(table: Table, place: int, size: int) -> bool:
    """Return whether two columns are the seconds and the parts of a second of one time."""
    found = table.read_quietly([place, place + 1])
    if len(found) < 2:
        return False
    seconds, parts = _whole_seconds(found[place]), found[place + 1]
    if seconds is None or parts.dtype.kind != "f" or len(seconds) < 3 or not np.isfinite(parts).all():
        return False
    rise, fall = np.diff(seconds), np.diff(parts)
    within = (parts >= 0.0).all() and (parts * size < _SECOND).all()
    return bool(within and (rise >= 0).any() and ((rise == 1) == (fall < 0.0)).all() and np.isin(rise, (0, 1)).all())


def _whole_seconds(values: Any) -> Any:
    """Return whole seconds as integers; None for other values."""
    if values.dtype.kind == "M":
        told = values.astype("datetime64[ns]").astype(np.int64)
        return told // _SECOND if not np.isnat(values).any() and not (told % _SECOND).any() else None
    whole = values.dtype.kind == "f" and np.isfinite(values).all() and (np.abs(values) < 1e12).all()
    return values.astype(np.int64) if whole and not (values % 1.0).any() else None


def _joined(table: Table, place: int, size: int) -> Table:
    beside = table.column(place + 1)

    def read(columns: Sequence[Column]) -> dict[Column, Any]:
        if all(one.position != place for one in columns):
            return table.read(columns)
        found = table.read([*columns, beside])
        parts = found.pop(beside)
        for one in columns:
            if one.position == place and one in found:
                found[one] = _sum(found[one], parts, size)
                if one.channel == TIME:
                    note = LogCode.TIME_JOINED.note(column=one.name[:60], parts=beside.name[:60])
                    warnings.warn(LogWarning(note, table.source), stacklevel=2)
        return found

    return replace(table, read=read)


def _sum(seconds: Any, parts: Any, size: int) -> Any:
    if seconds.dtype.kind == "M":
        return seconds + np.rint(parts * size).astype("timedelta64[ns]")
    return seconds + parts * (size / _SECOND)
