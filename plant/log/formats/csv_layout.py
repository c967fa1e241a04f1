"""The layout of a text log: encoding, delimiter, decimal comma, lines above the header, row of units."""

import io
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from operator import and_
from pathlib import Path

from plant.errors import LogError
from plant.log.formats.cell_texts import (
    NUMBER,
    is_data_row,
    is_label_row,
    is_text,
    is_value,
    mostly_stamps,
    unit_behind,
    without_unit,
)
from plant.log.formats.csv_lines import BLANKS, COMMENT, cells_of, lines_above, unplaced_names
from plant.log.formats.csv_loggers import LOGGERS, Text, stated_scales, without_remarks
from plant.log.formats.layouts_seen import remember_layout, remembered_layout
from plant.log.formats.packed import open_unpacked
from plant.log.formats.quoted_header import with_quoted_header
from plant.log.formats.thousands import decimal_point_of, require_decimal_points, require_ungrouped
from plant.log.headings import Heading, is_unit_row, names_and_units

INSPECTED_BYTES = 1 << 18
"""Bytes of a log that are looked at to tell how it is written."""

LINES = 300
"""Lines of it, at most."""

MOST_ZEROS = 0.02
"""Bytes of zero at the start of a text, as a logger leaves where its power fails; more are of another encoding
[fraction]."""

BINARY_REFUSAL = (
    "a text file is needed for a CSV log, got binary data; export a logger's own format as CSV, MDF, TDMS or MAT"
)

DELIMITERS = (",", ";", "\t", "|", BLANKS)

_MOST_COLUMNS = 10_000


@dataclass(frozen=True)
class Layout:
    """Layout of a text log.

    Parameters
    ----------
    headings : tuple of Heading
        What the columns are called.
    skipped : int
        Lines above the first row of data.
    delimiter, decimal_point : str
        One character each; a blank stands for any number of blanks.
    encoding : str
        As Python calls it.
    stamped : frozenset of int
        Columns of dates or times of the day.
    step : float or None
        Time between rows [s], where the lines above give it in place of a column.
    in_cells : Mapping[int, str]
        Units that stand behind each number of a column, by its place.
    scales : Mapping[int, tuple[float, float]]
        Scale factor [1] and offset [unit of the column] that the file states, by the column's place; applied or not.
    began : str
        Date and time of the first of several segments, of which each has a header; empty for other logs.
    unplaced : tuple of str
        Names above the columns that are more or fewer than these, so that none is used.
    """

    headings: tuple[Heading, ...]
    skipped: int
    delimiter: str
    decimal_point: str
    encoding: str = "utf-8"
    stamped: frozenset[int] = frozenset()
    step: float | None = None
    in_cells: Mapping[int, str] = field(default_factory=dict[int, str])
    scales: Mapping[int, tuple[float, float]] = field(default_factory=dict[int, tuple[float, float]])
    began: str = ""
    unplaced: tuple[str, ...] = ()


def layout_of(path: Path) -> Layout:
    """Return the layout of a text log, from its first lines.

    Raises
    ------
    LogError
        If it is empty, or no text.
    OSError
        If it cannot be read.
    """
    with open_unpacked(path) as file:
        start = file.read(INSPECTED_BYTES)
    if (known := remembered_layout(start, LINES)) is not None:
        _require_ungrouped_rows(start, known, str(path))
        return known
    encoding = _encoding(start, str(path))
    text = start.decode(encoding, errors="replace").removeprefix("\ufeff")
    lines = [line.rstrip("\n") for line in islice(io.StringIO(text, newline=None), LINES)]
    if len(start) == INSPECTED_BYTES and len(lines) < LINES:
        lines = lines[:-1] or lines  # the last line is incomplete
    layout = layout_of_lines(lines, encoding, str(path))
    layout = with_quoted_header(layout, lines, lambda some: layout_of_lines(some, encoding, str(path)))
    remember_layout(start, LINES, layout)
    return layout


def _require_ungrouped_rows(start: bytes, layout: Layout, source: str) -> None:
    lines = start.decode("latin-1").split("\n", LINES)[layout.skipped : LINES]
    rows = [cells for line in lines if len(cells := line.strip("\r").split(",")) == len(layout.headings)]
    require_ungrouped(rows, [one.name for one in layout.headings], source)


