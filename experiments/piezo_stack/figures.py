"""The piezo-stack actuator's figures: the paper's Figures 10 to 14 repeated, a pump cycle, maps, and flow limits.

They read the tables of `hydrostate piezo-stack`, and compute nothing.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.page.drawing import Course, draw_courses, draw_paired_bars, draw_published, label_point, with_colours
from experiments.page.figure_files import Drawings
from experiments.page.frames import Tables
from experiments.page.style import BLACK, BLUE, GREEN, GREY, ORANGE, SKY, VERMILION, Margins, panels
from plant.units import LITRE_PER_MINUTE

MEGA, MICRO, MILLI = 1e-6, 1e6, 1e3

_CONTOUR = 0.2
"""Flow interval between contours [L/min]."""

CYCLE: Sequence[Course] = (
    (
        ("pressure [MPa]", MEGA),
        (
            ("chamber_pa", BLACK, "pump chamber"),
            ("delivery_pa", BLUE, "behind the outlet reed"),
            ("intake_pa", VERMILION, "before the inlet reed"),
        ),
    ),
    (("lift [µm]", MICRO), (("outlet_reed_m", BLUE, "outlet reed"), ("inlet_reed_m", VERMILION, "inlet reed"))),
    (("flow [L/min]", 1.0 / LITRE_PER_MINUTE), (("delivery_flow_m3_s", BLUE, "flow in the delivery line"),)),
)

STAGE_COLOURS = {"compression": ORANGE, "discharge": SKY, "expansion": GREY, "intake": GREEN}


def _draw_loops(tables: Tables) -> Figure:
    """Draw displacement against voltage, as Figure 10 does.

    Loops on the left, their width over frequency on the right.
    """
    title = "Stack without load, 100 V peak to peak: its loop widens with frequency"
    figure, (left, right) = panels(title, 1, 2, 3.8, Margins(left=0.65, across=0.8))
    for frequency, loop, colour in with_colours(tables["figure 10 loops"].groupby("frequency_hz")):
        left.plot(loop["voltage_v"], MICRO * loop["displacement_m"], color=colour, label=f"{frequency:g} Hz")
    widths = tables["figure 10 loop widths"]
    right.plot(widths["frequency_hz"], widths["width_percent"], "o-", color=BLUE, markersize=4)
    left.set(xlabel="voltage [V]", ylabel="displacement [µm]")
    right.set(xlabel="frequency [Hz]", ylabel="width at 50 V [% of stroke]", ylim=(0.0, None))
    left.legend(loc="upper left")
    return figure


def _curves(axis: Axes, table: pd.DataFrame, by: str, words: Mapping[float, str], across: str = "frequency_hz") -> None:
    colours = (BLUE, VERMILION, GREEN)
    for colour, (value, rows) in zip(colours, table.groupby(by), strict=False):
        label = words[float(str(value))]
        axis.plot(rows[across], rows["flow_m3_s"] / LITRE_PER_MINUTE, "o-", color=colour, markersize=3.5, label=label)
    axis.set(ylim=(0.0, None), ylabel="output flow [L/min]")


def _draw_quoted_flow(axis: Axes, flow: float) -> None:
    axis.set_ylim(top=max(axis.get_ylim()[1], 1.1 * flow))
    draw_published(axis, 275.0, flow, "quoted by the paper")


def _draw_no_load(tables: Tables) -> Figure:
    """Draw flow without load over frequency, as Figures 11 and 12 do.

    Two bias pressures on the left, two voltages on the right.
    """
    title = "Output flow without load"
    figure, (left, right) = panels(title, 1, 2, 3.8, Margins(left=0.65, top=0.65, across=0.6), sharey=True)
    _curves(left, tables["figure 11 flow over bias pressure"], "bias_pressure_pa", {6e5: "0.6 MPa", 1e6: "1.0 MPa"})
    _curves(right, tables["figure 12 flow over voltage"], "voltage_v", {100.0: "100 V", 140.0: "140 V"})
    for axis, words in ((left, "Figure 11: bias pressure, 140 V"), (right, "Figure 12: voltage, 1.0 MPa")):
        _draw_quoted_flow(axis, 1.6)
        axis.set(title=words, xlabel="frequency [Hz]")
        axis.legend(loc="lower right")
    return figure


def _draw_loaded(tables: Tables) -> Figure:
    """Draw flow under load over frequency and over load, as Figures 13 and 14 do.

    Fixed weights on the left, rising load on the right.
    """
    title = "Output flow under load, 140 V and 1.0 MPa"
    figure, (left, right) = panels(title, 1, 2, 3.8, Margins(left=0.65, top=0.65, across=0.6), sharey=True)
    weights = {0.0: "no load", 10.0: "10 kg", 20.0: "20 kg"}
    _curves(left, tables["figure 13 flow with fixed weight"], "load_kg", weights)
    _draw_quoted_flow(left, 1.0)
    speeds = {225.0: "225 Hz", 275.0: "275 Hz", 325.0: "325 Hz"}
    _curves(right, tables["figure 14 flow over load"], "frequency_hz", speeds, across="load_kg")
    left.set(title="Figure 13: the quoted point is at 20 kg", xlabel="frequency [Hz]")
    right.set(title="Figure 14", xlabel="load [kg]")
    left.legend(loc="lower right")
    right.legend(loc="upper right")
    return figure


def _draw_cycle(tables: Tables) -> Figure:
    """Draw two pump cycles: pressures, reeds and flow, with the four stages behind (Figure 2).

    Three panels over one time axis.
    """
    cycle = tables["pump cycle"]
    time = MILLI * cycle["time_s"]
    title = "Two pump cycles at 50 Hz with 20 kg: compression, discharge, expansion, intake"
    figure, axes = panels(title, 3, 1, 6.2, Margins(left=0.75, top=0.75), sharex=True)
    for axis in axes:
        _stage_bands(axis, time.to_numpy(), cycle["stage"].to_numpy())
    draw_courses(axes, time, cycle, CYCLE, room=0.25)
    return figure


def _stage_bands(axis: Axes, time: np.ndarray, stage: np.ndarray) -> None:
    edges = [0, *(1 + np.flatnonzero(stage[1:] != stage[:-1])), len(stage) - 1]
    for first, last in pairwise(edges):
        axis.axvspan(time[first], time[last], color=STAGE_COLOURS[stage[first]], alpha=0.22, linewidth=0.0, zorder=0)
        if axis.get_subplotspec().rowspan.start == 0 and time[last] - time[first] > 0.05 * time[-1]:  # pyright: ignore[reportOptionalMemberAccess] - made by subplots
            above, look = ("data", "axes fraction"), {"ha": "center", "fontsize": 8.0, "color": GREY}
            label_point(axis, stage[first], (0.5 * (time[first] + time[last]), 1.0), (0, 3), xycoords=above, **look)


def _draw_maps(tables: Tables) -> Figure:
    """Draw output flow over frequency and load, and over frequency and voltage, at both bias pressures.

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
            axis.set(ylabel=words, xlabel="frequency [Hz]")
            axis.grid(visible=False)
        axes[column].set(title=f"bias pressure {MEGA * float(str(bias)):g} MPa")
    figure.colorbar(drawn, ax=axes, pad=0.01, fraction=0.03, cax=figure.add_axes((0.925, 0.1, 0.015, 0.76)))
    return figure


def _draw_limits(tables: Tables) -> Figure:
    """Draw the sensitivity of the flow to each part. One pair of bars for each part, the strongest on top."""
    table = tables["what limits the flow"]
    order = table[["percent_up", "percent_down"]].abs().max(axis=1).sort_values().index
    table = table.loc[order]
    title = "What limits the flow at 275 Hz and 10 kg: change for 5 % more and 5 % less of each"
    figure, (axis,) = panels(title, 1, 1, 4.8, Margins(left=1.9, top=0.45))
    pairs = (("5 % more", table["percent_up"], BLUE), ("5 % less", table["percent_down"], ORANGE))
    draw_paired_bars(axis, table["part"].tolist(), pairs)
    axis.set(xlabel="change of output flow [%]")
    axis.legend(loc="lower right")
    return figure


STACK_FIGURES: Drawings = {
    "figure_10": _draw_loops,
    "figures_11_and_12": _draw_no_load,
    "figures_13_and_14": _draw_loaded,
    "pump_cycle": _draw_cycle,
    "design_maps": _draw_maps,
    "limits": _draw_limits,
}
