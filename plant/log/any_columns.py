"""Logs of any origin: columns with any name, in any unit, with or without a time column."""

import re
import warnings
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np

from plant.arrays import Array
from plant.errors import LogError, LogWarning
from plant.log.checks import Clock, checked_log
from plant.log.clock.stamps import seconds_from_first
from plant.log.clock.time_unit import unit_of_dates
from plant.log.clock.uniform import MOST_MISSING
from plant.log.columns import TIME, UNITS, Column, list_in_words, named_column, resolve_columns
from plant.log.formats.detect import open_tables
from plant.log.headings import Heading, headings_of
from plant.log.lost_values import without_lost
from plant.log.notes import LogCode
from plant.log.plausibility import implausibility_notes
from plant.log.record import Record
from plant.log.scale import conversion_of
from plant.log.table import Table
from plant.notes import Note
from plant.units import conversion_to, converts

SECONDS: Mapping[str, float] = {
    **dict.fromkeys(("", "s", "sec", "second", "seconds"), 1.0),
    "ms": 1e-3,
    "msec": 1e-3,
    "us": 1e-6,
    "usec": 1e-6,
    "min": 60.0,
    "h": 3600.0,
}
"""Units of a column of time, in seconds."""

TIME_STEM = re.compile(rf"(?:t|time|timestamp|zeit)(?:_({'|'.join(one for one in SECONDS if one)}))?")
"""What a column of time is called, in lower case and without brackets: ``t``, ``time_ms``."""

FEWEST_STEPS, MOST_ALIKE = 10, 0.9
"""Fewest steps of a column that may be the time [count], and the share of them near the median [fraction]; judged."""


def read_any(
    path: str | Path | Table,
    names: Sequence[str] | None = None,
    *,
    time: str | None = None,
    sample_time: float | None = None,
    most_missing: float = MOST_MISSING,
    assumed: float = 1.0,
) -> Record:
    """Read columns of a log unchanged, without knowing what they measure.

    Parameters
    ----------
    path : str, Path or Table
        A log in any format that is read, or one that is open.
    names : sequence of str, optional
        Columns wanted; a name that is a known channel may stand in another unit, ``motor_speed_rpm`` for
        ``motor_speed_rad_s``. Every column that holds numbers unless told.
    time : str, optional
        The column of time under another name, with its unit where that is not s: ``"T_MS:ms"``.
    sample_time : float, optional
        Time between samples [s]; a column of time is then not read.
    most_missing : float
        Share of the samples that may be missing [dimensionless].
    assumed : float
        Time between samples of a log that has neither [s].

    Returns
    -------
    Record
        On a uniform clock, NaN where a sample is missing; values in the units of the log.

    Raises
    ------
    LogError
        If the file cannot be read, a column is missing or holds no numbers, or time is no clock's; if both a column of
        time and a sample time are given.

    Warns
    -----
    LogWarning
        If something was mended, or there is no time.
    """
    source, opened = (path.source, (path,)) if isinstance(path, Table) else (str(path), open_tables(Path(path)))
    table = _table(opened, names)
    headings = headings_of(table.headings)
    if time is not None and sample_time is not None:
        wanted = f"a column of time or a sample time is wanted, got both: {time[:80]!r} and {sample_time:g} s"
        raise LogError(wanted, source)
    if time is None:
        clock_column = None if sample_time is not None else _time_column(headings)
    else:
        clock_column = named_column(headings, TIME, time, source)
    columns = (
        _all_columns(table, headings, clock_column)
        if names is None
        else _wanted_columns(table, headings, clock_column, names, source)
    )
    if not set(columns) - {TIME}:
        raise LogError("a column of numbers is needed; the log has none", source)
    for name in columns.keys() - {TIME}:
        columns[name], said = without_lost(columns[name], name)
        for note in said:
            warnings.warn(LogWarning(note, source), stacklevel=2)
    clock = None
    if clock_column is not None:
        heading = headings[clock_column.position]
        columns[TIME], said = _in_seconds(columns[TIME], clock_column, heading, named=time is not None)
        for note in said:
            warnings.warn(LogWarning(note, source), stacklevel=2)
    else:
        step = sample_time if sample_time is not None else table.step
        if step is None:
            for note in _notes_on_assumed_clock(table, names or (), assumed):
                warnings.warn(LogWarning(note, source), stacklevel=2)
        clock = Clock(assumed if step is None else step, 0.0)
        columns[TIME] = clock.sample_time * np.arange(len(next(iter(columns.values()))), dtype=np.float64)
    checked = checked_log(columns, source=source, required=tuple(names or ()), clock=clock, most_missing=most_missing)
    # the meaning of these columns is unknown, so notes on implausible units are left out
    amiss = implausibility_notes(checked.sample_time, checked.channels)
    for note in (one for one in checked.notes if one not in amiss):
        warnings.warn(LogWarning(note, source), stacklevel=2)
    kept = {name: checked.channels[name] for name in names or checked.channels}
    return Record(checked.sample_time, kept, start_time=checked.start_time)


