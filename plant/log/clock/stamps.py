"""Time stamps with dates and times of day: converts text to nanoseconds since 1970 in universal time."""

import re
from collections.abc import Callable, Sequence
from datetime import date, timedelta
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from plant.log.formats.cells import MISSING

Stamps = NDArray[np.datetime64]

_CLOCK = (
    r"(?P<h>\d{1,2})(?::|\s?h\s?)(?P<m>\d{2})(?:(?::|\s?m(?:in)?\s?)(?P<s>\d{2})(?:[.,:](?P<f>\d{1,12}))?(?:\s?s)?)?"
    r"\s*(?P<half>[AaPp]\.?\s?[Mm]\.?)?(?:\s*Uhr)?"
)
_ZONE = r"\s*(?P<zone>Z|UTC|GMT|[A-Z]{3,4}|[-+]\d{2}(?::?\d{2})?)?(?:\[[\w/+-]{1,40}\])?"
_MONTHS = {
    begun: month
    for month, names in enumerate(
        (
            *("jan jän ene gen", "feb fév fev", "mar mär mae mrz", "apr avr abr", "may mai mag", "jun juin giu"),
            *("jul juil lug", "aug aoû aou ago", "sep set", "oct okt ott", "nov", "dec déc dez dic"),
        ),
        start=1,
    )
    for begun in names.split()
}
"""How names of months begin in English, German, French, Spanish and Italian, in lower case."""

_WORD = rf"(?P<word>(?i:{'|'.join(_MONTHS)}))[^\W\d_]{{0,7}}\.?"
_WEEKDAY = r"(?:[^\W\d_]{2,10}\.?,?\s+)?"
_OF = r"(?:(?:er|[°º])?\.?[-/ ]\s?|\s+del?\s+)"
_COMPACT = r"[T_ -](?P<h>\d{2})(?P<m>\d{2})(?P<s>\d{2})(?:[.,_](?P<f>\d{1,12}))?(?P<half>)"
_AFTER_DAY = rf"(?:[ T,_:-]\s*(?:(?:à|a las|alle|ore|um|at)\s+)?){_CLOCK}"
_DAY_OR_MONTH_FIRST = re.compile(
    rf"(?P<one>\d{{1,2}})[/-](?P<two>\d{{1,2}})[/-](?P<Y>\d{{4}}|\d{{2}}){_AFTER_DAY}{_ZONE}"
)
_PATTERNS = (
    *(
        re.compile(rf"{day}{clock}{_ZONE}")
        for day, clock in (
            (r"(?P<Y>\d{4})[-/.](?P<M>\d{1,2})[-/.](?P<D>\d{1,2})", rf"(?:(?:\s*[T,_-]\s*|\s+){_CLOCK})?"),
            (r"(?P<D>\d{1,2})\.(?P<M>\d{1,2})\.(?P<Y>\d{4}|\d{2})", _AFTER_DAY),
            (rf"{_WEEKDAY}(?P<D>\d{{1,2}}){_OF}{_WORD}{_OF}(?P<Y>\d{{4}}|\d{{2}})", _AFTER_DAY),
            (rf"{_WEEKDAY}{_WORD}\s+(?P<D>\d{{1,2}}),?\s+(?P<Y>\d{{4}})", _AFTER_DAY),
            (rf"{_WEEKDAY}{_WORD}\s+(?P<D>\d{{1,2}})\s+{_CLOCK}", r"\s+(?P<Y>\d{4})"),
            (r"(?:(?P<Y>\d{4})[-:])?(?P<N>\d{3})", rf"[T: /-]{_CLOCK}"),
            (r"(?P<E>\d{1,5}) days?,?", rf" \+?{_CLOCK}"),
            (r"(?P<Y>\d{4})(?P<M>\d{2})(?P<D>\d{2})", _COMPACT),
        )
    ),
    _DAY_OR_MONTH_FIRST,
    re.compile(rf"{_CLOCK}{_ZONE}"),
)
_MINUTES = re.compile(r"(?P<m>\d{1,3}):(?P<s>\d{2})[.,](?P<f>\d{1,12})")
_MOST_DAYS, _LEAST_DAYS = 367, 363
"""Days that no day of a year reaches, and by which stamps fall back at its end [count]."""

