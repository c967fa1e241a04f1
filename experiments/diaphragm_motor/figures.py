"""The diaphragm motor's figures: sections 7.1 to 7.3 repeated, a pump cycle, reversal and control.

They read the tables of `hydrostate diaphragm-motor`, and compute nothing.
"""

from collections.abc import Sequence
from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.page.drawing import Course, draw_courses, draw_published, with_colours
from experiments.page.figure_files import Drawings
from experiments.page.frames import Tables
from experiments.page.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILION, Margins, panels

MILLI, ML_MIN = 1e3, 6e7

ELECTRODES = {"a1_v": (ORANGE, "-"), "a2_v": (GREY, "--"), "a3_v": (BLUE, "-"), "a4_v": (VERMILION, ":")}
"""Electrodes that are drawn, with colours and lines; A5, A6 and A7 coincide with A3, A2 and A1."""

CYCLE: Sequence[Course] = (
    (
        ("pressure above tank [kPa]", 1e-3),
        (
            ("chamber_3_pa", GREEN, "chamber 3"),
            ("chamber_4_pa", BLUE, "chamber 4"),
            ("chamber_5_pa", VERMILION, "chamber 5"),
        ),
    ),
    (("opening [share]", 1.0), (("valve_4", GREEN, "valve 4, before chamber 4"), ("valve_5", BLUE, "valve 5, behind"))),
    (
        ("flow [ml/min]", ML_MIN),
        (
            ("flow_1_m3_s", GREY, "inlet"),
            ("flow_4_m3_s", GREEN, "valve 4"),
            ("flow_5_m3_s", BLUE, "valve 5"),
            ("flow_8_m3_s", PURPLE, "outlet"),
        ),
    ),
)


def _draw_sweep(flow: Axes, sensing: Axes, sweep: pd.DataFrame, across: str, label: str, **marks: Any) -> None:
    flow.plot(sweep[across], ML_MIN * sweep["flow_m3_s"], color=BLUE, **marks)
    for column, (colour, line) in ELECTRODES.items():
        sensing.plot(sweep[across], sweep[column], color=colour, linestyle=line, label=column[:2].upper())
    flow.set(xlabel=label, ylabel="flow [ml/min]")
    sensing.set(xlabel=label, ylabel="sensing voltage, amplitude [V]", ylim=(0.0, None))
    sensing.legend(loc="lower left", ncols=2)


def _draw_frequency(tables: Tables) -> Figure:
    """Draw flow and sensing over frequency, as in section 7.1. Flow on the left, electrodes on the right."""
    title = "Pump alone at 200 V peak to peak: flow and sensing peak together"
    figure, (left, right) = panels(title, 1, 2, 3.8, Margins(left=0.65, across=0.7))
    _draw_sweep(left, right, tables["frequency sweep"], "frequency_hz", "frequency [Hz]")
    draw_published(left, 480.0, 110.11, "quoted by the paper")
    left.set(ylim=(0.0, None))
    left.legend(loc="upper left")
    return figure


def _draw_voltage(tables: Tables) -> Figure:
    """Draw flow and sensing over voltage, as in section 7.1. Flow on the left, electrodes on the right."""
    title = "Pump alone at 480 Hz: flow and sensing rise with voltage"
    figure, (left, right) = panels(title, 1, 2, 3.6, Margins(left=0.65, across=0.7))
    _draw_sweep(
        left, right, tables["voltage sweep"], "voltage_v", "voltage, peak to peak [V]", marker="o", markersize=3.5
    )
    left.set(ylim=(0.0, None))
    return figure


