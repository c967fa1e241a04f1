"""Assigns an actuator and a date to each log: by a file name pattern, by a table, or by dates in file names."""

import csv
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from experiments.fleet.dates import WRITTEN, without_wrong_clocks, year_first
from experiments.fleet.folders import apart_by_folder
from experiments.fleet.one_form import one_form
from plant.errors import HydrostateError

STAMP = re.compile(
    r"(?P<year>(?:19|20)\d\d)(?P<between>[-_.]?)(?P<month>0[1-9]|1[0-2])(?P=between)(?P<day>0[1-9]|[12]\d|3[01])"
    r"(?:[T _-]?(?P<hour>[01]\d|2[0-3])(?P<in_time>[-_.:]?)(?P<minute>[0-5]\d)"
    r"(?:(?P=in_time)(?P<second>[0-5]\d)(?:[.,](?P<fraction>\d{1,9}))?)?"
    r"(?P<zone>Z|(?P<sign>[+-])(?P<ahead>0\d|1[0-4])[-_.:]?(?P<half>00|30|45))?)?"
)
"""A date in the forms that loggers write into file names, with or without a time: 20261122, 2026-11-22_14-30-00,
20261122T143000.123+0100."""

CALENDAR = rf"{STAMP.pattern}|\d{{4}}-.*"
"""A calendar date, in the forms that `place_of` reads."""

FIELDS: Mapping[str, str] = {"actuator": r"(?P<actuator>.+)", "date": rf"(?P<date>{WRITTEN}|[0-9][0-9T:.+\-Z]*)"}
"""Fields allowed in a pattern, and what each matches."""

NO_ACTUATOR = ("bench", "capture", "data", "export", "file", "log", "measurement", "record", "run", "scope", "test")
"""Words before a date that do not name an actuator."""


@dataclass(frozen=True)
class ActuatorAndDate:
    """The actuator and the date of a log.

    Parameters
    ----------
    actuator : str
        Empty if unknown.
    date : str
        As given; empty if unknown.
    place : float or None
        The date as a number [day, or the unit of the given numbers]; None if unknown.
    problem : str
        Why the log cannot be placed among the logs of its actuator, so that it gets its own row; empty if it can.
    """

    actuator: str
    date: str
    place: float | None
    problem: str = ""

    @property
    def shown(self) -> str:
        """The date as displayed: a `STAMP` with hyphens and colons, anything else as given."""
        stamp = STAMP.fullmatch(self.date)
        if stamp is None:
            return self.date
        day = f"{stamp['year']}-{stamp['month']}-{stamp['day']}"
        return f"{day} {stamp['hour']}:{stamp['minute']}" if stamp["hour"] else day

    @property
    def day(self) -> str:
        """The date without the time of day, for a narrow column."""
        return self.shown.split(" ")[0] if STAMP.fullmatch(self.date) else self.date

    @property
    def has_calendar_date(self) -> bool:
        """Whether the place counts days, not running hours or the like."""
        return self.place is not None and re.fullmatch(CALENDAR, self.date) is not None


UNNAMED = ActuatorAndDate("", "", None)


def place_of(date: str, source: str) -> float:
    """Return a date as a number.

    Parameters
    ----------
    date : str
        ISO 8601, such as 2026-11-22, 20261122 or 2026-11-22T14:30; the same in file names (20261122_143000,
        2026-11-22_14-30); with dots and the day first (22.11.2026); a month (2026-11 means its first day); or a number
        such as running hours.
    source : str
        Where the date was found, for the error message.

    Returns
    -------
    float
        Days since 1970-01-01 for a date [day], or the number itself.

    Raises
    ------
    HydrostateError
        If it is neither.

    Examples
    --------
    >>> place_of("1970-01-03", "a log"), place_of("1970-02", "a log"), place_of("812.5", "a log")
    (2.0, 31.0, 812.5)
    >>> place_of("19700103_120000", "a log"), place_of("03.01.1970", "a log")
    (2.5, 2.0)
    """
    given, date = date, year_first(date)
    stamp = STAMP.fullmatch(date)
    try:
        if stamp is not None:
            parts = (int(stamp[name] or 0) for name in ("year", "month", "day", "hour", "minute", "second"))
            seconds = datetime(*parts, tzinfo=UTC).timestamp() + float(f"0.{stamp['fraction'] or 0}")
            return (seconds - _ahead_of_utc(stamp)) / 86400.0
        if re.fullmatch(r"\d{8}|\d{4}-.*", date):
            moment = datetime.fromisoformat(f"{date}-01" if re.fullmatch(r"\d{4}-\d\d", date) else date)
            moment = moment if moment.tzinfo else moment.replace(tzinfo=UTC)
            return moment.timestamp() / 86400.0
        return float(date)
    except ValueError as error:
        raise HydrostateError(
            f"{source}: date must be ISO 8601 such as 2026-11-22, or a number, got {given!r}"
        ) from error