_DAY, _SECOND = 86_400_000_000_000, 1_000_000_000
_EPOCH = date(1970, 1, 1)
_ISO = re.compile(r"(?:1[89]|2[01])\d{2}-\d{2}-\d{2}[T ]\d{2}:\d{2}:\d{2}(?:\.(\d{1,9}))?(Z|[-+]\d{2}:?\d{2})?")

_DIGITS = str.maketrans("123456789", "000000000")

LONGEST_STAMP = 48
"""Characters of the longest stamp that is read."""


def is_stamp(cell: str) -> bool:
    """Return whether a cell is a date and a time, or a time of the day.

    Examples
    --------
    >>> is_stamp("2026-03-01 12:00:00.001+02:00"), is_stamp("12:30:01,5"), is_stamp("1.5")
    (True, True, False)
    """
    text = cell.strip()
    return len(text) <= LONGEST_STAMP and _has_stamp_form(text.translate(_DIGITS))


@lru_cache(maxsize=64)
def _has_stamp_form(text: str) -> bool:
    """Return whether a text with masked digits has the form of a stamp. All stamps of a column have one form."""
    return any(one.fullmatch(text) for one in (*_PATTERNS, _MINUTES))


def read_stamps(cells: Sequence[str], refuse: Callable[[int, str], Exception | None]) -> Stamps:
    """Return stamps as times. Stamps without a zone are taken as universal time.

    Parameters
    ----------
    cells : sequence of str
        The stamps, empty where there is none.
    refuse : callable
        From a row, from 0, and its text to the error that is raised where that is no stamp; None where it is taken
        for missing.

    Returns
    -------
    ndarray of datetime64[ns], shape (n,)
        The times; what runs over midnight without a date goes on to the next day.

    Examples
    --------
    >>> read_stamps(["23:59:59.5", "00:00:00.5"], lambda row, text: ValueError(text)).astype("i8").tolist()
    [86399500000000, 86400500000000]
    """
    quick = _uniform_stamps(cells)
    if quick is not None:
        return quick
    months_first = _months_first(cells)
    out = np.empty(len(cells), dtype=np.int64)
    for row, cell in enumerate(cells):
        text = cell.strip()
        if text in MISSING:
            out[row] = np.iinfo(np.int64).min
            continue
        value = _nanoseconds(text, months_first=months_first)
        if value is None:
            if (error := refuse(row, cell)) is not None:
                raise error
            value = int(np.iinfo(np.int64).min)
        out[row] = value
    return continue_over_midnight(out).view("datetime64[ns]")


def _uniform_stamps(cells: Sequence[str]) -> Stamps | None:
    """Return stamps that all have the form of the first, which NumPy reads quickly; None for others."""
    first = _ISO.fullmatch(cells[0].strip()) if cells else None
    if first is None or any(len(cell) != len(cells[0]) for cell in cells):
        return None
    zone = first[2] or ""
    if not all((found := _ISO.fullmatch(cell.strip())) and (found[2] or "") == zone for cell in cells):
        return None
    try:
        stamps = np.array([cell.strip().removesuffix(zone).replace(" ", "T") for cell in cells], dtype="datetime64[ns]")
    except ValueError:
        return None
    return (stamps.astype(np.int64) - _offset(zone)).view("datetime64[ns]")


def _offset(zone: str) -> int:
    """Return the offset of a zone from universal time [ns]. A zone given only by name is that of the log."""
    if zone[:1] not in ("+", "-"):
        return 0
    digits = zone[1:].replace(":", "").ljust(4, "0")
    return int(zone[0] + "1") * (int(digits[:2]) * 3600 + int(digits[2:]) * 60) * _SECOND


def _months_first(cells: Sequence[str]) -> bool:
    """Return whether 3/4/2026 is in March: yes, unless a month is impossible or the days are months apart."""
    found = (_DAY_OR_MONTH_FIRST.fullmatch(cell.strip()) for cell in cells)
    days = {(int(one["one"]), int(one["two"]), int(one["Y"])) for one in found if one}
    if any(one > 12 for one, _, _ in days) or any(two > 12 for _, two, _ in days):
        return not any(one > 12 for one, _, _ in days)
    american = [(year, one, two) for one, two, year in days]
    european = [(year, two, one) for one, two, year in days]
    return _span_in_days(american) <= _span_in_days(european)


def _span_in_days(days: Sequence[tuple[int, int, int]]) -> int:
    """Return the time span of days given as year, month and day, with 31 days in every month."""
    counted = [372 * year + 31 * month + day for year, month, day in days]
    return max(counted, default=0) - min(counted, default=0)


