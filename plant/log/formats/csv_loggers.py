"""Headers that LabVIEW, SignalExpress and TwinCAT Scope write above the rows of a text log."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise, zip_longest
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from plant.errors import LogError
from plant.log.clock.stamps import is_stamp, read_stamps
from plant.log.headings import Heading, is_unit, unit_or_none

if TYPE_CHECKING:
    from plant.log.formats.csv_layout import Layout

LABVIEW, HEADER_ENDS = "LabVIEW Measurement", "***End_of_Header***"

TWINCAT_STEP = "SampleTime[ms]"
"""How TwinCAT Scope says the sample time of each channel."""

_TWINCAT_START = "Starttime of export"
"""How an export begins whose header has the names alone."""

OWN_CLOCKS = (
    "its channels have clocks that differ, so that a row holds values of several times; export channels that were "
    "sampled together, or fill the slow ones with their previous value"
)
"""What is said of channels that stand beside each other, and were not sampled together."""

_LEAST_TICKS = 1e16
"""Ticks that a clock since 1601 has counted by 1632, and no count of milliseconds reaches [100 ns]."""

_CLOCKS = ((Heading("Time", "ms"), 1.0), (Heading("Time"), 1e-4))
"""The heading of its clocks, and what they count in [ms]."""

_NUMBER = re.compile(r"[-+]?\d+(?:[.,]\d*)?(?:[eE][-+]?\d+)?")

_SCALE_ROWS = tuple(
    re.compile(one, re.IGNORECASE)
    for one in (r"scal(?:e|ing)(?:[ _]?factor)?|factor|faktor|gain|slope|multiplier|skalierung(?:sfaktor)?", r"offset")
)
"""How headers call the scale of each channel, and its offset; whether they are applied already, none says."""


class Text(NamedTuple):
    """Lines of a log, as cells.

    Parameters
    ----------
    above, rows : sequence of sequence of str
        Cells of the lines of the header, and of rows below it.
    source : str
        What messages call the log.
    """

    above: Sequence[Sequence[str]]
    rows: Sequence[Sequence[str]]
    source: str


def without_remarks(lines: Sequence[str]) -> list[str]:
    """Return lines whose header does not name LabVIEW's column of comments, if rows have none.

    Parameters
    ----------
    lines : sequence of str
        The header, and rows below it.

    Examples
    --------
    >>> without_remarks(["X_Value,Speed,Comment", "0.0,3.1"])
    ['X_Value,Speed', '0.0,3.1']
    """
    header, *rows = lines or [""]
    row = next((one for one in rows if one.strip()), "")
    found = re.fullmatch(r"(.*)(\W)Comment", header.rstrip())
    if found and row.count(found[2]) == header.rstrip().count(found[2]) - 1:
        header = found[1]
    return [header, *rows]


def with_labview_header(layout: "Layout", text: Text) -> "Layout":
    """Return the layout of a LabVIEW measurement file with what its two headers say: units, and the time step.

    Parameters
    ----------
    layout : Layout
        Of the rows.
    text : Text
        Its lines.

    Raises
    ------
    LogError
        If rows have no time, and the time step is not that of all channels.
    """
    said = {row[0]: row[1:] for row in text.above if row}
    has_x = (said.get("X_Columns") or [""])[0].strip() != "No"
    units = {**dict(enumerate(said.get("Y_Unit_Label", []), start=1)), 0: "s" if has_x else ""}
    headings = tuple(
        Heading(one.name, unit_or_none(units.get(place, "")), one.stamped) for place, one in enumerate(layout.headings)
    )
    step = None if has_x else _step(said.get("Delta_X", ()))
    if not has_x and step is None and said.get("Delta_X"):
        raise LogError(OWN_CLOCKS, text.source)
    began = " ".join((said.get(one) or [""])[0].strip() for one in ("Date", "Time")) if has_x else ""
    return replace(layout, headings=headings, step=step, began=began)


def _step(cells: Sequence[str]) -> float | None:
    """Return the time step that a header gives for each channel [s]; None where they differ, or there is none."""
    try:
        steps = {float(cell.replace(",", ".")) for cell in cells if cell.strip()}
    except ValueError:
        return None
    return steps.pop() if len(steps) == 1 else None


def with_signal_express_header(layout: "Layout", text: Text) -> "Layout":
    """Return the layout of an export of SignalExpress with the names and the time step above its rows.

    Parameters
    ----------
    layout : Layout
        Of the rows, which have no header of their own.
    text : Text
        Its lines; above the rows, a label stands above a cell for each channel.

    Raises
    ------
    LogError
        If channels begin at different times.
    """
    said = {label[0].strip().lower(): cells for label, cells in pairwise(text.above) if label}
    width, names = len(layout.headings), said.get("channel names:", [])
    step, begins = _step(said.get("dt:", ())), {one.strip() for one in said.get("start times:", ())} - {""}
    if len(begins) > 1 and all(map(is_stamp, begins)):
        times = read_stamps(sorted(begins), lambda *_: None)
        if step is None or float((times.max() - times.min()).astype(np.int64)) * 1e-9 > 0.5 * step:
            raise LogError(OWN_CLOCKS, text.source)
    headings = [Heading(name.strip() or f"column {place + 1}") for place, name in enumerate(names[:width])]
    return replace(layout, headings=(*headings, *layout.headings[len(headings) :]), step=step)


def with_twincat_clock(layout: "Layout", text: Text) -> "Layout | None":
    """Return the layout of an export of TwinCAT Scope with its fastest clock as the time of all channels.

    Each channel, or each group of one sample time, stands beside a clock that has no name, in milliseconds or, where
    full time stamps were asked for, in ticks since 1601. These get no unit here: they are known by their size. There
    is no such layout where the clock does not advance by the sample time that the file says.

    Parameters
    ----------
    layout : Layout
        As for any text.
    text : Text
        Its lines.

    Raises
    ------
    LogError
        If rows hold values of different times, other than values of a slow channel that are held until its next one.
    """
    width = len(layout.headings)
    said = {row[0].strip(): row for row in text.above if len(row) == width and row[0].strip()}
    names, whole = said.get("Name", ()), [row for row in text.rows if len(row) == width]
    clocks = [place for place, name in enumerate(names) if name.strip() == "Name"]
    if not clocks or width < 2 or len(whole) < 3:
        return None
    try:
        times = {place: [float(row[place].replace(",", ".") or "nan") for row in whole[:-1]] for place in clocks}
        step = {one: float(said[TWINCAT_STEP][one + 1].replace(",", ".")) for one in clocks if TWINCAT_STEP in said}
    except (ValueError, IndexError):
        return None
    if any(not one > 0.0 for one in step.values()):
        return None
    fastest = min(clocks, key=lambda place: step.get(place, 0.0))
    lasts, count = times[fastest][-1] - times[fastest][0], len(whole) - 2
    known = (one for one, unit in _CLOCKS if not step or abs(lasts * unit / step[fastest] - count) <= 0.5)
    clock = next(known, None)
    if clock is None:
        return None
    if not step and max(times[fastest]) > _LEAST_TICKS:
        clock = _CLOCKS[1][0]
    if not all(_is_held(times[one], times[fastest]) for one in clocks):
        raise LogError(OWN_CLOCKS, text.source)
    units = said.get("Unit", [""] * width)
    headings = [
        Heading(name.strip(), unit.strip() if is_unit(unit) else None) for name, unit in zip(names, units, strict=True)
    ]
    for place in clocks:
        beside = "".join(names[place + 1 : place + 2]).strip()
        headings[place] = clock if place == fastest else Heading(f"Time of {beside}")
    return replace(layout, headings=tuple(headings), scales=stated_scales(said))


def _is_held(slow: Sequence[float], fast: Sequence[float]) -> bool:
    """Return whether each row of a slow clock says its last time before that of a fast one."""
    steps = [after - before for before, after in pairwise(slow) if after > before]
    longest = max(steps, default=0.0)
    return all(here == there or here < there < here + longest for here, there in zip(slow, fast, strict=True))


def stated_scales(said: Mapping[str, Sequence[str]]) -> dict[int, tuple[float, float]]:
    """Return the scale factors and offsets that a header gives and that differ from 1 and 0, by the column's place.

    Parameters
    ----------
    said : Mapping[str, sequence of str]
        Cells of the lines above the rows, by the first cell.

    Returns
    -------
    dict[int, tuple[float, float]]
        Factor and offset.

    Examples
    --------
    >>> stated_scales({"Factor": ["Factor", "1", "0,5"], "Unit": ["Unit", "s", "bar"]})
    {2: (0.5, 0.0)}
    """
    factors, offsets = (
        next((row for key, row in said.items() if one.fullmatch(key.strip().rstrip(":"))), ()) for one in _SCALE_ROWS
    )
    found: dict[int, tuple[float, float]] = {}
    for place, texts in enumerate(zip_longest(factors, offsets, fillvalue="")):
        numbers = [one if _NUMBER.fullmatch(one.strip()) else neutral for one, neutral in zip(texts, "10", strict=True)]
        factor, offset = (float(one.strip().replace(",", ".")) for one in numbers)
        if (factor, offset) != (1.0, 0.0):
            found[place] = factor, offset
    return found


def _below_labview(lines: Sequence[str]) -> int | None:
    ends = [place for place, line in enumerate(lines) if line.startswith(HEADER_ENDS)]
    # a third one ends the header of another segment, whose rows do not belong to this segment
    return ends[:2][-1] + 1 if ends and lines[0].startswith(LABVIEW) else None


def _below_signal_express(lines: Sequence[str]) -> int | None:
    if not lines[0].lower().startswith("channel names:"):
        return None
    return next((place + 1 for place, line in enumerate(lines) if line.lower().startswith("data:")), None)


def _below_twincat(lines: Sequence[str]) -> int | None:
    first = next((place for place, line in enumerate(lines) if re.match(r"[-+\d]", line)), None)
    return first if any(line.startswith((TWINCAT_STEP, _TWINCAT_START)) for line in lines[:first]) else None


LOGGERS: Sequence[tuple[Callable[[Sequence[str]], int | None], Callable[["Layout", Text], "Layout | None"]]] = (
    (_below_labview, with_labview_header),
    (_below_signal_express, with_signal_express_header),
    (_below_twincat, with_twincat_clock),
)
"""Programs with such a header: how many lines it has, and what gives a layout what it says."""
