"""Dates of logs: the day-first form, dates from wrong clocks, and the wording of future dates.

See decision 309.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from itertools import pairwise
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from experiments.fleet.naming import ActuatorAndDate

DAY_FIRST = re.compile(
    r"(?<![0-9])(?P<day>0[1-9]|[12]\d|3[01])\.(?P<month>0[1-9]|1[0-2])\.(?P<year>(?:19|20)\d\d)(?![0-9])"
)
"""A date with dots, such as 22.11.2026. Where dates are written with dots, the day comes first."""

MONTHS = (
    *("January", "February", "March", "April", "May", "June"),
    *("July", "August", "September", "October", "November", "December"),
)

DAY_IN_WORDS = re.compile(
    r"(?<![A-Za-z0-9-])(?P<day>0?[1-9]|[12]\d|3[01])(?P<between>[-_. ]?)"
    rf"(?P<month>{'|'.join(f'{name[:3]}(?:{name[3:]})?' for name in MONTHS)})"
    r"(?P=between)(?P<year>(?:19|20)\d\d)(?![0-9])",
    re.IGNORECASE,
)
"""A date with its month in English, such as 22-Nov-2026. Behind a letter or a hyphen the number may belong to the
actuator: P-12-Nov-2026."""

DAY_IN_SIGNS = re.compile(
    r"(?<![0-9])(?P<year>(?:19|20)\d\d)[年년] ?(?P<month>0?[1-9]|1[0-2])[月월] ?(?P<day>[12]\d|3[01]|0?[1-9])[日号號일]"
    r"(?:[ _T-]?(?P<hour>2[0-3]|[01]?\d)[时時点點시] ?(?P<minute>[0-5]?\d)[分분](?: ?(?P<second>[0-5]?\d)[秒초])?)?"
)
"""A date as it is written in Chinese, Japanese or Korean, with or without a time."""

WRITTEN = (
    r"\d{1,2}[-_. ]?[A-Za-z]{3,9}[-_. ]?\d{4}(?:[T _-]\d\d[-_.:]?\d\d(?:[-_.:]?\d\d)?)?"
    r"|\d{4}[年년][ \d]+[月월][ \d]+[日号號일](?:[ _T\d]+[时時点點시][ \d]+[分분](?:[ \d]+[秒초])?)?"
)
"""What a date with words or signs may look like in a pattern; `year_first` reads it."""

LONGEST_GAP_DAYS = 1000.0
"""Longest time between two logs of a fleet [day]. If a gap is longer, the smaller group of logs has a wrong date."""

LARGEST_WRONG_SHARE = 0.1
"""Largest share of logs that may have a wrong date [fraction]. If more lie apart, the fleet has a gap, not a wrong
clock."""

HOURS, DAYS, PARTS = 2.0, 45.0, 730.0
"""How far ahead a date is shown with its hour, with its day, and with the part of its month [day]."""

OUT_OF_SIGHT = "not within sight"
"""Forecast text if no prediction reaches the limit."""

LAST_DATE = datetime(9999, 1, 1, tzinfo=UTC)
EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


def year_first(text: str) -> str:
    """Return a text in which each date of another form is rewritten as year, month, day.

    Examples
    --------
    >>> year_first("P-12_22.11.2026"), year_first("P-12_2026-11-22")
    ('P-12_2026-11-22', 'P-12_2026-11-22')
    >>> year_first("P-12_22-Nov-2026"), year_first("P-12_2026年11月2日8时05分")
    ('P-12_2026-11-22', 'P-12_2026-11-02T08-05')
    """
    for form in (DAY_FIRST, DAY_IN_WORDS, DAY_IN_SIGNS):
        text = form.sub(_iso_date, text)
    return text


def _iso_date(found: re.Match[str]) -> str:
    parts = found.groupdict()
    month = parts["month"]
    number = int(month) if month.isdigit() else [name[:3].lower() for name in MONTHS].index(month[:3].lower()) + 1
    day = f"{parts['year']}-{number:02d}-{int(parts['day']):02d}"
    time = [f"{int(parts[name]):02d}" for name in ("hour", "minute", "second") if parts.get(name)]
    return f"{day}T{'-'.join(time)}" if time else day


def without_wrong_clocks(named: "Mapping[str, ActuatorAndDate]") -> "dict[str, ActuatorAndDate]":
    """Remove the date of the few logs whose date lies years before or after those of all others.

    A logger whose clock was never set writes 1970 or 2000. Such a log would be the first or the last of its actuator.

    Parameters
    ----------
    named : Mapping[str, ActuatorAndDate]
        By file.

    Returns
    -------
    dict[str, ActuatorAndDate]
        By file; a log with a wrong date has a ``problem`` in place of an actuator and a date.
    """
    dated = sorted((one.place, file) for file, one in named.items() if one.has_calendar_date and one.place is not None)
    groups: list[list[str]] = [[dated[0][1]]] if dated else []
    for (before, _), (place, file) in pairwise(dated):
        if place - before > LONGEST_GAP_DAYS:
            groups.append([])
        groups[-1].append(file)
    most = max(groups, key=len, default=[])
    far = [file for group in groups if group is not most for file in group]
    if len(far) > LARGEST_WRONG_SHARE * len(dated):
        return dict(named)
    said = "its date {} is years away from those of all other logs: is the logger's clock set?"
    wrong = {file: said.format(named[file].day) for file in far}
    return {
        file: replace(one, actuator="", date="", place=None, problem=wrong[file]) if file in wrong else one
        for file, one in named.items()
    }


def date_text(place: float, ahead: float) -> str:
    """Return a date as text, as precise as the forecast justifies.

    Parameters
    ----------
    place : float
        Days since 1970-01-01 [day].
    ahead : float
        Time from the last log [day].

    Examples
    --------
    >>> date_text(20530.0, 9.0), date_text(20530.0, 100.0), date_text(20530.0, 900.0)
    ('18 March 2026', 'mid March 2026', '2026')
    >>> date_text(20530.6, 1.0)
    '2026-03-18 14:00'
    """
    date = min(EPOCH + timedelta(days=min(place, 2.9e6)), LAST_DATE)
    if ahead < HOURS:
        return f"{date:%Y-%m-%d %H:00}"
    month = f"{MONTHS[date.month - 1]} {date.year}"
    if ahead < DAYS:
        return f"{date.day} {month}"
    return f"{('early', 'mid', 'late')[min((date.day - 1) // 10, 2)]} {month}" if ahead < PARTS else str(date.year)


def short_months(text: str) -> str:
    """Return a text with the first three letters of each month.

    Examples
    --------
    >>> short_months("limit late November 2026 (5 October 2026 to mid March 2027)")
    'limit late Nov 2026 (5 Oct 2026 to mid Mar 2027)'
    """
    return re.sub(rf"\b({'|'.join(MONTHS)})\b", lambda found: found[0][:3], text)


def date_interval_text(places: Iterable[float], ahead: Iterable[float]) -> str:
    """Return the interval of a future date in words.

    Parameters
    ----------
    places : iterable of float
        Both ends, infinite beyond the horizon [day].
    ahead : iterable of float
        Time from the last log to each end [day].

    Examples
    --------
    >>> far = float("inf")
    >>> date_interval_text([20490.0, 20560.0], [60.0, 130.0]), date_interval_text([20490.0, far], [60.0, far])
    ('early February to mid April 2026', 'not before early February 2026')
    >>> date_interval_text([20490.0, 20491.0], [60.0, 61.0]), date_interval_text([20530.6, 20535.0], [1.0, 5.4])
    ('early February 2026', '18 to 23 March 2026')
    """
    (low, high), (first, last) = places, ahead
    if low == float("inf"):
        return OUT_OF_SIGHT
    begin = date_text(low, max(first, min(last, HOURS)))  # no hour if the end of the interval has none
    if high == float("inf"):
        return f"not before {begin}"
    end = date_text(high, last)
    short = begin
    for same in (end[-4:], end.rpartition(" ")[0].rpartition(" ")[2]):  # the year, then the month, if both ends have it
        short = short.removesuffix(f" {same}") if end != begin and last >= HOURS else short
    return begin if begin == end else f"{short} to {end}"