def _encoding(start: bytes, source: str) -> str:
    if start[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return "utf-16"
    zeros = Counter(place % 2 for place, one in enumerate(start[:2000]) if not one)
    if sum(zeros.values()) > MOST_ZEROS * len(start[:2000]):
        half = len(start[:2000]) // 2
        for side, name in ((1, "utf-16-le"), (0, "utf-16-be")):
            if zeros[side] > 0.9 * half > 0 and not zeros[1 - side]:
                return name
        raise LogError(BINARY_REFUSAL, source)
    try:
        start.decode("utf-8")
    except UnicodeDecodeError as error:
        if len(start) - error.start >= 4:  # more than a character that is cut off at the end
            return "cp1252"
    return "utf-8"


def layout_of_lines(lines: Sequence[str], encoding: str, source: str) -> Layout:
    """Return the layout of a text log.

    Parameters
    ----------
    lines : sequence of str
        Its first lines, without their ends.
    encoding : str
        As Python calls it.
    source : str
        What messages call the log.

    Raises
    ------
    LogError
        If there is nothing but blank lines, or no text.

    Examples
    --------
    >>> made = layout_of_lines(["Bench 2", "Zeit [s];Weg [mm]", "0,0;1,5", "0,1;1,6"], "utf-8", "a.csv")
    >>> made.delimiter, made.decimal_point, [one.bare for one in made.headings]
    (';', ',', ['Zeit', 'Weg'])
    """
    if not any(line.strip() for line in lines):
        raise LogError("a header line is needed, but the file is empty", source)
    if (found := _of_logger(lines, encoding, source)) is not None:
        return found
    head = "\n".join(lines[:5])
    strange = sum(one == "\ufffd" or (ord(one) < 32 and one not in "\t\n\x0c\x0b") for one in head)
    if strange > 0.1 * len(head) or "\0" in head:
        raise LogError(BINARY_REFUSAL, source)
    absent = [one for one in DELIMITERS if one != BLANKS and not any(one in line for line in lines)]
    # delimiters that occur in no line all give the same single cells: the first of them stands for all
    tried = [one for one in DELIMITERS if one not in absent[1:]]
    block = max((_block(lines, one) for one in tried), key=lambda one: one.score)
    if not block.score or _header_parts_at_commas(lines, block):
        return _header_only_layout(lines, encoding, source)
    made, rows = block.layout(lines, encoding), [row for _, row in block.rows]
    require_ungrouped(rows, [one.name for one in made.headings], source)
    if block.delimiter == "," and block.rows[0][0]:
        require_decimal_points(rows, cells_of(lines[block.rows[0][0] - 1], ","), source)
    return made


def _of_logger(lines: Sequence[str], encoding: str, source: str) -> Layout | None:
    """Return the layout of an export whose header tells more than names and units; None for other texts."""
    for begin, with_header in LOGGERS:
        if (skipped := begin(lines)) is None:
            continue
        below = without_remarks(lines[skipped:])
        layout = layout_of_lines(below, encoding, source)
        above, rows = ([cells_of(one, layout.delimiter) for one in some] for some in (lines[:skipped], below))
        if (told := with_header(layout, Text(above, rows, source))) is not None:
            return replace(told, skipped=layout.skipped + skipped)
    return None


def _header_parts_at_commas(lines: Sequence[str], block: "_Block") -> bool:
    """Return whether rows that read as one number have as many commas as the line above: `0,1` is two cells then."""
    first, (cell, *others) = block.rows[0]
    above = next((line for line in reversed(lines[:first]) if line.strip()), "")
    commas = above.count(",")
    return not others and cell.count(",") == commas > 0


def _header_only_layout(lines: Sequence[str], encoding: str, source: str) -> Layout:
    """Return the layout of a log without a row of numbers: its first line is the header."""
    first = next(place for place, line in enumerate(lines) if line.strip())
    delimiter = max(",;\t", key=lines[first].count)
    names = [COMMENT.sub("", name) for name in cells_of(lines[first], delimiter)]
    if len(names) > _MOST_COLUMNS:
        raise LogError(f"at most {_MOST_COLUMNS:,} columns are read, the first line has {len(names):,} cells", source)
    return Layout(tuple(map(Heading, names)), first + 1, delimiter, ".", encoding)


@dataclass(frozen=True)
class _Block:
    """The rows of numbers of a log, if cells are apart by one delimiter."""

    delimiter: str
    rows: "tuple[tuple[int, tuple[str, ...]], ...]" = ()
    numeric: tuple[bool, ...] = ()

    @property
    def score(self) -> float:
        """Score of a layout, by its numeric rows and columns; blanks separate only if nothing else does."""
        wide = sum(self.numeric)
        likes = 0.5 if self.delimiter in (BLANKS, "|") else 1.0
        if not self.rows or (wide < 2 and len(self.numeric) > 1):
            return 0.0
        return likes * len(self.rows) * wide**2 / len(self.numeric)

    def layout(self, lines: Sequence[str], encoding: str) -> Layout:
        """Return the layout, with the names and units that stand above the rows."""
        first, width = self.rows[0][0], len(self.numeric)
        for place, _ in self.rows[1:2]:
            beneath = cells_of(lines[place - 1], self.delimiter)
            if place == 2 and not first and is_unit_row(beneath):
                first = place  # the row above the units holds channel numbers
        while first and is_data_row(cells := cells_of(lines[first - 1], self.delimiter), width):
            if self._is_labelled(cells):
                break
            first -= 1
        closed = all(not row[-1] for _, row in self.rows)
        above = lines_above(lines[:first], self.delimiter, width, closed=closed)
        names, units = names_and_units(above, width)
        unplaced = () if above else unplaced_names(lines[:first], self.delimiter, width)
        point = "." if self.delimiter == BLANKS else self._decimal_point()
        stamped = frozenset(
            place
            for place, one in enumerate(self.numeric)
            if one and mostly_stamps([row[place] for _, row in self.rows[:9]])
        )
        clocks = {place for place in stamped if any(":" in row[place] for _, row in self.rows[:9])}
        stamped = frozenset(clocks) or stamped  # beside a column of times, a column of days is not needed
        in_cells = self._units_in_cells()
        headings = tuple(
            Heading(name, None if place in stamped else in_cells.get(place, unit), place in stamped)
            for place, (name, unit) in enumerate(zip(names, units, strict=True))
        )
        wide = {cells[0]: cells for line in lines[:first] if len(cells := cells_of(line, self.delimiter)) == width}
        told = Layout(headings, first, self.delimiter, point, encoding, stamped, in_cells=in_cells, unplaced=unplaced)
        return replace(told, scales=stated_scales(wide))

    def _is_labelled(self, cells: Sequence[str]) -> bool:
        """Return whether a row begins with a text where no row has anything, as `Length, 4000`."""
        return is_text(cells[0]) and not any(row[0] for _, row in self.rows)

    def _decimal_point(self) -> str:
        cells = (without_unit(cell) for _, row in self.rows for cell in row)
        return decimal_point_of(cell for cell in cells if NUMBER.fullmatch(cell))

    def _units_in_cells(self) -> dict[int, str]:
        """Return the unit behind most numbers of a column, by its place; others of it are no numbers."""
        found: dict[int, str] = {}
        for place in range(len(self.numeric)):
            units = Counter(unit_behind(row[place]) for _, row in self.rows)
            (unit, count), *_ = units.most_common(1)
            if unit and 2 * count > len(self.rows):
                found[place] = unit
        return found


def _block(lines: Sequence[str], delimiter: str) -> _Block:
    """Return the rows of data if cells are apart by a delimiter: most columns of most rows are numbers."""
    split = [
        (place, tuple(cell.strip() for cell in cells_of(line, delimiter)))
        for place, line in enumerate(lines)
        if line.strip()
    ]
    judged = [(place, row, tuple(map(is_value, row))) for place, row in split if len(row) <= _MOST_COLUMNS]
    # a blank separates thousands, rather than two numbers, only if something else separates the cells
    judged = [(place, row, values) for place, row, values in judged if len(row) > 1 or " " not in "".join(row)]
    judged = [one for one in judged if any(one[2])]
    widths = Counter(len(row) for _, row, _ in judged)
    if not widths:
        return _Block(delimiter)
    width = max(widths, key=lambda one: (widths[one], one))
    judged = [one for one in judged if len(one[1]) == width]
    numeric = tuple(2 * sum(column) > len(judged) for column in zip(*(values for _, _, values in judged), strict=True))
    count = sum(numeric)
    whole = [
        (place, row)
        for place, row, values in judged
        if 2 * sum(one and (value or not cell) for one, value, cell in zip(numeric, values, row, strict=True)) > count
    ]
    full = {place for place, _, values in judged if 2 * sum(map(and_, numeric, values)) > count}
    while whole and is_label_row(whole[0][1], numeric) and not {whole[0][0], whole[0][0] + 1} <= full:
        del whole[0]  # above the names, such as a rate or a range
    begins = ["".join(row[:1]) for _, row in whole]
    labels = next((count for count, one in enumerate(begins) if not is_text(one)), 0)
    if not any(begins[labels:]):  # texts stand only in front of rows above the data
        del whole[:labels]
    return _Block(delimiter, tuple(whole), numeric) if whole else _Block(delimiter)
