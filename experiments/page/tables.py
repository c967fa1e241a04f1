"""Tables for readers: columns with units in the header, and cells formatted by their type."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import pandas as pd
from markupsafe import Markup

from experiments.page.numbers import MINUS, exact, exact_if_short, fixed, number

WORDS = 24
"""Length of a cell from which its column counts as text and needs a readable width [count]."""


@dataclass(frozen=True)
class Cell:
    """A cell with a class or markup in addition to its text.

    Parameters
    ----------
    tone : str
        Class of the cell: ``"good"``, ``"bad"``, ``"none"``, or empty.
    """

    text: str
    tone: str = ""


Shown: TypeAlias = "str | Cell | Markup"

Row: TypeAlias = Mapping[Any, Any]

UNITS: Mapping[str, tuple[str, float]] = {
    "_m_s": ("mm/s", 1e3),
    "_hz": ("Hz", 1.0),
    "_kg": ("kg", 1.0),
    "_pa": ("MPa", 1e-6),
    "_percent": ("%", 1.0),
    "_deg": ("°", 1.0),
    "_n": ("N", 1.0),
    "_s": ("s", 1.0),
    "_v": ("V", 1.0),
    "_w": ("W", 1.0),
}
"""Endings of column names: the unit shown, and the factor from the unit in the name."""


@dataclass(frozen=True)
class Column:
    """Display of one column of a data frame.

    Parameters
    ----------
    header : str, optional
        Heading; by default the name in words without its unit.
    unit : str, optional
        Unit as shown, after scaling; by default that of the name's ending in `UNITS`.
    scale : float, optional
        Factor from the unit in the name to the unit shown [dimensionless]; must be given with `unit`.
    digits : int, optional
        Significant digits. By default four, and a number that three digits give exactly is shown as it was given.
    words : callable, optional
        Converts a value to the text shown, in place of a number.
    of_row : callable, optional
        Converts a whole row to the text shown, if one value is not enough.
    """

    source: str
    header: str | None = None
    unit: str | None = None
    scale: float = 1.0
    digits: int | None = None
    words: Callable[[Any], Shown] | None = None
    of_row: Callable[[Row], Shown] | None = None

    def in_full(self) -> "Column":
        """Return the column with heading, unit and scale; missing ones are derived from its name."""
        ending = next((ending for ending in UNITS if self.source.endswith(ending)), "")
        header = self.source.removesuffix(ending).replace("_", " ") if self.header is None else self.header
        if self.unit is not None:
            return replace(self, header=header)
        unit, scale = UNITS.get(ending, ("", self.scale))
        return replace(self, header=header, unit=unit, scale=scale)


Columns: TypeAlias = Sequence[Column | str | Callable[[str], Column | None]]
"""Columns of a table. A plain name is shown in the format of its type.