def _draw_load(tables: Tables) -> Figure:
    """Draw velocity over load, and over frequency under load, as in equation 18 and section 7.2.

    Load on the left, frequency on the right.
    """
    title = "Velocity of the piston: straight against load, and best at lower frequency the heavier it is"
    figure, (left, right) = panels(title, 1, 2, 3.8, Margins(left=0.65, across=0.7))
    for colour, (swing, rows) in zip((GREEN, BLUE, VERMILION), tables["load sweep"].groupby("voltage_v"), strict=False):
        label = f"{float(str(swing)):g} V"
        left.plot(rows["load_n"], MILLI * rows["velocity_m_s"], "o-", color=colour, markersize=3.5, label=label)
    for load, rows, colour in with_colours(tables["load and frequency"].groupby("load_n"), 0.85):
        right.plot(rows["frequency_hz"], MILLI * rows["velocity_m_s"], color=colour, label=f"{load:g} N")
        top = rows.iloc[int(rows["velocity_m_s"].argmax())]
        right.plot([top["frequency_hz"]], [MILLI * top["velocity_m_s"]], "o", color=colour, markersize=6)
    left.set(xlabel="load [N]")
    right.set(xlabel="frequency [Hz], at 300 V")
    for axis in (left, right):
        axis.set(ylabel="velocity [mm/s]", ylim=(0.0, None))
        axis.legend(loc="upper right", ncols=2)
    right.set_ylim(top=1.25 * right.get_ylim()[1])
    return figure


def _draw_cycle(tables: Tables) -> Figure:
    """Draw two cycles of the pump: pressures of adjacent chambers, the valves between them, and flows (Figure 3).

    Three panels over one time axis.
    """
    cycle = tables["pump cycle"]
    title = "Two cycles at 480 Hz and 200 V: neighbours push against each other, the valves follow late"
    figure, axes = panels(title, 3, 1, 6.0, Margins(left=0.75), sharex=True)
    draw_courses(axes, MILLI * cycle["time_s"], cycle, CYCLE, room=0.3)
    return figure


def _draw_reversal(tables: Tables) -> Figure:
    """Draw the piston while the 4/3 valve extends, holds, retracts and holds (section 5.1).

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
    axis.set(xlabel="time [s]", ylabel="position [mm]", xlim=(0.0, float(course["time_s"].max())))
    return figure


def _draw_averaged(tables: Tables) -> Figure:
    """Draw the piston's velocity by the fast plant and by the averaged motor."""
    course = tables["averaged"]
    title = "Averaged over cycles: 150, 250 and 200 V at 480 Hz against 5 N"
    figure, (axis,) = panels(title, 1, 1, 3.2, Margins(left=0.7))
    time, fast = course["time_s"], MILLI * course["fast_m_s"]
    axis.plot(time, fast, color=SKY, linewidth=2.2, label="fast plant, mean of a cycle")
    axis.plot(time, MILLI * course["averaged_m_s"], color=VERMILION, label="averaged motor on its maps")
    axis.set(xlabel="time [s]", ylabel="velocity [mm/s]")
    axis.legend(loc="lower right")
    return figure


def _draw_control(tables: Tables) -> Figure:
    """Draw velocity under PI control, healthy above, with a leak past the piston below.

    Encoder on the left, self-sensing on the right.
    """
    title = "PI on the drive's voltage: velocity steps at 0.8 s, load at 1.6 s"
    figure, axes = panels(title, 2, 2, 5.6, Margins(left=0.65, top=0.75, across=0.35, down=0.55), sharey=True)
    for axis, (name, rows) in zip(axes, tables["control courses"].groupby("run", sort=False), strict=True):
        time = rows["time_s"]
        axis.plot(time, MILLI * rows["measured_m_s"], color=SKY, linewidth=0.9, label="as the controller sees it")
        axis.plot(time, MILLI * rows["velocity_m_s"], color=VERMILION, label="true")
        axis.step(time, MILLI * rows["wanted_m_s"], color=BLACK, linestyle="--", linewidth=0.9, label="wanted")
        axis.set(title=str(name), ylim=(-0.5, 5.0))
    axes[0].legend(loc="upper left")
    for axis in axes[2:]:
        axis.set(xlabel="time [s]")
    for axis in axes[::2]:
        axis.set(ylabel="velocity [mm/s]")
    return figure


MOTOR_FIGURES: Drawings = {
    "frequency": _draw_frequency,
    "voltage": _draw_voltage,
    "load": _draw_load,
    "pump_cycle": _draw_cycle,
    "reversal": _draw_reversal,
    "averaged": _draw_averaged,
    "control": _draw_control,
}
