"""The tables of a log, one for each logger or group: maps columns to channels and merges the clocks."""

import warnings
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from plant.arrays import Array
from plant.errors import LogError, MissingColumnError, TextColumnError
from plant.log.chamber_pressures import require_one_reference
from plant.log.checks import alternatives, missing_required
from plant.log.clock.merging import LoggerChannels, merge_loggers
from plant.log.clock.order import oldest_first
from plant.log.clock.stamps import seconds_from_first
from plant.log.clock.time_unit import likely_unit, unit_of_dates
from plant.log.columns import TIME, TRUTH_PREFIX, Column, list_in_words, resolve_columns
from plant.log.guess import SHOWN_PROBABILITY, guess_by_name, hint_of, missing_channels, unused_column_notes
from plant.log.headings import Heading, headings_of
from plant.log.lost_values import without_lost
from plant.log.notes import LogCode
from plant.log.table import Table
from plant.notes import Note

Chosen = Sequence[tuple[Table, tuple[Column, ...]]]


@dataclass(frozen=True, eq=False)
class LogTables:
    """Merged contents of the tables of a log.

    Parameters
    ----------
    columns : Mapping[str, ndarray, shape (n,)]
        ``time_s`` and the channels, in SI.
    began : str or None
        When the first row was taken, in ISO 8601, where the log says so; ``time_s`` counts from there.
    notes : tuple of Note
        What was put together.
    """

    columns: Mapping[str, Array]
    began: str | None = None
    notes: tuple[Note, ...] = ()


def gather_channels(
    tables: Sequence[Table],
    mapping: Mapping[str, str] | None,
    required: Collection[str],
    source: str,
    sample_time: float | None = None,
) -> LogTables:
    """Return the channels of a log, converted to SI.

    Parameters
    ----------
    tables : sequence of Table
        Its tables.
    mapping : Mapping[str, str] or None
        Foreign columns by channel; ``GROUP/NAME`` where two groups have one of that name.
    required : collection of str
        Channels that must be there, see `plant.log.checks.checked_log`.
    source : str
        What messages call the log.
    sample_time : float, optional
        Time between rows [s], of a log that has no time.

    Returns
    -------
    LogTables
        Channels on one time.

    Raises
    ------
    LogError
        If a column is missing, double or no number, or there is no time.
    """
    headings = [one for table in tables for one in table.headings]
    try:
        chosen = resolve_tables(tables, mapping, source)
    except MissingColumnError as error:
        hint = hint_of([error.channel], headings)
        raise MissingColumnError(error.channel, error.column, error.known, source, hint) from error
    found = [column.channel for _, columns in chosen for column in columns]
    missing = missing_required(required, found)
    timeless = TIME not in found and sample_time is None and not any(table.step for table, _ in chosen)
    if timeless and (time := _time_without_unit(tables)) is not None:
        place, heading, dates = time
        if dates is not None and not missing:
            dated = gather_channels(tables, {**(mapping or {}), TIME: f"{heading.name}:{dates[0]}"}, required, source)
            note = LogCode.TIME_IS_DATES.note(column=heading.name[:80], unit=dates[0], began=dates[1])
            return replace(dated, notes=(note, *dated.notes))
        headings[place] = heading
    if timeless or missing:
        if not found and not any(len(one) for table in tables for one in table.numbers().values()):
            raise LogError("a log needs rows of numbers below its header line, this file has none", source)
        wanted = [TIME] * timeless + missing
        raise missing_channels(wanted, headings, source, found)
    require_one_reference(*_units_and_names(chosen, mapping or {}), source)
    with np.errstate(over="ignore", invalid="ignore"):  # values that are not finite are refused or noted later
        notes: list[Note] = []
        parts = [(table, _without_text(table, columns, found, required, notes)) for table, columns in chosen]
    timed = [_with_time(table, values, parts, sample_time, source) for table, values in parts]
    together = merge_loggers(timed, source)
    columns, began = _seconds_from_start(oldest_first(together.channels, notes))
    return LogTables(columns, began, (*_unused_column_notes(chosen, tables), *notes, *together.notes))


