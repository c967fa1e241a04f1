"""Clocks that a file repeats beside each channel: LabVIEW, Simulink and spreadsheets write time and value in pairs."""

import re
from dataclasses import replace

import numpy as np

from plant.log.columns import TIME, TIME_NAMES
from plant.log.headings import Heading
from plant.log.table import Table
from plant.units import converts


def without_repeated_clocks(table: Table) -> Table:
    """Return a table in which only the first of several equal clocks is called one; others are named by their channel.

    Parameters
    ----------
    table : Table
        As a reader of its format gives it.

    Examples
    --------
    >>> from plant.log.table import table_of
    >>> pairs = {"time": np.arange(9.0), "speed": np.ones(9), "time ": np.arange(9.0), "way": np.ones(9)}
    >>> [one.name for one in without_repeated_clocks(table_of("log", pairs)).headings]
    ['time', 'speed', 'time of way', 'way']
    """
    told = [place for place, one in enumerate(table.headings) if _is_clock(one)]
    timed = told or [place for place, one in enumerate(table.headings) if one.unit and converts(one.unit, "s")]
    named = [(place, _name_without_number(table.headings[place])) for place in timed]
    clocks = [place for place, name in named if name == named[0][1]]  # a clock of another name may be asked for
    if len(clocks) < 2:
        return table
    found = table.read_quietly(clocks)
    first = found.get(clocks[0])
    headings = list(table.headings)
    for place in clocks[1:]:
        if first is not None and place in found and np.array_equal(first, found[place]):
            beside = "".join(one.bare for one in table.headings[place + 1 : place + 2])
            headings[place] = Heading(f"time of {beside or place + 1}")
    return replace(table, headings=tuple(headings))


def _is_clock(heading: Heading) -> bool:
    return heading.stamped or heading.name == TIME or heading.stem in TIME_NAMES


def _name_without_number(heading: Heading) -> str:
    return re.sub(r"[\d_]+$", "", heading.stem)
