"""Which actuator a log is of, and when it was taken: by a pattern of file names, or by a table."""

import csv
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from plant.errors import HydrostateError

FIELDS: Mapping[str, str] = {"actuator": r"(?P<actuator>.+)", "date": r"(?P<date>[0-9][0-9T:.+\-Z]*)"}
"""What a pattern may name, and what stands there."""


@dataclass(frozen=True)
class Named:
    """The actuator and the date of a log.

    Parameters
    ----------
    actuator : str
        Empty where it is not known.
    date : str
        As it was given; empty where it is not known.
    place : float or None
        The date as a number [day, or the unit of numbers that were given]; None where it is not known.
    problem : str
        Why the log cannot be placed among those of its actuator; empty where it can.
    """

    actuator: str
    date: str
    place: float | None
    problem: str = ""


UNNAMED = Named("", "", None)


def place_of(date: str, source: str) -> float:
    """Return a date as a number.

    Parameters
    ----------
    date : str
        ISO 8601, such as 2026-11-22, 20261122 or 2026-11-22T14:30, a month (2026-11: its first day), or a number such
        as running hours.
    source : str
        Where it stands, for the error.

    Returns
    -------
    float
        Days since 1970-01-01 for a date of eight digits or more [day], else the number itself.

    Raises
    ------
    HydrostateError
        If it is neither.

    Examples
    --------
    >>> place_of("1970-01-03", "a log"), place_of("1970-02", "a log"), place_of("812.5", "a log")
    (2.0, 31.0, 812.5)
    """
    try:
        if re.fullmatch(r"\d{8}|\d{4}-.*", date):
            moment = datetime.fromisoformat(f"{date}-01" if re.fullmatch(r"\d{4}-\d\d", date) else date)
            moment = moment if moment.tzinfo else moment.replace(tzinfo=UTC)
            return moment.timestamp() / 86400.0
        return float(date)
    except ValueError as error:
        raise HydrostateError(
            f"{source}: date must be ISO 8601 such as 2026-11-22, or a number, got {date!r}"
        ) from error


def by_pattern(files: Iterable[str], pattern: str) -> dict[str, Named]:
    """Read actuator and date of logs from the names of their files.

    Parameters
    ----------
    files : iterable of str
        Paths of logs.
    pattern : str
        Of the end of the path, such as ``{actuator}/{date}.csv`` or ``{actuator}_{date}*``; ``*`` is anything.

    Returns
    -------
    dict[str, Named]
        By file; those that do not match are `UNNAMED`, and those whose date cannot be read have a ``problem`` instead
        of an actuator.

    Raises
    ------
    HydrostateError
        If the pattern names no actuator, or something else, or no date that it finds can be read.

    Examples
    --------
    >>> by_pattern(["logs/P-12_2026-11-22.csv"], "{actuator}_{date}.csv")["logs/P-12_2026-11-22.csv"].actuator
    'P-12'
    """
    parts = re.split(r"(\{[^}]*\}|\*)", pattern)
    named = [part[1:-1] for part in parts if part.startswith("{")]
    if "actuator" not in named or set(named) - set(FIELDS) or len(named) != len(set(named)):
        raise HydrostateError(
            f"--pattern must hold {{actuator}} once, {{date}} once at most and no other name, got {pattern!r}"
        )
    texts = [FIELDS[part[1:-1]] if part.startswith("{") else ".*" if part == "*" else re.escape(part) for part in parts]
    wanted = re.compile("(?:^|.*/)" + "".join(texts) + "$")
    found: dict[str, Named] = {}
    for file in files:
        match = wanted.match(file.replace("\\", "/"))
        if match is None:
            found[file] = UNNAMED
            continue
        date = match.groupdict().get("date") or ""
        found[file] = _named(match["actuator"].split("/")[-1], date, "its name")
    return _require_a_date(found)


def _require_a_date(found: dict[str, Named]) -> dict[str, Named]:
    """Refuse names of which none has a date that can be read: the pattern or the form of dates is wrong, no log is."""
    wrong = [file for file, one in found.items() if one.problem]
    if wrong and not any(one.actuator for one in found.values()):
        raise HydrostateError(f"{wrong[0]}: {found[wrong[0]].problem}")
    return found


def _named(actuator: str, date: str, source: str) -> Named:
    """Return what is known of a log; one bad date must not cost the fleet its page."""
    try:
        return Named(actuator, date, place_of(date, source) if date else None)
    except HydrostateError as error:
        return Named("", "", None, str(error))


def by_table(files: Iterable[str], table: Path) -> dict[str, Named]:
    """Read actuator and date of logs from a table.

    Parameters
    ----------
    files : iterable of str
        Paths of logs.
    table : Path
        CSV with columns ``file`` (name or path), ``actuator``, and ``date`` if there is one.

    Returns
    -------
    dict[str, Named]
        By file; those that are not in the table are `UNNAMED`, and those whose date cannot be read have a ``problem``
        instead of an actuator.

    Raises
    ------
    HydrostateError
        If the table cannot be read or lacks a column, or no date in it can be read.
    """
    rows = table_rows(table, ("file", "actuator"))
    said = {row["file"]: _named(row["actuator"], row.get("date") or "", table.name) for row in rows}
    _require_a_date(said)
    return {file: said.get(file) or said.get(Path(file).name) or UNNAMED for file in files}


def table_rows(table: Path, wanted: Iterable[str]) -> list[dict[str, str]]:
    """Return the rows of a small CSV table.

    Parameters
    ----------
    wanted : iterable of str
        Columns that it must have.

    Returns
    -------
    list of dict
        By column.

    Raises
    ------
    HydrostateError
        If it cannot be read, or lacks a column.
    """
    try:
        with table.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.DictReader(file)
            columns = [name.strip() for name in reader.fieldnames or ()]
            rows = [{str(name).strip(): (value or "").strip() for name, value in row.items() if name} for row in reader]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        why = getattr(error, "strerror", None) or error
        raise HydrostateError(f"{table}: must be a CSV table in UTF-8 that can be read: {why}") from error
    missing = [name for name in wanted if name not in columns]
    if missing:
        raise HydrostateError(f"{table}: must have a column {missing[0]!r}, it has {', '.join(columns) or 'none'}")
    return rows
