"""Tables in memory, read as a log: of pandas, Polars or Arrow, or columns by name."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeGuard

import numpy as np

from plant.errors import LogError
from plant.log.any_columns import TIME_STEM
from plant.log.columns import TIME, TRUTH_PREFIX, UNITS, resolve_columns
from plant.log.formats.cells import values_of
from plant.log.table import Table, table_of

if TYPE_CHECKING:
    import pandas as pd

SOURCE = "the table"
"""What messages call a table that came from no file."""


def is_frame(given: object) -> "TypeGuard[pd.DataFrame]":
    """Return whether an object is a pandas DataFrame, without importing pandas."""
    return hasattr(given, "iloc") and hasattr(given, "columns") and hasattr(given, "index")


def by_name(given: object) -> "Mapping[str, Any] | None":
    """Return the columns of a Polars or Arrow table, a NumPy structured array or a mapping; None for others.

    Parameters
    ----------
    given : object
        What a user has.

    Returns
    -------
    Mapping[str, array_like] or None
        Columns by name; values that are missing are NaN.
    """
    if isinstance(given, Mapping):
        return given  # pyright: ignore[reportUnknownVariableType]  names and values are checked where they are read
    if (fields := getattr(getattr(given, "dtype", None), "names", None)) and getattr(given, "ndim", 0) == 1:
        records: Any = given
        return {name: records[name] for name in fields}
    if hasattr(given, "collect"):  # a query that has not been run yet
        return None
    names = getattr(given, "column_names", getattr(given, "columns", None))
    if not isinstance(names, list) or not hasattr(given, "__getitem__"):
        return None
    table: Any = given
    return {name: table[name].to_numpy() for name in names}  # pyright: ignore[reportUnknownVariableType]


def frame_table(given: "pd.DataFrame | Mapping[str, Any]") -> Table:
    """Return a table in memory as an open log.

    The index of a DataFrame is its time if it holds dates, durations or floats, or has a name such as ``time_ms``,
    unless a column is named time.

    Parameters
    ----------
    given : pandas.DataFrame or Mapping[str, array_like]
        Columns of one length, by name.

    Returns
    -------
    Table
        Ready for `plant.log.files.read_record`.

    Raises
    ------
    LogError
        If it has no columns or no rows, or their lengths differ.

    Examples
    --------
    >>> [one.name for one in frame_table({"time_s": [0.0, 1.0], "position_m": [0.0, 0.1]}).headings]
    ['time_s', 'position_m']
    """
    names = [_text(name) for name in (given.columns if is_frame(given) else given)]
    if len(set(names)) < len(names):
        twice = ", ".join(repr(name) for name, count in Counter(names).items() if count > 1)
        raise LogError(f"columns of different names are needed, got {twice} more than once", SOURCE)
    values: dict[str, Any] = dict(zip(names, _columns(given, names), strict=True))
    values = {name: one for name, one in values.items() if not (name.startswith("__") and name.endswith("__"))}
    units: dict[str, str | None] = {}
    for name, one in values.items():
        if hasattr(one, "magnitude"):
            values[name], units[name] = _of_quantity(name, one)
    index = given.index if is_frame(given) else _shared_index(given)
    if index is not None and not any(map(_is_time, names)):
        if index.nlevels > 1:
            raise LogError(f"an index of one level is needed, got {index.nlevels}: use reset_index()", SOURCE)
        values = {**_time(index), **values}
    lengths = {name: np.size(one) for name, one in values.items()}
    if not lengths or not max(lengths.values()):
        raise LogError("columns with at least one row are needed, got an empty table", SOURCE)
    if len(set(lengths.values())) > 1:
        got = ", ".join(f"{name} {length}" for name, length in lengths.items())
        raise LogError(f"columns of one length are needed, got {got} samples", SOURCE)
    spans = {name: _seconds(one) for name, one in values.items() if np.asarray(one).dtype.kind == "m"}
    return table_of(SOURCE, {**values, **spans}, units={**units, **dict.fromkeys(spans, "s")})


def _shared_index(given: Any) -> "pd.Index[Any] | None":
    """Return the index of all columns if they are series of pandas; None for others.

    An index that only counts rows tells nothing of them.

    Raises
    ------
    LogError
        If two columns of one length have different indexes: rows side by side would not belong together.
    """
    every = {name: one.index for name, one in given.items() if hasattr(one, "iloc") and hasattr(one, "index")}
    told = {name: one for name, one in every.items() if not one.equals(one[:0].union(range(len(one))))}
    for name, index in told.items():
        first = next(iter(told))
        if len(index) == len(told[first]) and not index.equals(told[first]):
            raise LogError(
                f"series of one index are needed, got other rows in {_text(name)} than in {_text(first)}: "
                "pandas.concat(..., axis=1) brings them together, to_numpy() takes them as they stand",
                SOURCE,
            )
    return next(iter(told.values())) if told and len(told) == len(given) else None


def _is_time(name: str) -> bool:
    return TIME_STEM.fullmatch(name.lower()) is not None


def _time(index: "pd.Index[Any]") -> dict[str, Any]:
    """Return an index as a time column; empty if it only counts rows, also after a selection of rows."""
    name = "" if index.name is None else str(index.name)
    if index.dtype.kind in "iuf" and (_is_time(name) or index.dtype.kind == "f"):
        return {name if _is_time(name) else TIME: _plain(index)}
    starts: Any = getattr(index, "to_timestamp", None)  # an index of periods, as in a resampled table
    index = index if starts is None else starts()
    return {TIME: _plain(index)} if index.dtype.kind in "mM" else {}


def _seconds(spans: Any) -> Any:
    """Return durations in seconds, with NaN for missing ones."""
    exact = np.asarray(spans).astype("timedelta64[ns]")
    return np.where(np.isnat(exact), np.nan, exact.astype(np.int64) * 1e-9)


def _columns(given: Any, names: Sequence[str]) -> list[Any]:
    if is_frame(given):
        return [_plain(given.iloc[:, place]) for place in range(given.shape[1])]
    return [values_of(name, one, SOURCE) for name, one in zip(names, given.values(), strict=True)]


def _of_quantity(name: str, quantity: Any) -> tuple[Any, str | None]:
    """Return the numbers of a quantity with units, in the unit of its name or else in its own unit."""
    named = resolve_columns([name], None, SOURCE)
    try:
        if named and not named[0].channel.startswith(TRUTH_PREFIX):
            column = named[0]
            return (quantity.to(UNITS[column.channel]).magnitude - column.offset) / column.factor, None
    except TypeError as error:  # raised by pint for units that do not convert
        raise LogError(f"column {name[:80]!r}: {error}", SOURCE) from error
    return quantity.magnitude, f"{quantity.units:~C}" or "1"


def _text(name: object) -> str:
    return name.decode(errors="replace") if isinstance(name, bytes) else str(name)


def _plain(column: Any) -> Any:
    """Return a pandas column or index as a NumPy array, with dates in UTC."""
    if getattr(column.dtype, "tz", None) is not None:
        column = getattr(column, "dt", column).tz_convert(None)
    return column.to_numpy()