def _nanoseconds(text: str, *, months_first: bool) -> int | None:
    if len(text) > LONGEST_STAMP:
        return None
    found = next((match for one in _PATTERNS if (match := one.fullmatch(text))), None)
    if found is None or (found["s"] is None and found["half"] is None and "Y" not in found.re.groupindex):
        short = _MINUTES.fullmatch(text)
        if short is not None:
            return (int(short["m"]) * 60 + int(short["s"])) * _SECOND + _fraction(short["f"])
    if found is None:
        return None
    part = found.groupdict()
    try:
        day = _day(part, months_first=months_first)
    except (ValueError, OverflowError):
        return None
    hour, minute, second = (int(part[name] or 0) for name in "hms")
    if part["half"]:
        hour = hour % 12 + (12 if part["half"][0] in "pP" else 0)
    if hour > 24 or minute > 59 or second > 60:
        return None
    clock = (hour * 3600 + minute * 60 + second) * _SECOND + _fraction(part["f"])
    return day * _DAY + clock - _offset(part["zone"] or "")


def _fraction(digits: str | None) -> int:
    return int((digits or "0")[:9].ljust(9, "0"))


def _day(part: "dict[str, Any]", *, months_first: bool) -> int:
    """Return the day since 1970; 0 if a stamp has no day, the day of the year if it has no year, or days elapsed."""
    if part.get("E") is not None:
        return int(part["E"])
    if part.get("Y") is None:
        return 0 if part.get("N") is None else _day_of_year(part["N"])
    year = int(part["Y"])
    year += 2000 if year < 100 else 0
    if part.get("N") is not None:
        found = date(year, 1, 1) + timedelta(days=_day_of_year(part["N"]))
    else:
        word = part.get("word")
        month, day = part.get("M") if word is None else _MONTHS[word.casefold()], part.get("D")
        if month is None or day is None:
            month, day = (part["one"], part["two"]) if months_first else (part["two"], part["one"])
        found = date(year, int(month), int(day))
    days = (found - _EPOCH).days
    if found.year != year or not -100_000 < days < 100_000:
        raise ValueError(year)
    return days


def _day_of_year(text: str) -> int:
    """Return the day of the year, counted from 0."""
    if not 1 <= int(text) <= 366:
        raise ValueError(text)
    return int(text) - 1


def continue_over_midnight(stamps: NDArray[np.int64]) -> NDArray[np.int64]:
    """Move times without a date to the next day where they fall back by most of a day.

    Times of a day of the year are moved to the next year where they fall back by a year.

    Parameters
    ----------
    stamps : ndarray of int64, shape (n,)
        Times [ns]; the least integer where there is none.

    Returns
    -------
    ndarray of int64, shape (n,)
        The times [ns].
    """
    there = stamps != np.iinfo(np.int64).min
    if not there.any() or stamps[there].max() >= _MOST_DAYS * _DAY:
        return stamps
    inside = stamps[there]
    if inside.max() >= 2 * _DAY:  # days of the year: 1 January may follow the last
        ended = np.diff(inside) < -_LEAST_DAYS * _DAY
        days = np.concatenate(([0], np.cumsum(np.where(ended, inside[:-1] // _DAY + 1, 0))))
    else:
        days = np.concatenate(([0], np.cumsum(np.diff(inside) < -_DAY // 2)))
    out = stamps.copy()
    out[there] = inside + _DAY * days
    return out


def seconds_from_first(stamps: Stamps) -> NDArray[np.float64]:
    """Return times as seconds from the first one.

    Parameters
    ----------
    stamps : ndarray of datetime64[ns], shape (n,)
        The times, some of which may be missing.

    Returns
    -------
    ndarray, shape (n,)
        The seconds [s], NaN for a missing time.

    Examples
    --------
    >>> seconds_from_first(np.array(["2026-03-01T12:00:00.5", "NaT", "2026-03-01T12:00:02"], "datetime64[ns]"))
    array([0. , nan, 1.5])
    """
    there = ~np.isnat(stamps)
    if not there.any():
        return np.full(len(stamps), np.nan)
    elapsed = (stamps - stamps[int(np.argmax(there))]).astype(np.int64) * 1e-9
    return np.where(there, elapsed, np.nan)