def _units_and_names(
    chosen: Sequence[tuple[Table, Sequence[Column]]], mapping: Mapping[str, str]
) -> tuple[dict[str, str], dict[str, str]]:
    """Return unit and name of each channel's column; the unit that the user gives is the one that counts."""
    units: dict[str, str] = {}
    for table, columns in chosen:
        for column in columns:
            _, colon, given = mapping.get(column.channel, "").rpartition(":")
            units[column.channel] = given if colon else table.headings[column.position].unit or ""
    return units, {column.channel: column.name for _, columns in chosen for column in columns}


def _time_without_unit(tables: Sequence[Table]) -> tuple[int, Heading, tuple[str, str] | None] | None:
    """Return the likely time column that states no unit: its place, and its likely unit or the unit of its dates."""
    owners = [(table, place) for table in tables for place in range(len(table.headings))]
    headings = [table.headings[place] for table, place in owners]
    (guess,) = guess_by_name(headings, [TIME])[:1] or (None,)
    if guess is None or guess.sure < SHOWN_PROBABILITY or guess.unit is not None or headings[guess.place].stamped:
        return None
    table, place = owners[guess.place]
    column = Column(place, guess.name, TIME)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            values = table.read([column])[column]
    except LogError:
        return None
    dates = unit_of_dates(values) if values.dtype.kind == "f" else None
    unit = dates[0] if dates else likely_unit(values) if values.dtype.kind == "f" else None
    return None if unit is None else (guess.place, replace(headings[guess.place], said=unit), dates)


def _without_text(
    table: Table, columns: Sequence[Column], found: list[str], required: Collection[str], notes: list[Note]
) -> dict[str, Array]:
    """Return the channels of a table without text columns that were not requested."""
    try:
        return _read(table, columns, notes)
    except TextColumnError as error:
        text = next((one for one in columns if one.name == error.column and one.channel != TIME), None)
        if text is None or not found:
            raise
        others = [name for name in found if name != text.channel]
        if not any(name != TIME for name in others) or any(
            text.channel in alternatives(wanted) and not any(name in others for name in alternatives(wanted))
            for wanted in required
        ):
            raise
        found.remove(text.channel)
        notes.append(LogCode.CHANNEL_OF_TEXT.note(channel=text.channel, column=text.name[:80], text=error.text))
        return _without_text(table, [one for one in columns if one is not text], found, required, notes)


def _unused_column_notes(chosen: Chosen, tables: Sequence[Table]) -> tuple[Note, ...]:
    """Return a note for each unused column that may be a channel that the log seems to lack."""
    read = {id(table): {column.position for column in columns} for table, columns in chosen}
    left = [
        heading
        for table in tables
        for place, heading in enumerate(table.headings)
        if place not in read.get(id(table), ())
    ]
    return unused_column_notes(left, [column.channel for _, columns in chosen for column in columns])


def resolve_tables(tables: Sequence[Table], mapping: Mapping[str, str] | None, source: str) -> Chosen:
    """Return the columns of each table that become channels. Tables without any are left out.

    Parameters
    ----------
    tables : sequence of Table
        Tables of one log.
    mapping : Mapping[str, str] or None
        Foreign columns by channel.
    source : str
        What messages call the log.

    Raises
    ------
    LogError
        If a mapped column is missing, or two columns give one channel.
    """
    mapping = dict(mapping or {})
    if len(tables) == 1:
        return [(tables[0], resolve_columns(_with_group_names(tables[0], mapping), mapping, source))]
    chosen: list[tuple[Table, tuple[Column, ...]]] = []
    clocks: list[tuple[Table, tuple[Column, ...]]] = []
    taken: set[str] = set()
    for table in tables:
        headings = _with_group_names(table, mapping)
        own = {channel: spec for channel, spec in mapping.items() if _has_column(headings, channel, spec)}
        taken |= own.keys()
        columns = resolve_columns(headings, own, source)
        kept = tuple(one for one in columns if one.channel not in mapping or one.channel in own)
        if any(one.channel != TIME for one in kept):
            chosen.append((table, kept))
        elif kept:
            clocks.append((table, kept))
    for channel in mapping.keys() - taken:
        names = [one.name for table in tables for one in table.headings]
        raise MissingColumnError(
            channel, mapping[channel].rpartition(":")[0] or mapping[channel], list_in_words(names), source
        )
    _refuse_repeated_channels(chosen, source)
    if any(table.step is None and all(one.channel != TIME for one in columns) for table, columns in chosen):
        chosen += clocks  # clocks in groups of their own serve tables without one
    return chosen or [(table, ()) for table in tables[:1]]


