"""The diaphragm motor's figures: sections 7.1 to 7.3 repeated, a pump cycle, reversal and control.

They read the tables of `hydrostate diaphragm-motor`, and compute nothing.
"""

from collections.abc import Mapping
from types import MappingProxyType

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.figures.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILION, Margins, panels
from experiments.figures.tables import TableFigure, Tables

MILLI, ML_MIN = 1e3, 6e7

ELECTRODES = MappingProxyType({"a1_v": ORANGE, "a2_v": GREY, "a3_v": BLUE, "a4_v": VERMILION})
"""Electrodes that are drawn, and their colours; A5, A6 and A7 lie on A3, A2 and A1."""


def _sensing(axis: Axes, table: pd.DataFrame, across: str) -> None:
    for column, colour in ELECTRODES.items():
        axis.plot(table[across], table[column], color=colour, label=column[:2].upper())
    axis.set_ylabel("sensing voltage, amplitude [V]")
    axis.set_ylim(bottom=0.0)
    axis.legend(loc="lower left", ncols=2)


def draw_frequency(tables: Tables) -> Figure:
    """Draw flow and sensing over frequency, as section 7.1 tells.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        The study's tables.

    Returns
    -------
    Figure
        Flow on the left, electrodes on the right.
    """
    sweep = tables["frequency sweep"]
    title = "Pump alone at 200 V peak to peak: flow and sensing peak together"
    figure, (left, right) = panels(title, 1, 2, 3.8, Margins(left=0.65, across=0.7))
    left.plot(sweep["frequency_hz"], ML_MIN * sweep["flow_m3_s"], color=BLUE)
    left.plot([480.0], [110.11], "D", color=ORANGE, markeredgecolor=BLACK, markersize=7, label="quoted by the paper")
    left.set_ylabel("flow [ml/min]")
    left.set_ylim(bottom=0.0)
    left.legend(loc="upper left")
    _sensing(right, sweep, "frequency_hz")
    for axis in (left, right):
        axis.set_xlabel("frequency [Hz]")
    return figure


def draw_voltage(tables: Tables) -> Figure:
    """Draw flow and sensing over voltage, as section 7.1 tells.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        The study's tables.

    Returns
    -------
    Figure
        Flow on the left, electrodes on the right.
    """
    sweep = tables["voltage sweep"]
    title = "Pump alone at 480 Hz: flow and sensing rise with voltage"
    figure, (left, right) = panels(title, 1, 2, 3.6, Margins(left=0.65, across=0.7))
    left.plot(sweep["voltage_v"], ML_MIN * sweep["flow_m3_s"], "o-", color=BLUE, markersize=3.5)
    left.set_ylabel("flow [ml/min]")
    left.set_ylim(bottom=0.0)
    _sensing(right, sweep, "voltage_v")
    for axis in (left, right):
        axis.set_xlabel("voltage, peak to peak [V]")
    return figure


def draw_load(tables: Tables) -> Figure:
    """Draw velocity over load, and over frequency under load, as equation 18 and section 7.2 tell.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        The study's tables.

    Returns
    -------
    Figure
        Load on the left, frequency on the right.
    """
    title = "Velocity of the piston: straight against load, and best at lower frequency the heavier it is"
    figure, (left, right) = panels(title, 1, 2, 3.8, Margins(left=0.65, across=0.7))
    for colour, (swing, rows) in zip((GREEN, BLUE, VERMILION), tables["load sweep"].groupby("voltage_v"), strict=False):
        label = f"{float(str(swing)):g} V"
        left.plot(rows["load_n"], MILLI * rows["velocity_m_s"], "o-", color=colour, markersize=3.5, label=label)
    groups = list(tables["load and frequency"].groupby("load_n"))
    for (load, rows), shade in zip(groups, np.linspace(0.0, 0.85, len(groups)), strict=True):
        colour = mpl.colormaps["viridis"](shade)
        right.plot(rows["frequency_hz"], MILLI * rows["velocity_m_s"], color=colour, label=f"{float(str(load)):g} N")
        top = rows.iloc[int(rows["velocity_m_s"].argmax())]
        right.plot([top["frequency_hz"]], [MILLI * top["velocity_m_s"]], "o", color=colour, markersize=6)
    left.set_xlabel("load [N]")
    right.set_xlabel("frequency [Hz], at 300 V")
    for axis in (left, right):
        axis.set_ylabel("velocity [mm/s]")
        axis.set_ylim(bottom=0.0)
        axis.legend(loc="upper right", ncols=2)
    right.set_ylim(top=1.25 * right.get_ylim()[1])
    return figure


