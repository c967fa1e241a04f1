"""Rows that do not stand in the order of time, as several tasks write them, and newest first, as historians do."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from plant.arrays import Array
from plant.log.clock.jumps import without_overruns
from plant.log.columns import TIME
from plant.log.notes import LogCode
from plant.notes import Note

EVEN = 0.01
"""Share of a step by which sorted steps may differ from the usual one [fraction]; judged: stamps that jitter would be
sorted wrongly."""


def in_order(columns: Mapping[str, Array], notes: list[Note]) -> Mapping[str, Array]:
    """Return rows in the order of their times.

    They are sorted if that alone makes all steps even. They are not if the time falls once, to before the log begins,
    as a clock that begins again does, or throughout, as a clock that counts down does.

    Parameters
    ----------
    columns : Mapping[str, ndarray, shape (n,)]
        ``time_s`` [s], finite, and the channels.
    notes : list of Note
        Grows by what was done.

    Returns
    -------
    Mapping[str, ndarray, shape (n,)]
        The same object if rows stay where they are.

    Examples
    --------
    >>> told = []
    >>> rows = {TIME: np.array([0.1, 0.3, 0.2, 0.4]), "position_m": np.array([1.0, 3.0, 2.0, 4.0])}
    >>> in_order(rows, told)["position_m"].tolist(), len(told)
    ([1.0, 2.0, 3.0, 4.0], 1)
    """
    time = columns[TIME]
    with np.errstate(over="ignore", invalid="ignore"):  # steps that are not finite are refused later
        step = np.diff(time)
        falls = np.flatnonzero(step < 0.0)
        if not 0 < len(falls) < len(step):
            return columns
        order = np.argsort(time, kind="stable")
        even = np.diff(time[order])
    usual = float(np.median(even))
    begins_again = len(falls) == 1 and time[-1] < time[0]
    if begins_again or not usual > 0.0 or not float(np.abs(even - usual).max()) <= EVEN * usual:
        return columns
    if without_overruns(time)[1] is not None:
        return columns
    notes.append(LogCode.ROWS_SORTED.note(count=len(falls), row=int(falls[0]) + 2))
    return {name: values[order] for name, values in columns.items()}


def oldest_first(columns: Mapping[str, Any], notes: list[Note]) -> Mapping[str, Any]:
    """Return rows with dates from the oldest on, where each is older than the one before.

    Parameters
    ----------
    columns : Mapping[str, ndarray, shape (n,)]
        ``time_s``, as numbers or dates, and the channels. Numbers that fall may count down, and are left alone.
    notes : list of Note
        Grows by what was done.

    Returns
    -------
    Mapping[str, ndarray, shape (n,)]
        The same object if rows stay where they are.

    Examples
    --------
    >>> dates = np.array(["2026-03-04T10:00:02", "2026-03-04T10:00:01", "2026-03-04T10:00:00"], dtype="datetime64[ns]")
    >>> oldest_first({TIME: dates, "position_m": np.array([3.0, 2.0, 1.0])}, [])["position_m"].tolist()
    [1.0, 2.0, 3.0]
    """
    time = columns.get(TIME)
    if time is None or time.dtype.kind != "M" or len(time) < 3 or np.isnat(time).any():
        return columns
    if not bool((np.diff(time.astype(np.int64)) < 0).all()):
        return columns
    notes.append(LogCode.ROWS_NEWEST_FIRST.note())
    return {name: values[::-1] for name, values in columns.items()}
