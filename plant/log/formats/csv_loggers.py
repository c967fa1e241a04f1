"""Headers that some programs write above the rows of a text log: units, the time step, a clock for each channel."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import zip_longest
from typing import TYPE_CHECKING

from plant.log.headings import Heading, is_unit, unit_or_none

if TYPE_CHECKING:
    from plant.log.formats.csv_layout import Layout

LABVIEW, HEADER_ENDS = "LabVIEW Measurement", "***End_of_Header***"

TWINCAT_STEP = "SampleTime[ms]"
"""How TwinCAT Scope says the sample time of each channel."""

_SCALE_ROWS = ("scalefactor", "offset")
"""How it says the scale of each channel, which its export applies or not, and does not say."""


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


def with_labview_header(layout: "Layout", above: Sequence[list[str]]) -> "Layout":
    """Return the layout of a LabVIEW measurement file with the units and the time step of its two headers.

    Parameters
    ----------
    layout : Layout
        Of the rows.
    above : sequence of list of str
        Cells of the lines of both headers.
    """
    said = {row[0]: row[1:] for row in above if row}
    has_x = (said.get("X_Columns") or [""])[0].strip() != "No"
    units = {**dict(enumerate(said.get("Y_Unit_Label", []), start=1)), 0: "s" if has_x else ""}
    headings = tuple(
        Heading(one.name, unit_or_none(units.get(place, "")), one.stamped) for place, one in enumerate(layout.headings)
    )
    try:
        step = float((said.get("Delta_X") or [""])[0].replace(",", ".")) if not has_x else None
    except ValueError:
        step = None
    return replace(layout, headings=headings, step=step)


def with_twincat_clock(layout: "Layout", above: Sequence[list[str]], rows: Sequence[Sequence[str]]) -> "Layout":
    """Return the layout of an export of TwinCAT Scope with the first clock as the time of all channels.

    Each channel, or each group of one sample time, stands beside a clock in milliseconds that has no name. The layout
    stays as it is where clocks differ, or where the first does not advance by the sample time that the file says.

    Parameters
    ----------
    layout : Layout
        As for any text.
    above : sequence of list of str
        Cells of the lines above the rows.
    rows : sequence of sequence of str
        Cells of rows.
    """
    width = len(layout.headings)
    said = {row[0].strip(): row for row in above if len(row) == width and row[0].strip()}
    names, steps = said.get("Name"), said.get(TWINCAT_STEP)
    whole = [row for row in rows if len(row) == width]
    clocks = [place for place, name in enumerate(names or ()) if name.strip() == "Name"]
    if names is None or steps is None or not clocks or width < 2 or len(whole) < 3:
        return layout
    try:
        times = [[float(row[place].replace(",", ".")) for row in whole[:-1]] for place in clocks]
        step = float(steps[1].replace(",", "."))
    except ValueError:
        return layout
    lasts = times[0][-1] - times[0][0]
    if any(one != times[0] for one in times) or abs(lasts - step * (len(times[0]) - 1)) > 0.5 * step:
        return layout
    units = said.get("Unit", [""] * width)
    headings = [
        Heading(name.strip(), unit.strip() if is_unit(unit) else None) for name, unit in zip(names, units, strict=True)
    ]
    for place in clocks:
        beside = "".join(names[place + 1 : place + 2]).strip()
        headings[place] = Heading("Time", "ms") if place == clocks[0] else Heading(f"Time of {beside}")
    return replace(layout, headings=tuple(headings), scales=_stated_scales(said))


def _stated_scales(said: Mapping[str, Sequence[str]]) -> dict[int, tuple[float, float]]:
    """Return the scale factors and offsets that differ from 1 and 0, by the place of their column."""
    factors, offsets = (next((row for key, row in said.items() if key.lower() == name), ()) for name in _SCALE_ROWS)
    found: dict[int, tuple[float, float]] = {}
    for place, texts in enumerate(zip_longest(factors, offsets, fillvalue="")):
        try:
            factor, offset = (float(one.replace(",", ".") or neutral) for one, neutral in zip(texts, "10", strict=True))
        except ValueError:
            continue
        if (factor, offset) != (1.0, 0.0):
            found[place] = factor, offset
    return found