def draw_cycle(tables: Tables) -> Figure:
    """Draw two cycles of the pump: pressures of neighbours, the valves between them, and flows (Figure 3).

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
    title = "Two cycles at 480 Hz and 200 V: neighbours push against each other, the valves follow late"
    figure, axes = panels(title, 3, 1, 6.0, Margins(left=0.75), sharex=True)
    top, middle, bottom = axes
    for column, colour in (("chamber_3_pa", GREEN), ("chamber_4_pa", BLUE), ("chamber_5_pa", VERMILION)):
        top.plot(time, 1e-3 * cycle[column], color=colour, label=f"chamber {column[8]}")
    for column, colour, words in (
        ("valve_4", GREEN, "valve 4, before chamber 4"),
        ("valve_5", BLUE, "valve 5, behind"),
    ):
        middle.plot(time, cycle[column], color=colour, label=words)
    for column, colour, words in (
        ("flow_1_m3_s", GREY, "inlet"),
        ("flow_4_m3_s", GREEN, "valve 4"),
        ("flow_5_m3_s", BLUE, "valve 5"),
        ("flow_8_m3_s", PURPLE, "outlet"),
    ):
        bottom.plot(time, ML_MIN * cycle[column], color=colour, label=words)
    for axis, words in ((top, "pressure above tank [kPa]"), (middle, "opening [1]"), (bottom, "flow [ml/min]")):
        axis.set_ylabel(words)
        low, high = axis.get_ylim()
        axis.set_ylim(low, high + 0.3 * (high - low))
        axis.legend(loc="upper right", ncols=4)
    bottom.set_xlabel("time [ms]")
    bottom.set_xlim(0.0, float(time.max()))
    return figure


def draw_reversal(tables: Tables) -> Figure:
    """Draw the piston while the 4/3 valve extends, holds, retracts and holds (section 5.1).

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        The study's tables.

    Returns
    -------
    Figure
        Position over time, the spool behind it.
    """
    course = tables["reversal"]
    title = "The 4/3 valve extends, holds and retracts the piston; the pump runs on"
    figure, (axis,) = panels(title, 1, 1, 3.2, Margins(left=0.7))
    axis.plot(course["time_s"], MILLI * course["position_m"], color=BLUE)
    words = {1.0: ("extends", SKY), -1.0: ("retracts", ORANGE), 0.0: ("holds", GREY)}
    axis.set_ylim(top=1.2 * axis.get_ylim()[1])
    edges = course["spool"].ne(course["spool"].shift()).cumsum()
    for _, part in course.groupby(edges):
        name, colour = words[float(part["spool"].iloc[0])]
        first, last = float(part["time_s"].iloc[0]), float(part["time_s"].iloc[-1])
        axis.axvspan(first, last, color=colour, alpha=0.18, linewidth=0.0, zorder=0)
        place = (0.5 * (first + last), 0.94)
        axis.annotate(name, place, xycoords=("data", "axes fraction"), ha="center", color=BLACK)
    axis.set_xlabel("time [s]")
    axis.set_ylabel("position [mm]")
    axis.set_xlim(0.0, float(course["time_s"].max()))
    return figure


def draw_averaged(tables: Tables) -> Figure:
    """Draw the piston's velocity by the fast plant and by the averaged motor.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        The study's tables.

    Returns
    -------
    Figure
        Velocity over time.
    """
    course = tables["averaged"]
    title = "Averaged over cycles: 150, 250 and 200 V at 480 Hz against 5 N"
    figure, (axis,) = panels(title, 1, 1, 3.2, Margins(left=0.7))
    axis.plot(
        course["time_s"], MILLI * course["fast_m_s"], color=SKY, linewidth=2.2, label="fast plant, mean of a cycle"
    )
    axis.plot(course["time_s"], MILLI * course["averaged_m_s"], color=VERMILION, label="averaged motor on its maps")
    axis.set_xlabel("time [s]")
    axis.set_ylabel("velocity [mm/s]")
    axis.legend(loc="lower right")
    return figure


def draw_control(tables: Tables) -> Figure:
    """Draw velocity under PI control, healthy above, with a leak past the piston below.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        The study's tables.

    Returns
    -------
    Figure
        Encoder on the left, self-sensing on the right.
    """
    title = "PI on the drive's voltage: velocity steps at 0.8 s, load at 1.6 s"
    figure, axes = panels(title, 2, 2, 5.6, Margins(left=0.65, top=0.75, across=0.35, down=0.55), sharey=True)
    for axis, (name, rows) in zip(axes, tables["control courses"].groupby("run", sort=False), strict=True):
        time = rows["time_s"]
        axis.plot(time, MILLI * rows["measured_m_s"], color=SKY, linewidth=0.9, label="as the controller sees it")
        axis.plot(time, MILLI * rows["velocity_m_s"], color=VERMILION, label="true")
        axis.step(time, MILLI * rows["wanted_m_s"], color=BLACK, linestyle="--", linewidth=0.9, label="wanted")
        axis.set_title(str(name), loc="left")
        axis.set_ylim(-0.5, 5.0)
    axes[0].legend(loc="upper left")
    for axis in axes[2:]:
        axis.set_xlabel("time [s]")
    for axis in axes[::2]:
        axis.set_ylabel("velocity [mm/s]")
    return figure


MOTOR_FIGURES: Mapping[str, TableFigure] = MappingProxyType(
    {
        "frequency": TableFigure(
            "Frequency: flow and sensing",
            "The plant is calibrated to the diamond, the only flow that the paper states (errata M22). A5, A6 "
            "and A7 lie on A3, A2 and A1. A1's voltage does not go on rising (errata M31).",
            draw_frequency,
        ),
        "voltage": TableFigure(
            "Voltage: flow and sensing",
            "Volts of sensing rest on an assumed gain; their course counts (errata M15).",
            draw_voltage,
        ),
        "load": TableFigure(
            "Load: velocity and best frequency",
            "Dots on the right mark the best frequency, which falls with load; the paper has it rise (errata M31).",
            draw_load,
        ),
        "pump_cycle": TableFigure(
            "Pump cycle: pressures, valves, flows",
            "A valve needs half a millisecond, a quarter of the cycle, and passes liquid back before it shuts: this, "
            "and the liquid's inertia, set the best frequency.",
            draw_cycle,
        ),
        "reversal": TableFigure(
            "Reversal: the directional valve",
            "At the valve's centre the pump runs to tank and both sides of the cylinder are shut.",
            draw_reversal,
        ),
        "averaged": TableFigure(
            "Averaged model: beside the fast plant",
            "What filters and controllers step by 0.2 ms instead of 10 µs: maps of flow against voltage, frequency and "
            "pressure, and the cylinder on them. The pump's own answer to a step, two or three milliseconds, is "
            "not in it.",
            draw_averaged,
        ),
        "control": TableFigure(
            "Control: PI by encoder and by self-sensing",
            "Self-sensing reads flow from A4 and the voltage by the healthy motor's maps. What leaks past the piston "
            "does not show there: below on the right it reports the wanted velocity while the piston is slower.",
            draw_control,
        ),
    }
)
"""The figures, by file name."""
