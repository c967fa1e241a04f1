"""Estimates of bulk modulus on the circuit plant, in place of the paper's Figure 11."""

from collections.abc import Mapping

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.nine_conditions.convergence import MEGA
from experiments.nine_conditions.estimates import draw_intervals
from experiments.page.style import (
    BESIDE_CONDITIONS,
    BLACK,
    BLUE,
    GREY,
    ORANGE,
    VERMILION,
    Margins,
    condition_rows,
    panels,
)
from experiments.page.words import condition_in_words

FORM_COLOURS = {"flow": BLUE, "pressure": ORANGE, "acceleration": VERMILION}


def draw_bulk_modulus(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Draw estimates of bulk modulus on the circuit, in place of Figure 11.

    Returns
    -------
    Figure
        One panel for each form, one row for each condition, one dot for each first guess.
    """
    estimates = tables["figure 11 bulk modulus"]
    title = "Estimates of bulk modulus on the circuit plant"
    forms = list(dict.fromkeys(estimates["form"]))
    figure, axes = panels(title, 1, len(forms), 4.0, _BESIDE_TITLED, sharey=True)
    for axis, form in zip(axes, forms, strict=True):
        heights = condition_rows(axis, list(dict.fromkeys(estimates["condition"])))
        rows = estimates[estimates["form"] == form]
        first = rows.iloc[0]
        pressure = "with pressure" if first["pressure_logged"] else "no pressure"
        axis.set(title=f"{form} form, {first['drive']}, {pressure}", xlabel="effective bulk modulus [MPa]")
        _estimates_of(axis, rows, heights, FORM_COLOURS[form])
        truth = float(first["truth_pa"]) / MEGA
        axis.axvline(truth, color=BLACK, linewidth=1.0, linestyle=(0, (4, 3)), zorder=0)
        ends = rows[["value_pa", "ci95_low_pa", "ci95_high_pa", "truth_pa"]] / MEGA
        low, high = max(0.0, float(ends.min().min())), min(2.0 * truth, float(ends.max().max()))
        if high > low:  # else there is nothing but the line of the true value
            axis.set(xlim=(low - 0.05 * (high - low), high + 0.05 * (high - low)))
        axis.locator_params(axis="x", nbins=5)
    return figure


_BESIDE_TITLED = Margins(left=BESIDE_CONDITIONS.left, top=0.7)


def _estimates_of(axis: Axes, rows: pd.DataFrame, heights: Mapping[str, float], colour: str) -> None:
    for condition, found in rows.groupby("condition", sort=False):
        height = heights[str(condition)]
        values = found.dropna(subset=["value_pa"])
        if values.empty:
            words, place = condition_in_words(str(found["outcome"].iloc[0])), ("axes fraction", "data")
            told = axis.annotate(words, (0.5, height), xycoords=place, ha="center", va="center", color=GREY, fontsize=8)
            told.set_bbox(
                {"facecolor": "white", "edgecolor": "none", "pad": 1.5}
            )  # so that the line of the true value does not cross the words
        draw_intervals(axis, values, height, 3.0, lambda _: colour)
