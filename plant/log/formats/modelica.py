"""Results of simulations in Modelica (Dymola, OpenModelica), which are MAT files of version 4.

The layout is that of the "Dymola User Manual", volume 1, on result files: `name` and `description` say what the
variables are, `dataInfo` in which table and column each stands and with which sign; `data_2` holds those that change.
"""

import re
from collections.abc import Mapping
from itertools import zip_longest
from typing import Any

import numpy as np

from plant.arrays import Array
from plant.log.formats.mat_reader import MatValue

TRAJECTORY = "Atrajectory"
"""First row of the variable `Aclass` of a result."""

TIME, CONSTANTS, COURSES = 0, 1, 2
"""Tables that `dataInfo` refers to; the time stands in the first column of the courses."""

_UNIT = re.compile(r"\[([^\[\]|]+)(?:\|[^\[\]]*)?\]\s*(?::#\(.*\))?$")
"""A unit at the end of a description, before the one that a plot shows: ``Angle of the shaft [rad|deg]``."""


def modelica_columns(content: Mapping[str, MatValue]) -> tuple[dict[str, Array], dict[str, str | None]]:
    """Return the variables of a simulation that change over time, and their units; empty if it is no such result.

    Parameters
    ----------
    content : Mapping[str, ndarray of any shape, str or Sequence of str]
        Variables of a MAT file of version 4.

    Returns
    -------
    dict[str, ndarray, shape (n,)]
        Values by the name that the model has for them; one of the opposite sign of another is turned round.
    dict[str, str or None]
        Unit by name; None where the description has none.
    """
    kind = content.get("Aclass")
    if not isinstance(kind, list) or len(kind) < 4 or kind[0] != TRAJECTORY:
        return {}, {}
    turned = kind[3] == "binTrans"
    names, said = (_texts(content.get(one), turned=turned) for one in ("name", "description"))
    info, courses = (_matrix(content.get(one), turned=turned) for one in ("dataInfo", "data_2"))
    if info.shape[0] != len(names) or info.shape[1] < 2:
        return {}, {}
    columns: dict[str, Array] = {}
    units: dict[str, str | None] = {}
    for (table, place), (name, text) in zip(
        info[:, :2].astype(int), zip_longest(names, said, fillvalue=""), strict=False
    ):
        column = 0 if table == TIME else abs(int(place)) - 1
        if table == CONSTANTS or not 0 <= column < courses.shape[1] or not name:
            continue
        columns[name] = -courses[:, column] if place < 0 else courses[:, column]
        unit = _UNIT.search(text)
        units[name] = unit[1].strip() if unit else "s" if table == TIME else None
    return columns, units


def _texts(value: Any, *, turned: bool) -> list[str]:
    """Return texts, each of which is a column of the matrix of characters if it is turned."""
    rows: list[str] = [value] if isinstance(value, str) else value if isinstance(value, list) else []
    return ["".join(column).rstrip() for column in zip_longest(*rows, fillvalue=" ")] if turned else rows


def _matrix(value: Any, *, turned: bool) -> Array:
    """Return a table whose rows are variables or times."""
    table = np.asarray(value if isinstance(value, np.ndarray) and value.dtype.kind in "fiu" else [], dtype=np.float64)
    if table.ndim != 2:
        return np.zeros((0, 0))
    return table.T if turned else table
