"""The nine-condition library: its models beside Table 6, four structures compared, and the clock of the test."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from experiments.page.drawing import with_colours
from experiments.page.figure_files import Drawings
from experiments.page.frames import Tables
from experiments.page.style import (
    BESIDE_CONDITIONS,
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    Margins,
    condition_levels,
    panels,
    spread_offsets,
)
from experiments.page.words import condition_in_words

MILLI = 1e3

STRUCTURE_MARKS = {
    "output-error": (BLUE, "o"),
    "ARX": (ORANGE, "s"),
    "ARMAX": (GREEN, "^"),
    "Box-Jenkins": (PURPLE, "D"),
}

COMPARED_COLUMNS = {
    "fit_percent": ("running free", "fit [%]"),
    "one_step_percent": ("one step ahead", "fit [%]"),
    "weight_above_percent": ("criterion's weight above 25 Hz", "share [%]"),
}
"""Panels of the comparison: column, title and axis."""

CLOCK_MARKS = "os^Dvp<P*X"
"""A marker for each test, because colour alone does not distinguish them."""


def _draw_structures(tables: Tables) -> Figure:
    """Draw the accuracy of the four structures in each condition, and the frequencies that each one's criterion weighs.

    Three panels, with one row for each condition and one mark for each structure.
    """
    found = tables["structures"]
    margins = Margins(left=BESIDE_CONDITIONS.left, top=0.65)
    figure, axes = panels("Four structures on passes held back", 1, 3, 4.8, margins, sharey=True)
    for axis, (column, (title, label)) in zip(axes, COMPARED_COLUMNS.items(), strict=True):
        level = condition_levels(axis, found["condition"])
        for offset, (name, (colour, mark)) in zip(spread_offsets(4, 0.5), STRUCTURE_MARKS.items(), strict=True):
            mine = found["structure"] == name
            axis.plot(found[column][mine], level[mine] + offset, mark, color=colour, markersize=4.5, label=name)
        axis.set(xlim=(0.0, 100.0), title=title, xlabel=label)
    figure.legend(*axes[0].get_legend_handles_labels(), loc="upper right", ncols=4, frameon=False)
    return figure


def _draw_library(tables: Tables) -> Figure:
    """Draw the gain of the library's models with 95 % bands over that of Table 6."""
    responses = tables["responses"]
    margins = Margins(left=0.75, top=0.65, down=0.35, across=0.25)
    figure, axes = panels("Gain from motor speed to velocity", 3, 3, 6.4, margins, sharex=True, sharey=True)
    for axis, (condition, rows) in zip(axes, responses.groupby("condition", sort=False), strict=True):
        axis.plot(rows["frequency_hz"], MILLI * rows["published_gain"], color=ORANGE, label="Table 6, at 1 ms")
        low, high = MILLI * rows["gain_low"], MILLI * rows["gain_high"]
        axis.fill_between(rows["frequency_hz"], low, high, color=BLUE, alpha=0.3, lw=0)
        axis.plot(rows["frequency_hz"], MILLI * rows["gain"], color=BLUE, label="library, with 95 % band")
        axis.set(title=condition_in_words(str(condition)))
    axes[0].set(xscale="log", yscale="log", ylim=(3e-3, 1.0))
    axes[3].set(ylabel="gain [mm/s per rad/s]")
    axes[7].set(xlabel="frequency [Hz]")
    axes[0].legend(loc="lower left")
    return figure


def _draw_orders(tables: Tables) -> Figure:
    """Draw singular values over the noise floor, and how much each order improves the fit.

    Two panels, with one row for each condition.
    """
    orders = tables["orders"]
    margins = Margins(left=BESIDE_CONDITIONS.left, top=0.65, bottom=0.8)
    figure, (values, fits) = panels("What the data say of the order", 1, 2, 4.5, margins, sharey=True)
    level = condition_levels(values, orders["condition"])
    condition_levels(fits, orders["condition"])
    for k, (colour, mark) in enumerate(list(STRUCTURE_MARKS.values())[:3], 1):
        values.plot(orders[f"value_{k}_over_floor"], level, mark, color=colour, markersize=5, label=f"value {k}")
    for order, (colour, mark) in enumerate(STRUCTURE_MARKS.values(), 1):
        gained = orders[f"fit_{order}_percent"] - orders["fit_1_percent"]
        if order > 1:
            fits.plot(gained, level, mark, color=colour, markersize=5, label=f"order {order}")
    values.axvline(1.0, color=GREY, linewidth=1.0, linestyle=(0, (4, 3)), zorder=0)
    values.set(title="projected singular values: dashed, the floor of noise", xscale="log")
    values.set(xlabel="value over its noise floor [ratio]")
    fits.axvline(0.0, color=GREY, linewidth=1.0, linestyle=(0, (4, 3)), zorder=0)
    fits.set(title="output error of higher order than first", xlabel="fit gained over first order [percentage points]")
    for axis in (values, fits):
        axis.legend(loc="upper right", bbox_to_anchor=(1.0, -0.16), ncols=3, handletextpad=0.1)
    return figure


def _draw_clocks(tables: Tables) -> Figure:
    """Draw the uncertainty of the gain against frequency, for each test's clock."""
    tests = tables["clocks"]
    switched = tests[tests["input"].str.endswith(" ms")]
    switched = switched.iloc[np.argsort([float(name.split()[0]) for name in switched["input"]])]
    clocks = pd.concat([switched, tests.drop(switched.index)])
    columns = [name for name in clocks.columns if name.startswith("at_")]
    frequencies = [float(name.split("_")[1]) for name in columns]
    figure, (axis,) = panels("Predicted deviation of the gain after one test", 1, 1, 3.6, Margins(left=0.9, right=2.2))
    shades = [colour for _, _, colour in with_colours(enumerate(switched["input"]))]
    looks = [*((colour, "-") for colour in shades), *((BLACK, ":") for _ in range(len(clocks) - len(shades)))]
    for row, (colour, line), mark in zip(clocks.to_dict("records"), looks, CLOCK_MARKS, strict=False):
        gain = [100.0 * row[name] for name in columns]
        axis.plot(frequencies, gain, mark + line, color=colour, label=row["input"], markersize=5)
    axis.set(yscale="log")
    axis.set_yticks([0.02, 0.05, 0.1, 0.2], ["0.02", "0.05", "0.1", "0.2"])
    axis.yaxis.set_minor_formatter(NullFormatter())
    axis.set(xlabel="frequency [Hz]", ylabel="standard deviation [% of gain]")
    axis.legend(loc="center left", bbox_to_anchor=(1.02, 0.5))
    return figure


LIBRARY_FIGURES: Drawings = {
    "library": _draw_library,
    "structures": _draw_structures,
    "orders": _draw_orders,
    "clocks": _draw_clocks,
}
