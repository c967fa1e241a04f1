"""The nine-condition library: its models beside Table 6, four structures compared, and the clock of the test."""

from collections.abc import Mapping
from types import MappingProxyType

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from experiments.figures.style import (
    BESIDE_CONDITIONS,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    Margins,
    condition_rows,
    panels,
    spread_out,
)
from experiments.figures.tables import TableFigure, Tables
from experiments.report.words import in_words

MILLI = 1e3
"""Millimetres a metre."""

STRUCTURE_MARKS = MappingProxyType(
    {"output-error": (BLUE, "o"), "ARX": (ORANGE, "s"), "ARMAX": (GREEN, "^"), "Box-Jenkins": (PURPLE, "D")}
)
"""Colour and mark of each structure."""

COMPARED = MappingProxyType(
    {
        "fit_percent": ("running free", "fit [%]"),
        "one_step_percent": ("one step ahead", "fit [%]"),
        "weight_above_percent": ("criterion's weight above 25 Hz", "share [%]"),
    }
)
"""Panels of the comparison: column, title and axis."""


def draw_structures(tables: Tables) -> Figure:
    """Draw how the four structures do in each condition, and where each one's criterion looks.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        The library's tables.

    Returns
    -------
    Figure
        Three panels, one row a condition, one mark a structure.
    """
    found = tables["structures"]
    margins = Margins(left=BESIDE_CONDITIONS.left, top=0.65)
    figure, axes = panels("Four structures on passes held back", 1, 3, 4.8, margins, sharey=True)
    for axis, (column, (title, label)) in zip(axes, COMPARED.items(), strict=True):
        heights = condition_rows(axis, list(dict.fromkeys(found["condition"])))
        for offset, (name, (colour, mark)) in zip(spread_out(4, 0.5), STRUCTURE_MARKS.items(), strict=True):
            rows = found[found["structure"] == name]
            level = [heights[condition] + offset for condition in rows["condition"]]
            axis.plot(rows[column], level, mark, color=colour, markersize=4.5, label=name)
        axis.set_xlim(0.0, 100.0)
        axis.set_title(title, loc="left")
        axis.set_xlabel(label)
    figure.legend(*axes[0].get_legend_handles_labels(), loc="upper right", ncols=4, frameon=False)
    return figure


def draw_library(tables: Tables) -> Figure:
    """Draw the gain of the library's models with 95 % bands over that of Table 6.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        The library's tables.

    Returns
    -------
    Figure
        One panel a condition.
    """
    responses = tables["responses"]
    figure, axes = panels(
        "Gain from motor speed to velocity",
        3,
        3,
        6.4,
        Margins(left=0.75, top=0.65, down=0.35, across=0.25),
        sharex=True,
        sharey=True,
    )
    for axis, (condition, rows) in zip(axes, responses.groupby("condition", sort=False), strict=True):
        axis.plot(rows["frequency_hz"], MILLI * rows["published_gain"], color=ORANGE, label="Table 6, at 1 ms")
        axis.fill_between(
            rows["frequency_hz"], MILLI * rows["gain_low"], MILLI * rows["gain_high"], color=BLUE, alpha=0.3, lw=0
        )
        axis.plot(rows["frequency_hz"], MILLI * rows["gain"], color=BLUE, label="library, with 95 % band")
        axis.set_title(in_words(str(condition)), loc="left")
    axes[0].set_xscale("log")
    axes[0].set_yscale("log")
    axes[0].set_ylim(3e-3, 1.0)
    axes[0].legend(loc="lower left")
    axes[3].set_ylabel("gain [mm/s per rad/s]")
    axes[7].set_xlabel("frequency [Hz]")
    return figure