def time_alone(columns: Mapping[str, str] | None) -> str | None:
    """Return the column of time, if a user names that channel and no other.

    Examples
    --------
    >>> time_alone({"time_s": "T_MS:ms"}), time_alone({"time_s": "T", "position_m": "X:mm"}), time_alone(None)
    ('T_MS:ms', None, None)
    """
    return columns[TIME] if columns is not None and set(columns) == {TIME} else None


def time_of(table: Table) -> Array | None:
    """Return the times of an open log, by its column of time.

    Returns
    -------
    ndarray of shape (n,), or None
        Times [s]; dates count from the first one. None if no column is named so.

    Examples
    --------
    >>> from plant.log.frames import frame_table
    >>> time_of(frame_table({"time_ms": [0.0, 20.0], "level": [1.0, 1.1]})).tolist()
    [0.0, 0.02]
    """
    headings = headings_of(table.headings)
    column = _time_column(headings)
    if column is None:
        return None
    return _in_seconds(table.numbers(column)[column.position], column, headings[column.position])[0]


def is_time_name(name: object) -> bool:
    """Return whether a column or an index is named as a time.

    Examples
    --------
    >>> is_time_name("time_ms"), is_time_name("level"), is_time_name(None)
    (True, False, False)
    """
    return _time_column(headings_of([str(name)])) is not None


def _table(tables: Sequence[Table], names: Sequence[str] | None) -> Table:
    """Return the table that holds most of the wanted columns, or the most columns."""

    def rank(table: Table) -> tuple[int, int]:
        own = {one.name.lower() for one in headings_of(table.headings)}
        return sum(name.lower() in own for name in names or ()), len(own)

    return max(tables, key=rank)


def _all_columns(table: Table, headings: Sequence[Heading], time: Column | None) -> dict[str, Array]:
    """Return every numeric column that has its own name, and the time as logged."""
    numbers = table.numbers(time)
    found: dict[str, Array] = {} if time is None else {TIME: numbers[time.position]}
    for place, values in numbers.items():
        name = headings[place].name
        if time is not None and place == time.position:
            continue
        if name and values.dtype.kind != "M" and not _is_time(headings[place]) and name not in found:
            found[name] = values
    return found


def _wanted_columns(
    table: Table, headings: Sequence[Heading], time: Column | None, names: Sequence[str], source: str
) -> dict[str, Array]:
    """Return the wanted columns and the time as logged: a row that is skipped in one is skipped in all."""
    chosen = [_column_named(table, headings, name, source) for name in dict.fromkeys(names)]
    raw = table.read(chosen if time is None else [time, *chosen])
    found: dict[str, Array] = {} if time is None else {TIME: raw[time]}
    for column in chosen:
        if column not in raw or raw[column].dtype.kind == "M":
            raise LogError(f"column {column.name!r} must hold numbers", source)
        found[column.channel] = column.in_si(raw[column])
    return found


