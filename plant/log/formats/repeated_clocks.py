"""Clocks that a file repeats beside each channel: LabVIEW, Simulink and spreadsheets write time and value in pairs."""

import re
import warnings
from dataclasses import replace

import numpy as np

from plant.errors import LogError
from plant.log.columns import TIME, TIME_NAMES, TRUTH_PREFIX, Column
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
    columns = [Column(place, table.headings[place].name, f"{TRUTH_PREFIX}{place}") for place in clocks]
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # they are given when the channels are read
            found = table.read(columns)
    except LogError:
        return table
    first = found.get(columns[0])
    headings = list(table.headings)
    for column in columns[1:]:
        if first is not None and column in found and np.array_equal(first, found[column]):
            beside = "".join(one.bare for one in table.headings[column.position + 1 : column.position + 2])
            headings[column.position] = Heading(f"time of {beside or column.position + 1}")
    return replace(table, headings=tuple(headings))


def _is_clock(heading: Heading) -> bool:
    return heading.stamped or heading.name == TIME or heading.stem in TIME_NAMES


def _name_without_number(heading: Heading) -> str:
    return re.sub(r"[\d_]+$", "", heading.stem)