def draw_orders(tables: Tables) -> Figure:
    """Draw singular values over the noise floor, and what each order adds to the fit.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        The library's tables.

    Returns
    -------
    Figure
        Two panels, one row a condition.
    """
    orders = tables["orders"]
    margins = Margins(left=BESIDE_CONDITIONS.left, top=0.65)
    figure, (values, fits) = panels("What the data say of the order", 1, 2, 4.2, margins, sharey=True)
    heights = condition_rows(values, list(orders["condition"]))
    condition_rows(fits, list(orders["condition"]))
    level = np.array([heights[name] for name in orders["condition"]])
    for k, (colour, mark) in enumerate(list(STRUCTURE_MARKS.values())[:3], 1):
        values.plot(orders[f"value_{k}_over_floor"], level, mark, color=colour, markersize=5, label=f"value {k}")
    for order, (colour, mark) in enumerate(STRUCTURE_MARKS.values(), 1):
        gained = orders[f"fit_{order}_percent"] - orders["fit_1_percent"]
        if order > 1:
            fits.plot(gained, level, mark, color=colour, markersize=5, label=f"order {order}")
    values.axvline(1.0, color=GREY, linewidth=1.0, linestyle=(0, (4, 3)), zorder=0)
    values.set_xscale("log")
    values.set_title("projected singular values: dashed, the floor of noise", loc="left")
    values.set_xlabel("value over its noise floor [ratio]")
    fits.axvline(0.0, color=GREY, linewidth=1.0, linestyle=(0, (4, 3)), zorder=0)
    fits.set_title("output error of higher order than first", loc="left")
    fits.set_xlabel("fit gained over first order [percentage points]")
    for axis in (values, fits):
        axis.legend(loc="best")
    return figure


def draw_clocks(tables: Tables) -> Figure:
    """Draw how certain each test's clock makes the gain, by frequency.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        The library's tables.

    Returns
    -------
    Figure
        One line a test.
    """
    clocks = tables["clocks"].sort_values("at_25_hz")
    columns = [name for name in clocks.columns if name.startswith("at_")]
    frequencies = [float(name.split("_")[1]) for name in columns]
    figure, (axis,) = panels("Predicted deviation of the gain after one test", 1, 1, 3.6, Margins(left=0.9, right=2.2))
    colours = mpl.colormaps["viridis"](np.linspace(0.0, 0.9, len(clocks)))
    for colour, row in zip(colours, clocks.to_dict("records"), strict=True):
        axis.plot(frequencies, [100.0 * row[name] for name in columns], "o-", color=tuple(colour), label=row["input"])
    axis.set_yscale("log")
    axis.set_yticks([0.02, 0.05, 0.1, 0.2], ["0.02", "0.05", "0.1", "0.2"])
    axis.yaxis.set_minor_formatter(NullFormatter())
    axis.set_xlabel("frequency [Hz]")
    axis.set_ylabel("standard deviation [% of gain]")
    axis.legend(loc="center left", bbox_to_anchor=(1.02, 0.5))
    return figure


LIBRARY_FIGURES: Mapping[str, TableFigure] = MappingProxyType(
    {
        "library": TableFigure(
            "The library beside Table 6",
            "Ours rolls off at once where friction holds the piston. Eight of the nine models of Table 6 jump instead "
            "(errata E15); neither its sample time nor its unit is printed (errata E14).",
            draw_library,
        ),
        "structures": TableFigure(
            "Four structures: which is most accurate, and why",
            "Left, what the library is for: models run free on passes that they were not fitted to. Middle, what all "
            "but output error are fitted to. Right, where an error of the transfer function counts for each.",
            draw_structures,
        ),
        "orders": TableFigure(
            "Order and break frequency: beside second order and 25 Hz",
            "Left, marks right of the dashed line stand above what noise alone would give. Right, what more poles are "
            "worth; a mark left of the line is a search that ended beside the optimum, on records with drift.",
            draw_orders,
        ),
        "clocks": TableFigure(
            "The test's clock: what 5 Hz would cost",
            "By the Cramér-Rao bound of the model with major leakage, for tests of one length and one peak speed. The "
            "clock moves accuracy from low frequencies to high ones.",
            draw_clocks,
        ),
    }
)
"""The figures, by file name, in the report's order."""