def _ahead_of_utc(stamp: re.Match[str]) -> float:
    """Return how far the time zone of a `STAMP` is ahead of UTC [s]; a time without a zone counts as UTC."""
    if not stamp["sign"]:
        return 0.0
    return float(f"{stamp['sign']}1") * (3600.0 * int(stamp["ahead"]) + 60.0 * int(stamp["half"]))


def by_pattern(files: Iterable[str], pattern: str) -> dict[str, ActuatorAndDate]:
    """Read the actuator and date of each log from its file name.

    Parameters
    ----------
    files : iterable of str
        Paths of logs.
    pattern : str
        Pattern for the end of the path, such as ``{actuator}/{date}.csv`` or ``{actuator}_{date}*``; ``*`` matches
        anything. If a name can be split in several ways, the date is a `STAMP`.

    Returns
    -------
    dict[str, ActuatorAndDate]
        By file. Files that do not match are `UNNAMED`; files with an unreadable date have a ``problem`` instead of an
        actuator.

    Raises
    ------
    HydrostateError
        If the pattern names no actuator, or an unknown field, or if none of the dates found can be read.

    Examples
    --------
    >>> by_pattern(["logs/P-12_2026-11-22.csv"], "{actuator}_{date}.csv")["logs/P-12_2026-11-22.csv"].actuator
    'P-12'
    """
    parts = re.split(r"(\{[^}]*\}|\*)", one_form(pattern))
    named = [part[1:-1] for part in parts if part.startswith("{")]
    if "actuator" not in named or set(named) - set(FIELDS) or len(named) != len(set(named)):
        raise HydrostateError(
            f"--pattern must hold {{actuator}} once, {{date}} once at most and no other name, got {pattern!r}"
        )
    stamped, wanted = (
        re.compile("(?:^|.*/)" + "".join(_pattern_regex(part, fields) for part in parts) + "$")
        for fields in ({**FIELDS, "date": f"(?P<date>{STAMP.pattern})"}, FIELDS)
    )
    found: dict[str, ActuatorAndDate] = {}
    folders: dict[str, str] = {}
    for file in files:
        path = one_form(file.replace("\\", "/"))
        match = stamped.match(path) or wanted.match(path)
        if match is None:
            found[file] = UNNAMED
            continue
        date = match.groupdict().get("date") or ""
        folders[file] = path[: match.end("actuator")].rpartition("/")[0]
        found[file] = _actuator_and_date(match["actuator"].split("/")[-1], date, "its name")
    return apart_by_folder(without_wrong_clocks(_require_a_date(found)), folders)


def _pattern_regex(part: str, fields: Mapping[str, str]) -> str:
    """Return the regular expression for one part of a pattern."""
    if part.startswith("{"):
        return fields[part[1:-1]]
    return ".*" if part == "*" else re.escape(part)


def by_dates(files: Iterable[str], folder: str = "") -> dict[str, ActuatorAndDate]:
    """Read actuator and date from file names that hold one date each, such as P-12_20261122_143000.csv.

    The actuator is the rest of the name without the date. If the rest is empty, or a word such as "log", the actuator
    is the folder's name. Each name is read alone: a log without a date, dropped on a server, separates no others.

    Parameters
    ----------
    files : iterable of str
        Paths of logs.
    folder : str
        Common folder of all logs; empty if it does not name an actuator.

    Returns
    -------
    dict[str, ActuatorAndDate]
        By file. Empty if names do not group the logs: no actuator has two logs.

    Examples
    --------
    >>> found = by_dates(["P-12/log 2026-11-21.csv", "P-12/log 2026-11-22.csv"])
    >>> {one.actuator for one in found.values()}
    {'P-12'}
    """
    found = {file: _by_date(f"{folder}/{file}".replace("\\", "/")) for file in files}
    named = [one.actuator for one in found.values() if one.actuator]
    if len(set(named)) == len(named):
        return {}
    return apart_by_folder(without_wrong_clocks(found), {file: _folder_above(file, one) for file, one in found.items()})


