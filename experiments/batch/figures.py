"""Figures of a batch study, from its tables."""

from collections.abc import Mapping
from itertools import cycle
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from experiments.nine_conditions.classification import draw_confusion
from experiments.page.drawing import label_point, named_rows
from experiments.page.figure_files import Drawings
from experiments.page.frames import Tables
from experiments.page.style import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    Margins,
    condition_levels,
    panels,
    spread_offsets,
)
from experiments.page.words import condition_in_words

COLOURS = (BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY)

MARKS = "os^DvPX"
"""A marker for each method, because colour alone does not distinguish them; with the colours, 42 differ."""

ROW_INCHES = 0.34
"""Height of a condition's row in a figure [inch]."""

FARTHEST_PERCENT = 30.0
"""Errors beyond this are drawn at the edge [%], so that a method that fails does not hide the others."""


def method_in_words(row: Mapping[Any, Any]) -> str:
    """Return the name of a method with plant and drive.

    Parameters
    ----------
    row : Mapping[str, Any]
        The method's plant, drive, sensors, verb, form, method and pressure.

    Examples
    --------
    >>> method_in_words({"plant": "lumped", "drive": "sine", "verb": "filter", "form": "pressure", "method": "ekf",
    ...               "pressure": True})
    'lumped, sine: pressure form, ekf'
    """
    place = ", ".join(str(row[name]) for name in ("plant", "drive") if row[name])
    form = "" if row["form"] == "auto" else f"{row['form']} form, "
    how = "diagnose" if row["verb"] == "diagnose" else form + str(row["method"]).replace("auto", "estimate")
    return f"{place}: {how}" + ("" if row["pressure"] else ", pressure not used")


def _draw_errors(table: pd.DataFrame) -> Figure:
    """Draw the error of bulk modulus of every method in every condition.

    Each condition has one row, with the median and the range from the 5th to the 95th percentile [%].
    """
    shown = table[table["median_percent"].notna()]
    count = shown["condition"].nunique()
    ways = [method_in_words(row) for row in shown.to_dict("records")]
    names = list(dict.fromkeys(ways))
    height = 1.3 + max(ROW_INCHES, 0.13 * len(names)) * count + 0.2 * len(names)
    margins = Margins(left=2.3, top=0.45, bottom=0.7 + 0.2 * len(names))
    title = "Error of bulk modulus by condition: median, and 5 to 95 % of cases"
    figure, (axis,) = panels(title, 1, 1, height, margins)
    levels = condition_levels(axis, shown["condition"])
    offsets = spread_offsets(len(names), 0.6)
    edge = min(FARTHEST_PERCENT, 1.1 * max(0.1, float(shown[["low_percent", "high_percent"]].abs().max().max())))
    axis.axvline(0.0, color=GREY, linewidth=0.8)
    spread = shown[["low_percent", "median_percent", "high_percent"]].astype(float).clip(-edge, edge).to_numpy()
    for name, offset, colour, mark in zip(names, offsets, cycle(COLOURS), cycle(MARKS), strict=False):
        mine = np.array(ways) == name
        low, middle, high = spread[mine].T
        axis.hlines(levels[mine] + offset, low, high, color=colour)
        axis.plot(middle, levels[mine] + offset, mark, markersize=4, color=colour, label=name)
    beyond = ", errors beyond stand at the edge" if edge == FARTHEST_PERCENT else ""
    axis.set(xlim=(-1.05 * edge, 1.05 * edge), xlabel=f"error of bulk modulus [%]{beyond}")
    axis.legend(loc="upper left", bbox_to_anchor=(0.0, -0.45 / (height - margins.top - margins.bottom)), fontsize=8.5)
    return figure


def draw_classes(table: pd.DataFrame) -> Figure:
    """Draw the number of logs in each class."""
    margins = Margins(left=2.3, top=0.45)
    figure, (axis,) = panels("Logs by the class that was found", 1, 1, 1.0 + ROW_INCHES * len(table), margins)
    shown = table.iloc[::-1]
    level = named_rows(axis, [condition_in_words(name) for name in shown["class"]])
    axis.barh(level, shown["logs"], color=BLUE, height=0.6)
    axis.xaxis.set_major_locator(MaxNLocator(integer=True))
    axis.set(xlabel="logs")
    for place, count in zip(level, shown["logs"], strict=True):
        label_point(axis, str(count), (count, place), (4, 0), va="center", fontsize=8.5)
    return figure


def _confusion(tables: Tables) -> Figure:
    diagnosis = tables["diagnosis"]
    return draw_confusion(tables["confusion"], float(diagnosis["right"].sum() / diagnosis["cases"].sum()))


BATCH_FIGURES: Drawings = {
    "bulk_modulus": lambda tables: _draw_errors(tables["bulk modulus"]),
    "confusion": _confusion,
    "classes": lambda tables: draw_classes(tables["classes"]),
}
