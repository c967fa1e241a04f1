"""Headings of columns: the name, and the unit in brackets, in a row of units or in an attribute."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from difflib import SequenceMatcher
from functools import cached_property

from plant.unit_text import plain_unit
from plant.units import converts

_BRACKETED = re.compile(r"^(?P<name>.*\S)\s*(?:\[(?P<square>[^\[\]]{0,40})\]|\((?P<round>[^()]{0,40})\))$")
_UNIT_AFTER_NAME = re.compile(r"^(?P<name>.*\S)(?:\s+/\s*|\s*,\s+|\s+in\s+)(?P<unit>\S{1,20})$")
_INDEX = re.compile(r"0|[2-9]|[1-9]\d+")
"""The number of an element; 1 is the unit of a ratio."""

_UNITS_FOLLOW = re.compile(r"(?:\w+[ _])?(?:units?|einheit(?:en)?) ?:?", re.IGNORECASE)
_UNIT_LABEL = re.compile(r"^units?:\s*", re.IGNORECASE)
"""What Simulink writes in front of each unit."""

_NO_UNIT = ("", "-", "--", "[-]", "[]", "1", "n/a", "none")


@dataclass(frozen=True)
class Heading:
    """Heading of a column.

    Parameters
    ----------
    name : str
        The whole name.
    said : str or None
        Unit that the file gives beside the name; None where it gives none.
    stamped : bool
        Whether it holds dates or times of the day.
    """

    name: str
    said: str | None = None
    stamped: bool = False

    @cached_property
    def unit(self) -> str | None:
        """Unit of the column as the file gives it, or None."""
        return self.said if self.said is not None else _split_unit(self.name)[1]

    @cached_property
    def bare(self) -> str:
        """The name without its unit."""
        return _split_unit(self.name)[0]

    @cached_property
    def stem(self) -> str:
        """The bare name in lower case, its words joined by underscores."""
        parted = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", self.bare)
        return re.sub(r"[\W_]+", "_", parted.lower()).strip("_")


LEAST_ALIKE, SHORTEST_WORD = 0.8, 4
"""Least share of common letters, and fewest letters, of a word that counts as misspelt [fraction], [count]; judged."""


def is_misspelt(stem: str, meant: str) -> bool:
    """Return whether a name is another one with a letter wrong, missing or too many in some of its words.

    Examples
    --------
    >>> is_misspelt("differential_presure", "differential_pressure"), is_misspelt("pressure_c", "pressure_a")
    (True, False)
    """
    words, wanted = stem.split("_"), meant.split("_")
    if len(words) != len(wanted) or stem == meant:
        return False
    return all(
        one == other
        or (min(len(one), len(other)) >= SHORTEST_WORD and SequenceMatcher(None, one, other).ratio() >= LEAST_ALIKE)
        for one, other in zip(words, wanted, strict=True)
    )


_WIDE = str.maketrans("\uff08\uff09\uff3b\uff3d", "()[]")
"""Brackets as wide as the letters of Chinese and Japanese."""


_BEHIND_FACTOR = re.compile(r"(?:\d[.,]\d+|[/x*^\u00d7]\s?-?\d+|\d[eE]-?\d+)[\s_]*[^\W\d_]+(?:/\w+)?\W*$")


def hides_unit(name: str) -> bool:
    """Return whether the last word of a name is not its unit: it stands in brackets, or behind a fraction or a factor.

    Examples
    --------
    >>> [hides_unit(name) for name in ("Position (0.1 mm)", "Position 1/100 mm", "Position mm", "Pressure 1 bar")]
    [True, True, False, False]
    """
    return _BRACKETED.match(name.translate(_WIDE)) is not None or _BEHIND_FACTOR.search(name) is not None


def _split_unit(name: str) -> tuple[str, str | None]:
    name = name.translate(_WIDE)
    if (found := _BRACKETED.match(name)) and not _INDEX.fullmatch(found["square"] or ""):
        inside = found["square"] if found["square"] is not None else found["round"]
        if found["square"] is not None or is_unit(inside):
            return found["name"].strip(), unit_or_none(inside)
    if (found := _UNIT_AFTER_NAME.match(name)) and is_unit(found["unit"]):
        return found["name"].strip(), found["unit"]
    return name.strip(), None


def unit_or_none(text: str) -> str | None:
    """Return the unit that a file gives; None if it states that there is none."""
    return None if text.strip().lower() in _NO_UNIT else text.strip()


def is_unit(text: str) -> bool:
    """Return whether a text is a unit that a bench uses, in its usual spelling.

    Examples
    --------
    >>> is_unit("mm/s"), is_unit("um"), is_unit("actual"), is_unit("9**9")
    (True, True, False, False)
    """
    text = text.strip().strip("[]()").strip()
    try:
        spelt = plain_unit(text, angular=True)
    except ValueError:
        return False
    words = re.findall(r"[^\W\d_]+|°[CF]?|%", spelt)
    return bool(words) and all(word in _KNOWN or word.lstrip("kmMGuµnhc") in _SCALED for word in words)


_SCALED = frozenset(("m", "s", "A", "V", "N", "g", "J", "W", "Pa", "Hz", "rad", "bar", "Ω", "l", "L"))
_KNOWN = _SCALED | frozenset(
    (
        *("rpm", "rev", "turn", "revolution", "min", "sec", "msec", "usec", "h", "d", "hour", "minute", "day"),
        *("psi", "ksi", "kgf", "lbf", "atm", "torr", "mmHg", "pascal", "in", "inch", "ft", "thou", "meter"),
        *("km", "dm", "cm", "mm", "um", "µm", "nm", "krpm", "rps", "kph", "mph", "mps"),
        *("metre", "deg", "degree", "radian", "°", "degC", "degF", "°C", "°F", "K", "kelvin", "volt", "newton"),
        *("second", "lpm", "%"),
    )
)


def headings_of(names: Sequence["str | Heading"]) -> list[Heading]:
    """Return names as headings, without surrounding blanks and quotes.

    Parameters
    ----------
    names : sequence of str or Heading
        As the file gives them.
    """
    given = [one if isinstance(one, Heading) else Heading(one) for one in names]
    return [replace(one, name=one.name.strip().removeprefix("\ufeff").strip()) for one in given]


_CALLED_TIME = re.compile(r"(^|_)(t|time|zeit)(_|$)")


def timeless_hint(headings: Sequence[Heading]) -> str:
    """Return what to do about a log of which no column is surely the time.

    Parameters
    ----------
    headings : sequence of Heading
        Of all its columns. Where several hold times, rows that are taken as evenly spaced would mix their channels.

    Examples
    --------
    >>> timeless_hint([Heading("a"), Heading("b")])
    '; to read a log without time, give --sample-time'
    >>> timeless_hint([Heading("_start", stamped=True), Heading("_time", stamped=True)])
    "; if '_time' is the time, --columns 'time_s=_time'; else give --sample-time"
    >>> timeless_hint([Heading("t_a [s]"), Heading("a"), Heading("t_b [s]"), Heading("b")])[:33]
    "; 't_a [s]' and 't_b [s]' are bot"
    """
    timed = [
        one
        for one in headings
        if one.stamped or (converts(one.unit, "s") if one.unit else _CALLED_TIME.search(one.stem) is not None)
    ]
    timed = [one for one in timed if _CALLED_TIME.search(one.stem)] or timed  # a start and an end are no clock
    if not timed:
        return "; to read a log without time, give --sample-time"
    first = timed[0].name[:40]
    unit = "" if timed[0].stamped else f":{timed[0].unit or 'UNIT'}"
    if len(timed) == 1:
        return f"; if {first!r} is the time, --columns 'time_s={first}{unit}'; else give --sample-time"
    second = timed[1].name[:40]
    return (
        f"; {first!r} and {second!r} are both times: if all channels were taken at the first, --columns "
        f"'time_s={first}{unit}'; else save each channel with its own time, called time_s, as a file of its own, and "
        "add the others by --with FILE"
    )


def is_unit_row(row: Sequence[str]) -> bool:
    """Return whether cells are units or state that there is none. The first cell may be a label for the row.

    Examples
    --------
    >>> is_unit_row(["Unit", "rpm", "-"]), is_unit_row(["s", "rpm", "ten"]), is_unit_row(["", "Unit: rpm"])
    (True, False, True)
    """
    cells = [_UNIT_LABEL.sub("", cell) for cell in (row[1:] if _UNITS_FOLLOW.fullmatch("".join(row[:1])) else row)]
    return any(map(is_unit, cells)) and all(unit_or_none(cell) is None or is_unit(cell) for cell in cells)


def begins_with_time(cells: Sequence[str]) -> bool:
    """Return whether cells are units of which the first is that of a time, so that none in front of it is lacking.

    Parameters
    ----------
    cells : sequence of str
        Cells of a row.

    Examples
    --------
    >>> begins_with_time(["s", "mm"]), begins_with_time(["mm", "s"])
    (True, False)
    """
    return is_unit_row(cells) and converts(cells[0].strip("[]()"), "s")


def names_and_units(above: Sequence[list[str]], width: int) -> tuple[list[str], list[str | None]]:
    """Return names and units from the lines above the data; columns without a name are numbered.

    Parameters
    ----------
    above : sequence of list of str
        Cells of the lines right above the data, as many as it has columns.
    width : int
        Columns [count].
    """
    units: list[str | None] = [None] * width
    names = above
    for row in [*above[1:], *above[:1]] if len(above) > 1 else []:  # units rarely stand above the names
        if is_unit_row(row):
            said = [_UNIT_LABEL.sub("", cell) for cell in row]
            units = [unit_or_none(cell.strip("[]()")) if is_unit(cell) else None for cell in said]
            names = [other for other in above if other is not row]
            break
    best = max(names, key=_worth_as_names, default=[""] * width)
    return [name or f"column {place + 1}" for place, name in enumerate(best)], units


def _worth_as_names(row: Sequence[str]) -> tuple[int, int]:
    """Return how many names a row has, and how many of them state a unit."""
    return len(set(row) - {""}), sum(_split_unit(cell)[1] is not None for cell in row)
