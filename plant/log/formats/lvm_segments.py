"""Segments of a LabVIEW measurement file, of which each has a header, as the rows of one log."""

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from plant.log.clock.stamps import is_stamp, read_stamps
from plant.log.formats.csv_loggers import HEADER_ENDS
from plant.log.headings import unit_or_none

if TYPE_CHECKING:
    from plant.log.formats.csv_layout import Layout

FIRST_LINE, LONGEST_HEADER = "Channels", 40
"""How the header of a segment begins, and the most lines that it has [count]."""

_COMMENT = "#"
"""What a line of a header is turned into."""


def joined_segments(rows: Iterable[list[str]], layout: "Layout", moved: list[float]) -> Iterator[list[str]]:
    """Yield the rows of all segments, with comments in place of the headers of those after the first.

    Times that begin again in a segment are counted from the date and time of its header, as LabVIEW counts them. What
    has other names or units, or no time, stays as it is: its header is then no row of numbers.

    Parameters
    ----------
    rows : iterable of list of str
        Cells of each line below the first header.
    layout : Layout
        Of the first segment.
    moved : list of float
        Grows by the time that is added to those of a segment, where they begin again [s].
    """
    offset, last = 0.0, float("-inf")
    waiting = iter(rows)
    for row in waiting:
        if row[:1] != [FIRST_LINE] or layout.step is not None:
            last = _time(row, last)
            yield _moved(row, offset)
            continue
        header = [row]
        while len(header) < LONGEST_HEADER and not "".join(header[-1][:1]).startswith(HEADER_ENDS):
            if (line := next(waiting, None)) is None:
                break
            header.append(line)
        names, first = next(waiting, []), next(waiting, [])
        if not _is_same(header, names, layout):
            yield from (*header, names, first)
            continue
        yield from [[_COMMENT]] * (len(header) + 1)
        begins = _time(first, last)
        if begins <= last:
            offset = _seconds_between(layout.began, header, offset)
            moved.append(offset)
        last = begins
        yield _moved(first, offset)


def _time(row: Sequence[str], before: float) -> float:
    """Return the time of a row; that before it where it has none."""
    try:
        return float(row[0].replace(",", "."))
    except (ValueError, IndexError):
        return before


def _moved(row: list[str], offset: float) -> list[str]:
    """Return a row with its time counted from the beginning of the log."""
    if not offset or not row:
        return row
    time = _time(row, float("nan"))
    if time != time:
        return row
    point = "," if "," in row[0] else "."
    return [f"{time + offset:.9f}".replace(".", point), *row[1:]]


def _is_same(header: Sequence[Sequence[str]], names: Sequence[str], layout: "Layout") -> bool:
    """Return whether a header has the names and units of the first segment."""
    said = {row[0]: row[1:] for row in header if row}
    units = dict(enumerate(said.get("Y_Unit_Label", ()), start=1))
    return all(
        one.name == name.strip() and (not place or one.said == unit_or_none(units.get(place, "")))
        for place, (one, name) in enumerate(zip(layout.headings, [*names, *[""] * len(layout.headings)], strict=False))
    )


def _seconds_between(began: str, header: Sequence[Sequence[str]], before: float) -> float:
    """Return the time from the beginning of the log to that of a segment [s]; that of the last one if none is told."""
    said = {row[0]: row[1].strip() for row in header if len(row) > 1}
    stamps = [began, f"{said.get('Date', '')} {said.get('Time', '')}"]
    if not all(map(is_stamp, stamps)):
        return before
    first, here = read_stamps(stamps, lambda *_: None).astype(np.int64)
    return float(here - first) * 1e-9