def _notes_on_assumed_clock(table: Table, names: Sequence[str], assumed: float) -> list[Note]:
    """Return that a sample time is assumed, and which column, if one, rises as a time does."""
    found = [LogCode.CLOCK_ASSUMED.note(sample_time_s=assumed)]
    headings = headings_of(table.headings)
    for place, values in table.numbers().items():
        heading = headings[place]
        if not {heading.name, heading.bare}.isdisjoint(names) or values.dtype.kind == "M" or not _rises_evenly(values):
            continue
        found.append(LogCode.TIME_UNNAMED.note(column=heading.name, step=float(np.median(np.diff(values)))))
        break
    return found


def _rises_evenly(values: Array) -> bool:
    """Return whether values rise from row to row, nearly all by about the same step."""
    steps = np.diff(values)
    if steps.size < FEWEST_STEPS or not np.all(steps > 0.0):
        return False
    return bool(np.mean(np.abs(steps - np.median(steps)) < 0.5 * np.median(steps)) > MOST_ALIKE)


def _column_named(table: Table, headings: Sequence[Heading], name: str, source: str) -> Column:
    known = [one.name for one in headings]
    positions = [k for k, other in enumerate(known) if other == name]
    positions = positions or [k for k, other in enumerate(known) if other.lower() == name.lower()]
    positions = positions or [k for k, other in enumerate(headings) if other.bare.lower() == name.lower()]
    if positions:
        columns = [Column(position, known[position], name) for position in positions]
        if len(columns) > 1 and not _all_alike(table, columns):
            raise LogError(
                f"column {name!r} is needed once, the log has it {len(positions)} times with other values", source
            )
        return columns[0]
    if name in UNITS:
        for column in resolve_columns(headings, None, source):
            if column.channel == name:
                return column
    near = get_close_matches(name, known, n=1) or [one for one in known if name.lower() in one.lower()][:1]
    hint = f"; did you mean {near[0]!r}?" if near else ""
    raise LogError(f"column {name!r} is needed; the log has {list_in_words(known)}{hint}", source)


def _all_alike(table: Table, columns: Sequence[Column]) -> bool:
    """Return whether a log has the same column several times."""
    first, *others = table.read(columns).values()
    return all(np.array_equal(first, other, equal_nan=first.dtype.kind == "f") for other in others)


def _is_time(heading: Heading) -> bool:
    return heading.stamped or TIME_STEM.fullmatch(heading.stem) is not None


def _time_column(headings: Sequence[Heading]) -> Column | None:
    for place, heading in enumerate(headings):
        if _is_time(heading):
            return Column(place, heading.name, TIME, _seconds_in(_unit_of_time(heading)) or 1.0)
    return None


def _unit_of_time(heading: Heading) -> str:
    """Return the unit that a time's name or its file states; empty if they state none."""
    matched = TIME_STEM.fullmatch(heading.stem)
    return (matched and matched.group(1)) or heading.unit or ""


def _seconds_in(unit: str) -> float | None:
    """Return what a unit lasts [s]; None for others than those of a time."""
    known = SECONDS.get(unit.lower())
    return known if known is not None or not converts(unit, "s") else conversion_to(unit, "s")[0]


def _in_seconds(values: Any, column: Column, heading: Heading, *, named: bool = False) -> tuple[Array, list[Note]]:
    """Return time in seconds, dates from the first one, and notes on a unit that nothing states.

    Parameters
    ----------
    named : bool
        Whether a user names the column: without a unit it is then in seconds, unless it holds dates.
    """
    if values.dtype.kind == "M":
        return seconds_from_first(values), []
    unit = _unit_of_time(heading)
    if not unit and column.factor == 1.0:
        dates = unit_of_dates(values)
        if dates is not None and dates[0] != "s":
            said = LogCode.TIME_IS_DATES.note(column=heading.name[:80], unit=dates[0], began=dates[1])
            return (values - values[np.isfinite(values)][0]) * conversion_of(dates[0], "s")[0], [said]
    seconds = values * column.factor
    steps = np.diff(values[np.isfinite(values)])
    whole = steps.size > 0 and bool((steps >= 1.0).all() and (steps == np.round(steps)).all())
    if named or (_seconds_in(unit) is not None if unit else not whole):
        return seconds, []
    step = float(np.median(steps)) if steps.size else 0.0
    return seconds, [LogCode.TIME_UNIT_ASSUMED.note(column=heading.name[:80], step_s=step)]
