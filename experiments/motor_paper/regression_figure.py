"""Figures 10 to 16 of the diaphragm-motor paper: residuals, line fits and normal probability of its regression.

They read the tables of `hydrostate motor-paper`, and compute nothing.
"""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.page.figure_files import Drawings
from experiments.page.frames import Tables
from experiments.page.style import BLACK, BLUE, GREY, ORANGE, VERMILION, Margins, panels

READING_WORDS = {"as_printed": "as printed", "anova": "as in Figure 12", "physical": "physical"}

_MARKS = {"as_printed": (GREY, "x"), "anova": (BLUE, "o"), "physical": (VERMILION, "s")}


def _marked(axis: Axes, rows: pd.DataFrame, across: str) -> None:
    for name, part in rows.groupby("reading", sort=False):
        colour, mark = _MARKS[str(name)]
        axis.plot(part[across], part["residual"], mark, color=colour, markersize=5, label=READING_WORDS[str(name)])


def _draw_residuals(tables: Tables) -> Figure:
    """Draw residuals over deformation, velocity and predicted flow, as Figures 10, 15 and 16 do."""
    rows = tables["regression residuals"]
    title = "Residuals of the regression: six rows, three readings"
    figure, axes = panels(title, 1, 3, 3.6, Margins(left=0.75, top=0.75, across=0.4), sharey=True)
    words = ("deformation [as printed: mm]", "velocity [as printed: mm/s]", "predicted flow [mL/s]")
    heads = ("Figure 15", "Figure 10", "Figure 16")
    for axis, column, label, head in zip(axes, ("deformation", "velocity", "predicted"), words, heads, strict=True):
        _marked(axis, rows, column)
        axis.axhline(0.0, color=BLACK, linewidth=0.8)
        axis.set(xlabel=label, title=head)
    axes[0].set(ylabel="residual [mL/s]")
    axes[-1].legend(loc="lower right")
    return figure


def _draw_line_fits(tables: Tables) -> Figure:
    """Draw flow and its prediction over deformation and velocity, and normal probability: Figures 11, 13, 14.

    Four panels, for the reading that Figure 12 uses.
    """
    rows = tables["regression residuals"]
    rows = rows[rows["reading"] == "anova"]
    title = "Line fits and normal probability, as Figure 12 reads Table 2"
    figure, axes = panels(title, 2, 2, 5.8, Margins(left=0.65, top=0.75, across=0.65, down=0.75))
    left, middle, flows, right = axes
    for axis, column, label, head in (
        (left, "deformation", "deformation [as printed: mm]", "Figure 11"),
        (middle, "velocity", "velocity [as printed: mm/s]", "Figure 13"),
    ):
        axis.plot(rows[column], rows["flow"], "o", color=BLUE, label="Table 2")
        axis.plot(rows[column], rows["predicted"], "D", color=ORANGE, markersize=4, label="fitted")
        axis.set(xlabel=label, title=head)
    left.set(ylabel="flow [mL/s]")
    left.legend(loc="upper left")
    ordered = rows.sort_values("standardised_residual")["standardised_residual"].to_numpy()
    right.plot(rows["normal_score"], ordered, "o", color=BLUE)
    right.plot([-1.5, 1.5], [-1.5, 1.5], color=GREY, linewidth=0.9)
    right.set(xlabel="normal quantile", ylabel="standardised residual")
    right.set(title="what normality is asked of: the residuals")
    flows.plot(rows["percentile"], rows["sorted_flow"], "o", color=BLUE)
    flows.set(xlabel="percentile [%]", ylabel="flow, sorted [mL/s]", title="Figure 14")
    return figure


def _draw_circle(tables: Tables) -> Figure:
    """Draw why the regression is circular: flow over unloaded velocity, and over the variables that the text claims.

    One bar for each pair, by R².
    """
    table = tables["circularity"].iloc[::-1]
    title = "R² of a straight line through pairs of Table 2's columns, physical reading"
    figure, (axis,) = panels(title, 1, 1, 2.6, Margins(left=2.6, right=3.2, top=0.45))
    colours = {"the same number twice, by equation 18": ORANGE, "what the text claims": VERMILION}
    places = np.arange(len(table))
    axis.barh(places, table["r_square"], 0.6, color=[colours.get(words, GREY) for words in table["meaning"].tolist()])
    for place, value, words in zip(places, table["r_square"].tolist(), table["meaning"].tolist(), strict=True):
        axis.annotate(f"{value:.3f}  {words}", (1.02, float(place)), va="center", annotation_clip=False)
    axis.set_yticks(places, table["pair"].tolist())
    axis.grid(visible=False, axis="y")
    axis.set(xlim=(0.0, 1.0), xlabel="R²")
    return figure


REGRESSION_FIGURES: Drawings = {"residuals": _draw_residuals, "line_fits": _draw_line_fits, "circle": _draw_circle}