def _with_group_names(table: Table, mapping: Mapping[str, str]) -> Sequence[Heading]:
    """Return headings, with the group name in front of a name that the mapping refers to."""
    if not table.label:
        return table.headings
    asked = [spec for spec in mapping.values() if spec.startswith(f"{table.label}/")]
    if not asked:
        return table.headings
    full = [Heading(f"{table.label}/{one.name}", one.unit, one.stamped) for one in table.headings]
    return [
        there if any(spec.rpartition(":")[0] == there.name or spec == there.name for spec in asked) else one
        for one, there in zip(table.headings, full, strict=True)
    ]


def _has_column(headings: Sequence[Heading], channel: str, spec: str) -> bool:
    try:
        resolve_columns(headings_of(headings), {channel: spec}, "")
    except MissingColumnError:
        return False
    except LogError:
        return True
    return True


def _refuse_repeated_channels(chosen: Chosen, source: str) -> None:
    """Refuse a channel that occurs in two tables."""
    owners: dict[str, list[tuple[Table, Column]]] = {}
    for table, columns in chosen:
        for column in columns:
            owners.setdefault(column.channel, []).append((table, column))
    twice = [name for name, own in owners.items() if name != TIME and any(one is not own[0][0] for one, _ in own)]
    if not twice:
        return
    first, other = (owners[twice[0]][place][0] for place in (0, -1))
    options = ",".join(f"{name}={first.label}/{owners[name][0][1].name}" for name in twice)
    such = f", such as --columns '{options[:400]}'" if first.label else ""
    raise LogError(
        f"{(first.label or first.source)!r} and {(other.label or other.source)!r} both give {', '.join(twice)}, "
        f"wanted one; name the right one as CHANNEL=GROUP/NAME:UNIT{such}",
        source,
    )


def _read(table: Table, columns: Sequence[Column], notes: list[Note]) -> dict[str, Array]:
    raw = table.read(columns)
    stamps = {column: values for column, values in raw.items() if values.dtype.kind == "M"}
    for column in stamps:
        if column.channel != TIME and not column.channel.startswith(TRUTH_PREFIX):
            raise LogError(f"column {column.name!r} must hold numbers, got dates", table.source)
    numbers: dict[Column, Array] = {}
    for column, values in ((one, values) for one, values in raw.items() if one not in stamps):
        numbers[column], said = (values, []) if column.channel == TIME else without_lost(values, column.channel)
        notes += said
    in_si = {column.channel: column.in_si(values) for column, values in numbers.items()}
    return in_si | {column.channel: values for column, values in stamps.items()}


def _with_time(
    table: Table,
    values: dict[str, Array],
    parts: Sequence[tuple[Table, dict[str, Array]]],
    sample_time: float | None,
    source: str,
) -> LoggerChannels:
    """Return a table's channels with their time: its own, from its step, from an equal table, or as requested."""
    channels = {name: one for name, one in values.items() if name != TIME}
    rows = len(next(iter(values.values()), ()))
    if TIME in values:
        return LoggerChannels(table.source, values[TIME], channels, table.label)
    step = table.step or sample_time
    if table.step is None:
        alike = [other[TIME] for _, other in parts if TIME in other and len(other[TIME]) == rows]
        if len(alike) == 1:
            return LoggerChannels(table.source, alike[0], channels, table.label)
    if step is None:
        raise missing_channels([TIME], list(table.headings), source)
    time: Any = table.offset + step * np.arange(rows)
    if table.began is not None:
        time = table.began + np.rint(1e9 * time).astype("timedelta64[ns]")
    return LoggerChannels(table.source, time, channels, table.label)


def _seconds_from_start(columns: Mapping[str, Any]) -> tuple[dict[str, Array], str | None]:
    """Return times of day as seconds from the first, and the first time."""
    out = dict(columns)
    time: Any = out.get(TIME)
    if time is None or time.dtype.kind != "M":
        return out, None
    out[TIME] = seconds_from_first(time)
    there = time[~np.isnat(time)]
    return out, str(np.datetime_as_string(there[0], unit="us")) + "Z" if len(there) else None