A function is called with each column that is not named otherwise, and returns how to show it, or None."""


def _yes_or_no(good: bool) -> Cell:
    """Return a cell that says yes, or a highlighted no."""
    return Cell("yes", "good") if good else Cell("no", "bad")


def right_aligned(text: str) -> Cell:
    """Return a cell aligned to the right, like numbers."""
    return Cell(text, "number")


def exact_cell(value: float) -> Cell:
    """Return a cell with a number exactly as given.

    Parameters
    ----------
    value : float
        The number [any unit].
    """
    return right_aligned(exact(float(value)))


def decimals(count: int) -> Callable[[float | None], Cell]:
    """Return a formatter of cells with a given number of decimals.

    Returns
    -------
    callable
        From a number to its cell, in the format of `fixed`.
    """
    return lambda value: right_aligned(fixed(value, count))


def name_in_words(name: str) -> str:
    """Return a name in words."""
    return name.replace("_", " ")


def interval(low: str, high: str, digits: int = 4) -> Callable[[Row], str]:
    """Return a formatter of cells with both ends of an interval."""
    return lambda row: f"{number(row[low], digits)} to {number(row[high], digits)}"


def html_table(frame: pd.DataFrame, columns: Columns, caption: str, *, cards: bool = False) -> Markup:
    """Return a data frame as an HTML table in a sideways scrolling box; with cards, a phone shows one card per row."""
    shown = [column.in_full() for column in _columns_of_frame(frame, columns)]
    body = [[_cell(column, row, named=cards) for column in shown] for row in frame.to_dict("records")]
    head = Markup("").join(
        Markup('<th scope="col" class="{}">{}{}</th>').format(
            "number" if all('class="number"' in cell for cell in cells) else "",
            column.header,
            Markup("<small>{}</small>").format(column.unit) if column.unit else "",
        )
        for column, *cells in zip(shown, *body, strict=True)
    )
    wordy = [max((len(cell.striptags()) for cell in cells), default=0) > WORDS for cells in zip(*body, strict=True)]
    body = [[_words_cell(cell) if long else cell for cell, long in zip(row, wordy, strict=True)] for row in body]
    rows = Markup("\n").join(Markup("<tr>{}</tr>").format(Markup("").join(cells)) for cells in body)
    return Markup(
        '<div class="scroll" tabindex="0" role="region" aria-label="{}"><table{}>\n<caption>{}</caption>\n'
        "<thead><tr>{}</tr></thead>\n<tbody>\n{}\n</tbody></table></div>"
    ).format(caption, Markup(' class="cards whole"') if cards else "", caption, head, rows)


def _words_cell(cell: Markup) -> Markup:
    """Return a cell of a text column, which must not be narrow."""
    text = str(cell)  # a plain string, since Markup would escape the replacements
    if ' class="' in text.split(">", 1)[0]:
        return Markup(text.replace(' class="', ' class="words ', 1))  # noqa: S704 - it is markup already
    return Markup(text.replace("<td", '<td class="words"', 1))  # noqa: S704


def folded_tables(frame: pd.DataFrame, columns: Columns, by: str, count: str) -> Markup:
    """Return a long data frame as one table for each group of rows, opened by a click; paper shows the open ones.

    A checkbox on the page with the id ``every-row`` opens all of them.

    Parameters
    ----------
    by : str
        Column that names the group of a row; groups are in the order of their first rows.
    count : str
        Column whose values are counted in the heading of a group.
    """
    made: list[Markup] = []
    others = [one for one in columns if by not in (one, getattr(one, "source", None))]
    for name, group in frame.groupby(by, sort=False):
        counts = group[count].value_counts()
        told = ", ".join(f"{number} {value}" for value, number in counts.items())
        one = len(counts) == 1
        line = (
            f"{name}: {len(group)} row{'' if len(group) == 1 else 's'}{f', {counts.index[0]}' if one else f' ({told})'}"
        )
        made.append(
            Markup('<details class="group"><summary>{}</summary>{}</details>').format(
                line, html_table(group, others, f"Rows of {name}.", cards=True)
            )
        )
    return Markup("\n").join(made)


def _columns_of_frame(frame: pd.DataFrame, columns: Columns) -> Iterator[Column]:
    told = {entry.source if isinstance(entry, Column) else entry for entry in columns}
    for entry in columns:
        if callable(entry):
            others = (entry(str(name)) for name in frame.columns if name not in told)
            yield from (column for column in others if column is not None)
        else:
            yield Column(entry) if isinstance(entry, str) else entry


def _cell(column: Column, row: Row, *, named: bool) -> Markup:
    unit = f" [{column.unit}]" if column.unit else ""
    head = Markup(' data-head="{}{}"').format(column.header, unit) if named else ""
    value = row[column.source]
    if column.of_row is not None:
        shown = column.of_row(row)
    elif column.words is not None:
        shown = column.words(value)
    else:
        shown = _by_type(column, value)
    if isinstance(shown, Cell):
        return Markup('<td class="{}"{}>{}</td>').format(shown.tone, head, shown.text)
    return Markup("<td{}>{}</td>").format(head, shown)


def _by_type(column: Column, value: Any) -> Shown:
    if isinstance(value, str | Cell):
        return value
    if isinstance(value, bool):
        return _yes_or_no(value)
    if isinstance(value, int) and column.scale == 1.0:
        return right_aligned(str(value).replace("-", MINUS))
    shown = None if value is None else column.scale * float(value)
    if column.digits is None and shown is not None:
        return right_aligned(exact_if_short(shown))
    return right_aligned(number(shown, column.digits or 4))