def actuator_in_name(name: str, pattern: str | None) -> str:
    """Return the actuator given by the name of one log: by the pattern, or otherwise by the date in the name.

    Parameters
    ----------
    name : str
        Of the file.
    pattern : str or None
        As in `by_pattern`.

    Returns
    -------
    str
        Empty if the name gives no actuator.

    Examples
    --------
    >>> actuator_in_name("P-12_2026-11-22.csv", None), actuator_in_name("run 7 of P-12.csv", "* of {actuator}.csv")
    ('P-12', 'P-12')
    >>> actuator_in_name("P-12.csv", None)
    'P-12'
    """
    if pattern is None:
        return _by_date(f"/{name}").actuator or one_form(_stem(name))
    try:
        return by_pattern([name], pattern)[name].actuator
    except HydrostateError:  # the date in the name is invalid
        return ""


def _folder_above(file: str, named: ActuatorAndDate) -> str:
    """Return the folder of a log, or the one above if the folder names the actuator."""
    folder = one_form(file.replace("\\", "/")).rpartition("/")[0]
    above, _, name = f"/{folder}".rpartition("/")
    return above.lstrip("/") if name == named.actuator else folder


def _stem(name: str) -> str:
    """Return a file name without its ending."""
    return re.sub(r"\.[A-Za-z][A-Za-z0-9]*(?:\.(?:gz|zst))?$", "", name)


def _by_date(path: str) -> ActuatorAndDate:
    """Return actuator and date from the names of a file and its folder."""
    *_, folder, name = one_form(path).split("/")
    stem = year_first(_stem(name))
    dates = list(re.finditer(rf"(?<![0-9]){STAMP.pattern}(?![0-9])", stem))
    if len(dates) != 1:
        return UNNAMED
    date = dates[0]
    rest = [part.strip("_-. ") for part in (stem[: date.start()], stem[date.end() :])]
    actuator = "_".join(part for part in rest if part)
    if re.sub(r"[\W_]", "", actuator.lower()) in {"", *NO_ACTUATOR}:
        actuator = folder
    return _actuator_and_date(actuator, date[0], "its name") if actuator else UNNAMED


def _require_a_date(found: dict[str, ActuatorAndDate]) -> dict[str, ActuatorAndDate]:
    """Raise an error if no name has a readable date: then the pattern or the date format is wrong, not a log."""
    wrong = [file for file, one in found.items() if one.problem]
    if wrong and not any(one.actuator for one in found.values()):
        raise HydrostateError(f"{wrong[0]}: {found[wrong[0]].problem}")
    return found


def _actuator_and_date(actuator: str, date: str, source: str) -> ActuatorAndDate:
    """Return actuator and date of a log; one bad date must not stop the page of the whole fleet."""
    try:
        return ActuatorAndDate(actuator, year_first(date), place_of(date, source) if date else None)
    except HydrostateError as error:
        return ActuatorAndDate("", "", None, str(error))


def by_table(files: Iterable[str], table: Path) -> dict[str, ActuatorAndDate]:
    """Read actuator and date of logs from a table.

    Parameters
    ----------
    files : iterable of str
        Paths of logs.
    table : Path
        CSV with columns ``file`` (name or path), ``actuator``, and optionally ``date``.

    Returns
    -------
    dict[str, ActuatorAndDate]
        By file. Files that are not in the table are `UNNAMED`; files with an unreadable date have a ``problem`` instead
        of an actuator.

    Raises
    ------
    HydrostateError
        If the table cannot be read or lacks a column, or no date in it can be read.
    """
    rows = table_rows(table, ("file", "actuator"))
    said = without_wrong_clocks(
        _require_a_date(
            {row["file"]: _actuator_and_date(row["actuator"], row.get("date") or "", table.name) for row in rows}
        )
    )
    known = {file: one_form(file) for file in files}
    return {file: said.get(one) or said.get(Path(one).name) or UNNAMED for file, one in known.items()}


def table_rows(table: Path, wanted: Iterable[str]) -> list[dict[str, str]]:
    """Return the rows of a small CSV table.

    Raises
    ------
    HydrostateError
        If it cannot be read, or lacks a column.
    """
    try:
        with table.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.DictReader(file)
            columns = [name.strip() for name in reader.fieldnames or ()]
            rows = [
                {str(name).strip(): one_form((value or "").strip()) for name, value in row.items() if name}
                for row in reader
            ]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        why = getattr(error, "strerror", None) or error
        raise HydrostateError(f"{table}: must be a CSV table in UTF-8 that can be read: {why}") from error
    missing = [name for name in wanted if name not in columns]
    if missing:
        raise HydrostateError(f"{table}: must have a column {missing[0]!r}, it has {', '.join(columns) or 'none'}")
    return rows
