"""Figures of a batch study, from its tables."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from experiments.figures.classification import draw_confusion
from experiments.figures.style import BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILION, Margins, panels, spread_out
from experiments.figures.tables import TableFigure
from experiments.report.words import in_words

COLOURS = (BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY)

ROW_INCHES = 0.34
"""Height of a condition's row in a figure [inch]."""

FARTHEST_PERCENT = 30.0
"""Errors beyond this stand at the edge [%]: a method that fails should not hide those that do not."""


def way_in_words(row: Mapping[Any, Any]) -> str:
    """Return what a way of doing it is called.

    Parameters
    ----------
    row : Mapping[str, Any]
        Its plant, drive, sensors, verb, form, method and pressure.

    Returns
    -------
    str
        In words.

    Examples
    --------
    >>> way_in_words({"plant": "lumped", "drive": "sine", "verb": "filter", "form": "pressure", "method": "ekf",
    ...               "pressure": True})
    'lumped, sine: pressure form, ekf'
    """
    place = ", ".join(str(row[name]) for name in ("plant", "drive") if row[name])
    if row["verb"] == "diagnose":
        how = "diagnose"
    else:
        how = ("" if row["form"] == "auto" else f"{row['form']} form, ") + str(row["method"]).replace(
            "auto", "estimate"
        )
    return f"{place}: {how}" + ("" if row["pressure"] else ", pressure not used")


def draw_errors(table: pd.DataFrame) -> Figure:
    """Draw the error of bulk modulus of every way of doing it in every condition.

    Parameters
    ----------
    table : pandas.DataFrame
        The table ``bulk modulus``.

    Returns
    -------
    Figure
        The median and the range from the 5th to the 95th percentile [%], a row a condition.
    """
    shown = table[table["median_percent"].notna()]
    conditions = list(dict.fromkeys(shown["condition"]))
    ways = [way_in_words(row) for row in shown.to_dict("records")]
    names = list(dict.fromkeys(ways))
    height = 1.3 + max(ROW_INCHES, 0.13 * len(names)) * len(conditions) + 0.2 * len(names)
    margins = Margins(left=2.3, top=0.45, bottom=0.7 + 0.2 * len(names))
    figure, (axis,) = panels(
        "Error of bulk modulus by condition: median, and 5 to 95 % of cases", 1, 1, height, margins
    )
    heights = {name: float(len(conditions) - 1 - place) for place, name in enumerate(conditions)}
    axis.set_yticks(list(heights.values()), [in_words(name) for name in conditions])
    axis.set_ylim(-0.6, len(conditions) - 0.4)
    offsets = spread_out(len(names), 0.6)
    edge = min(FARTHEST_PERCENT, 1.1 * max(0.1, float(shown[["low_percent", "high_percent"]].abs().max().max())))
    axis.axvline(0.0, color=GREY, linewidth=0.8)
    for place, (name, offset) in enumerate(zip(names, offsets, strict=True)):
        mine = shown[np.array(ways) == name]
        level = np.array([heights[condition] for condition in mine["condition"]]) + offset
        low, middle, high = (
            np.clip(mine[column].to_numpy(dtype=float), -edge, edge)
            for column in ("low_percent", "median_percent", "high_percent")
        )
        colour = COLOURS[place % len(COLOURS)]
        axis.hlines(level, low, high, color=colour)
        axis.plot(middle, level, "o", markersize=4, color=colour, label=name)
    axis.set_xlim(-1.05 * edge, 1.05 * edge)
    beyond = ", errors beyond stand at the edge" if edge == FARTHEST_PERCENT else ""
    axis.set_xlabel(f"error of bulk modulus [%]{beyond}")
    axis.legend(loc="upper left", bbox_to_anchor=(0.0, -0.45 / (height - margins.top - margins.bottom)), fontsize=8.5)
    return figure


def draw_classes(table: pd.DataFrame) -> Figure:
    """Draw how many logs belong to which class.

    Parameters
    ----------
    table : pandas.DataFrame
        The table ``classes``.

    Returns
    -------
    Figure
        A bar a class [count].
    """
    margins = Margins(left=2.3, top=0.45)
    figure, (axis,) = panels("Logs by the class that was found", 1, 1, 1.0 + ROW_INCHES * len(table), margins)
    level = np.arange(len(table))[::-1]
    axis.barh(level, table["logs"], color=BLUE, height=0.6)
    axis.set_yticks(level, [in_words(name) for name in table["class"]])
    axis.grid(visible=False, axis="y")
    axis.xaxis.set_major_locator(MaxNLocator(integer=True))
    axis.set_xlabel("logs")
    for place, count in zip(level, table["logs"], strict=True):
        axis.annotate(str(count), (count, place), (4, 0), textcoords="offset points", va="center", fontsize=8.5)
    return figure


def _confusion(tables: Mapping[str, pd.DataFrame]) -> Figure:
    diagnosis = tables["diagnosis"]
    return draw_confusion(tables["confusion"], float(diagnosis["right"].sum() / diagnosis["cases"].sum()))


BATCH_FIGURES: Mapping[str, TableFigure] = MappingProxyType(
    {
        "bulk modulus": TableFigure(
            "Bulk modulus",
            "A dot is the median of all seeds and first guesses, its line the range from the 5th to the 95th "
            "percentile. A long line away from zero is a method that its first guess misleads.",
            lambda tables: draw_errors(tables["bulk modulus"]),
        ),
        "confusion": TableFigure(
            "Class against truth",
            "Counts on the diagonal are right. All plants and ways of diagnosing are counted together; the table has "
            "each by itself.",
            _confusion,
        ),
        "classes": TableFigure(
            "Classes found in the logs",
            "A log that failed, or could be put in no class, counts as none.",
            lambda tables: draw_classes(tables["classes"]),
        ),
    }
)
"""The figures, by the name of the table that they need."""
