"""Figures of velocity from sensing voltages on the simulated diaphragm motor, and of its spectra.

They read the tables of `hydrostate motor-paper`, and compute nothing.
"""

from collections.abc import Mapping
from types import MappingProxyType

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from experiments.figures.style import BLACK, BLUE, GREY, ORANGE, VERMILION, Margins, panels
from experiments.figures.tables import TableFigure, Tables

MILLI = 1e3

SHOWN = ("A3, A4, A5, as the paper wants", "A4 and drive voltage")
"""The regressions that are drawn."""


def draw_velocity(tables: Tables) -> Figure:
    """Draw velocity fitted from sensing voltages over the motor's own.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        The study's tables.

    Returns
    -------
    Figure
        One panel a regression.
    """
    title = "Velocity from sensing voltages, thirty drives and loads at 480 Hz"
    figure, axes = panels(title, 1, 2, 3.9, Margins(left=0.65, top=0.75, across=0.5), sharey=True)
    rows = tables["sensing predictions"]
    most = MILLI * float(rows["velocity_m_s"].max())
    for axis, words in zip(axes, SHOWN, strict=True):
        groups = list(rows[rows["regressors"] == words].groupby("peak_to_peak_v"))
        for (swing, part), shade in zip(groups, np.linspace(0.0, 0.88, len(groups)), strict=True):
            colour, label = mpl.colormaps["viridis"](shade), f"{float(str(swing)):g} V"
            axis.plot(MILLI * part["velocity_m_s"], MILLI * part["fitted_m_s"], "o", color=colour, label=label)
        axis.plot([0.0, most], [0.0, most], color=GREY, linewidth=0.9)
        axis.set_title(words, loc="left")
        axis.set_xlabel("velocity [mm/s]")
    axes[0].set_ylabel("fitted velocity [mm/s]")
    axes[1].legend(loc="upper left", title="drive, peak to peak")
    return figure


def draw_faults(tables: Tables) -> Figure:
    """Draw by how much the regressions are off when one part fails.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        The study's tables.

    Returns
    -------
    Figure
        One pair of bars a fault.
    """
    table = tables["sensing faults"].iloc[::-1]
    title = "What a regression fitted to the healthy motor says of a faulty one, less its velocity (200 V, 10 N)"
    figure, (axis,) = panels(title, 1, 1, 3.4, Margins(left=2.3, top=0.45))
    places = np.arange(len(table))
    for words, colour, beside in zip(SHOWN, (VERMILION, BLUE), (0.2, -0.2), strict=True):
        axis.barh(places + beside, MILLI * table[words], 0.38, color=colour, label=words)
    axis.set_yticks(places, table["fault"].tolist())
    axis.axvline(0.0, color=BLACK, linewidth=0.8)
    axis.axvline(MILLI * float(table["velocity_m_s"].iloc[-1]), color=ORANGE, linewidth=1.0, label="velocity itself")
    axis.grid(visible=False, axis="y")
    axis.set_xlabel("error of velocity [mm/s]")
    axis.legend(loc="lower left")
    return figure


def draw_spectra(tables: Tables) -> Figure:
    """Draw the harmonics of the motor's signals at 200 V, as Figure 21 does.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        The study's tables.

    Returns
    -------
    Figure
        One panel a signal.
    """
    rows = tables["motor spectra"]
    rows = rows[(rows["peak_to_peak_v"] == 200.0) & (rows["harmonic"] > 0)]
    groups = list(rows.groupby("signal", sort=False))
    title = "Harmonics of 480 Hz at 200 V peak to peak, without load"
    figure, axes = panels(title, 1, len(groups), 3.4, Margins(left=0.65, top=0.75, across=0.2), sharey=True)
    for axis, (name, part) in zip(axes, groups, strict=True):
        axis.bar(part["harmonic"], part["relative_percent"], 0.7, color=BLUE)
        axis.set_yscale("log")
        axis.set_ylim(1e-3, 200.0)
        axis.set_xticks([1, 3, 5, 7, 9])
        axis.set_xlabel("harmonic")
        axis.set_title(str(name).split(" [")[0], loc="left")
    axes[0].set_ylabel("% of the first")
    return figure


SENSING_FIGURES: Mapping[str, TableFigure] = MappingProxyType(
    {
        "sensing": TableFigure(
            "Velocity from sensing voltages",
            "Left, one straight law cannot serve all drives: the same voltage stands for a strong drive against a load "
            "and a weak one without (errata M19). Right, the drive's voltage tells them apart.",
            draw_velocity,
        ),
        "sensing_faults": TableFigure(
            "Velocity when a part fails",
            "Coefficients of opposite sign, a few thousand times inflated, turn a fault of one electrode into a "
            "velocity that no motor has. The pair on the right side of the figure above is off as well, though less: "
            "find the fault first.",
            draw_faults,
        ),
        "spectra": TableFigure(
            "Figure 21: spectrum and harmonic distortion",
            "In the middle only odd harmonics, as symmetric hysteresis makes them; the first diaphragm, which draws "
            "from the tank, and the outlet's flow have even ones: there the valves rectify.",
            draw_spectra,
        ),
    }
)
"""The figures, by file name."""
