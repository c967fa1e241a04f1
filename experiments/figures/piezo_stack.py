"""The piezo-stack actuator's figures: the paper's Figures 10 to 14 repeated, a pump cycle, maps, and what limits it.

They read the tables of `hydrostate piezo-stack`, and compute nothing.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from types import MappingProxyType
from typing import Any

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.figures.style import BLACK, BLUE, GREEN, GREY, ORANGE, SKY, VERMILION, Margins, panels
from experiments.figures.tables import TableFigure, Tables
from plant.units import LITRE_PER_MINUTE

MEGA, MICRO, MILLI = 1e-6, 1e6, 1e3

_CONTOUR = 0.2
"""Flow from one contour to the next [L/min]."""

STAGE_COLOURS = MappingProxyType({"compression": ORANGE, "discharge": SKY, "expansion": GREY, "intake": GREEN})


def draw_loops(tables: Tables) -> Figure:
    """Draw displacement against voltage, as Figure 10 does.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        The study's tables.

    Returns
    -------
    Figure
        Loops on the left, their width over frequency on the right.
    """
    figure, (left, right) = panels(
        "Stack without load, 100 V peak to peak: its loop widens with frequency",
        1,
        2,
        3.8,
        Margins(left=0.65, across=0.8),
    )
    groups = list(tables["figure 10 loops"].groupby("frequency_hz"))
    for (frequency, loop), shade in zip(groups, np.linspace(0.0, 0.88, len(groups)), strict=True):
        colour = mpl.colormaps["viridis"](shade)
        left.plot(loop["voltage_v"], MICRO * loop["displacement_m"], color=colour, label=f"{frequency:g} Hz")
    widths = tables["figure 10 loop widths"]
    right.plot(widths["frequency_hz"], widths["width_percent"], "o-", color=BLUE, markersize=4)
    left.set_xlabel("voltage [V]")
    left.set_ylabel("displacement [µm]")
    left.legend(loc="upper left")
    right.set_xlabel("frequency [Hz]")
    right.set_ylabel("width at 50 V [% of stroke]")
    right.set_ylim(bottom=0.0)
    return figure


def _curves(axis: Axes, table: pd.DataFrame, by: str, words: Mapping[float, str], across: str = "frequency_hz") -> None:
    colours = (BLUE, VERMILION, GREEN)
    for colour, (value, rows) in zip(colours, table.groupby(by), strict=False):
        label = words[float(str(value))]
        axis.plot(rows[across], rows["flow_m3_s"] / LITRE_PER_MINUTE, "o-", color=colour, markersize=3.5, label=label)
    axis.set_ylim(bottom=0.0)
    axis.set_ylabel("output flow [L/min]")


def _published(axis: Axes, points: Sequence[tuple[float, float]]) -> None:
    x, y = zip(*points, strict=True)
    axis.set_ylim(top=max(axis.get_ylim()[1], 1.1 * max(y)))
    axis.plot(x, y, "D", color=ORANGE, markeredgecolor=BLACK, markersize=7, label="quoted by the paper")


def draw_no_load(tables: Tables) -> Figure:
    """Draw flow without load over frequency, as Figures 11 and 12 do.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        The study's tables.

    Returns
    -------
    Figure
        Two bias pressures on the left, two voltages on the right.
    """
    title = "Output flow without load"
    figure, (left, right) = panels(title, 1, 2, 3.8, Margins(left=0.65, top=0.65, across=0.6), sharey=True)
    _curves(left, tables["figure 11 flow over bias pressure"], "bias_pressure_pa", {6e5: "0.6 MPa", 1e6: "1.0 MPa"})
    _curves(right, tables["figure 12 flow over voltage"], "voltage_v", {100.0: "100 V", 140.0: "140 V"})
    for axis, words in ((left, "Figure 11: bias pressure, 140 V"), (right, "Figure 12: voltage, 1.0 MPa")):
        _published(axis, [(275.0, 1.6)])
        axis.set_title(words, loc="left")
        axis.set_xlabel("frequency [Hz]")
        axis.legend(loc="lower right")
    return figure


def draw_loaded(tables: Tables) -> Figure:
    """Draw flow under load over frequency and over load, as Figures 13 and 14 do.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        The study's tables.

    Returns
    -------
    Figure
        Fixed weights on the left, rising load on the right.
    """
    figure, (left, right) = panels(
        "Output flow under load, 140 V and 1.0 MPa", 1, 2, 3.8, Margins(left=0.65, top=0.65, across=0.6), sharey=True
    )
    weights = {0.0: "no load", 10.0: "10 kg", 20.0: "20 kg"}
    _curves(left, tables["figure 13 flow with fixed weight"], "load_kg", weights)
    _published(left, [(275.0, 1.0)])
    speeds = {225.0: "225 Hz", 275.0: "275 Hz", 325.0: "325 Hz"}
    _curves(right, tables["figure 14 flow over load"], "frequency_hz", speeds, across="load_kg")
    left.set_title("Figure 13: the quoted point is at 20 kg", loc="left")
    right.set_title("Figure 14", loc="left")
    left.set_xlabel("frequency [Hz]")
    right.set_xlabel("load [kg]")
    left.legend(loc="upper left")
    right.legend(loc="upper right")
    return figure


def draw_cycle(tables: Tables) -> Figure:
    """Draw two pump cycles: pressures, reeds and flow, with the four stages behind (Figure 2).

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        The study's tables.

    Returns
    -------
    Figure
        Three panels over one time axis.
    """
    cycle = tables["pump cycle"]
    time = MILLI * cycle["time_s"]
    title = "Two pump cycles at 50 Hz with 20 kg: compression, discharge, expansion, intake"
    figure, (top, middle, bottom) = panels(title, 3, 1, 6.2, Margins(left=0.75, top=0.75), sharex=True)
    for axis in (top, middle, bottom):
        _stage_bands(axis, time.to_numpy(), cycle["stage"].to_numpy())
    for column, colour, label in (
        ("chamber_pa", BLACK, "pump chamber"),
        ("delivery_pa", BLUE, "behind the outlet reed"),
        ("intake_pa", VERMILION, "before the inlet reed"),
    ):
        top.plot(time, MEGA * cycle[column], color=colour, label=label)
    middle.plot(time, MICRO * cycle["outlet_reed_m"], color=BLUE, label="outlet reed")
    middle.plot(time, MICRO * cycle["inlet_reed_m"], color=VERMILION, label="inlet reed")
    bottom.plot(time, cycle["delivery_flow_m3_s"] / LITRE_PER_MINUTE, color=BLUE, label="flow in the delivery line")
    for axis, words in ((top, "pressure [MPa]"), (middle, "lift [µm]"), (bottom, "flow [L/min]")):
        axis.set_ylabel(words)
        axis.legend(loc="upper right", ncols=3)
        low, high = axis.get_ylim()
        axis.set_ylim(low, high + 0.25 * (high - low))
    bottom.set_xlabel("time [ms]")
    bottom.set_xlim(0.0, float(time.max()))
    return figure


def _stage_bands(axis: Axes, time: np.ndarray, stage: np.ndarray) -> None:
    edges = [0, *(1 + np.flatnonzero(stage[1:] != stage[:-1])), len(stage) - 1]
    for first, last in pairwise(edges):
        axis.axvspan(time[first], time[last], color=STAGE_COLOURS[stage[first]], alpha=0.22, linewidth=0.0, zorder=0)
        if axis.get_subplotspec().rowspan.start == 0 and time[last] - time[first] > 0.05 * time[-1]:  # pyright: ignore[reportOptionalMemberAccess] - made by subplots
            axis.annotate(
                stage[first],
                (0.5 * (time[first] + time[last]), 1.0),
                (0, 3),
                xycoords=("data", "axes fraction"),
                textcoords="offset points",
                ha="center",
                fontsize=8.0,
                color=GREY,
            )


def draw_maps(tables: Tables) -> Figure:
    """Draw output flow over frequency and load, and over frequency and voltage, at both bias pressures.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        The study's tables.

    Returns
    -------
    Figure
        Four contour plots on one colour scale.
    """
    design = tables["design map"]
    title = "Output flow [L/min]: above over load at the highest voltage, below over voltage without load"
    figure, axes = panels(title, 2, 2, 6.6, Margins(left=0.65, right=0.9, top=0.7, across=0.7, down=0.55))
    top = float(design["flow_m3_s"].max()) / LITRE_PER_MINUTE
    levels = np.arange(0.0, top + _CONTOUR, _CONTOUR)
    drawn: Any = None
    for column, (bias, rows) in enumerate(design.groupby("bias_pressure_pa")):
        strongest = rows[rows["voltage_v"] == rows["voltage_v"].max()]
        free = rows[rows["load_kg"] == rows["load_kg"].min()]
        for axis, part, up, words in (
            (axes[column], strongest, "load_kg", "load [kg]"),
            (axes[2 + column], free, "voltage_v", "voltage, peak to peak [V]"),
        ):
            grid = part.pivot_table(index=up, columns="frequency_hz", values="flow_m3_s") / LITRE_PER_MINUTE
            drawn = axis.contourf(grid.columns, grid.index, grid.clip(lower=0.0), levels=levels, cmap="viridis")
            axis.set_ylabel(words)
            axis.set_xlabel("frequency [Hz]")
            axis.grid(visible=False)
        axes[column].set_title(f"bias pressure {MEGA * float(str(bias)):g} MPa", loc="left")
    figure.colorbar(drawn, ax=axes, pad=0.01, fraction=0.03, cax=figure.add_axes((0.925, 0.1, 0.015, 0.76)))
    return figure


def draw_limits(tables: Tables) -> Figure:
    """Draw by how much the flow answers to each part.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        The study's tables.

    Returns
    -------
    Figure
        One pair of bars a part, the strongest on top.
    """
    table = tables["what limits the flow"]
    order = table[["percent_up", "percent_down"]].abs().max(axis=1).sort_values().index
    table = table.loc[order]
    title = "What limits the flow at 275 Hz and 10 kg: change for 5 % more and 5 % less of each"
    figure, (axis,) = panels(title, 1, 1, 4.8, Margins(left=1.9, top=0.45))
    places = np.arange(len(table))
    axis.barh(places + 0.2, table["percent_up"], 0.38, color=BLUE, label="5 % more")
    axis.barh(places - 0.2, table["percent_down"], 0.38, color=ORANGE, label="5 % less")
    axis.set_yticks(places, table["part"].tolist())
    axis.axvline(0.0, color=BLACK, linewidth=0.8)
    axis.grid(visible=False, axis="y")
    axis.set_xlabel("change of output flow [%]")
    axis.legend(loc="lower right")
    return figure


STACK_FIGURES: Mapping[str, TableFigure] = MappingProxyType(
    {
        "figure_10": TableFigure(
            "Figure 10: the stack's loops",
            "The first-order lag of equation 2 (errata P2) widens a loop that is rate-independent at 1 Hz.",
            draw_loops,
        ),
        "figures_11_and_12": TableFigure(
            "Figures 11 and 12: no load",
            "The diamond is the one flow that the text quotes; the figures themselves are lost (errata P17).",
            draw_no_load,
        ),
        "figures_13_and_14": TableFigure(
            "Figures 13 and 14: under load",
            "The diamond is the flow that the text quotes at 20 kg (errata P17).",
            draw_loaded,
        ),
        "pump_cycle": TableFigure(
            "Pump cycle: the four stages",
            "Where a reed stands open and oil flows forward, the chamber discharges or takes in; between them it is "
            "compressed or expands. At 275 Hz the reeds lag so far that one opens as the other shuts.",
            draw_cycle,
        ),
        "design_maps": TableFigure(
            "Design maps: where the flow is",
            "Dark is no flow. The amplifier ends at 450 Hz, the stack at 150 V.",
            draw_maps,
        ),
        "limits": TableFigure(
            "What limits the flow",
            "One part at a time, all else kept. Long bars say where a change of design pays.",
            draw_limits,
        ),
    }
)
"""The figures, by file name."""
