"""The paper's Figures 3 to 11 as the circuit plant reproduces them. They read tables, and compute nothing.

The tables have the names under which `hydrostate circuit` writes them.
"""

from collections.abc import Callable

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.circuit.estimates_figure import draw_bulk_modulus
from experiments.nine_conditions.identification import LEAST_COHERENCE, LEVEL_COLOURS, LEVEL_WORDS, draw_order
from experiments.page.drawing import draw_published, label_point, with_colours
from experiments.page.figure_files import Drawings
from experiments.page.frames import Tables
from experiments.page.style import BLACK, BLUE, GREY, Margins, panels
from experiments.published import SCALARS

MILLI, MEGA = 1e3, 1e-6
LITRES_A_MINUTE = 6e4

MARKERS = {"none": "o", "minor": "s", "major": "^"}


def _draw_throttles(tables: Tables) -> Figure:
    """Draw steady values against the throttles' voltages, as Figures 3 and 4 do.

    Velocity on the left, differential pressure on the right, both in percent of normal.
    """
    title = "What settles at 4 V: velocity against throttle A, pressure against throttle B"
    figure, (left, right) = panels(title, 1, 2, 3.8, Margins(left=0.7, top=0.65, across=0.8))
    pressure = tables["figure 4 pressure against friction throttle"]
    _draw_settled(left, tables["figure 3 velocity against leakage throttle"], "throttle_a_v")
    _draw_settled(right, pressure, "throttle_b_v")
    relief = pressure["percent_of_normal"].iloc[-1]
    right.axhline(relief, color=GREY, linewidth=1.0, linestyle=(0, (4, 3)), zorder=0)
    label_point(right, "relief valve, 500 psi", (0.0, relief), (4, -4), va="top", color=GREY)
    left.set(title="Figure 3", xlabel="throttle A: leakage, fully open at 0 V [V]", ylabel="velocity [% of normal]")
    right.set(title="Figure 4", xlabel="throttle B: load, shut towards 10 V [V]")
    right.set(ylabel="differential pressure [% of normal]", ylim=(0.0, 1.1 * relief))
    left.set(ylim=(0.0, 110.0))
    left.legend(loc="lower right")
    return figure


def _draw_settled(axis: Axes, curve: pd.DataFrame, volts: str) -> None:
    curve = curve.sort_values(volts)
    axis.plot(curve[volts], curve["percent_of_normal"], "o-", color=BLUE, markersize=4, label="circuit plant")
    draw_published(axis, curve[volts], curve["published_percent"], "published definition")


def _draw_responses(tables: Tables) -> Figure:
    """Draw empirical frequency responses over input means and amplitudes, as Figures 5 and 6 do.

    Gain above, phase below; means on the left, amplitudes on the right.
    """
    title = "Frequency response from motor speed to velocity, normal condition"
    figure, axes = panels(title, 2, 2, 6.2, Margins(left=0.75, top=0.7, down=0.2), sharex=True, sharey="row")
    sweeps = (
        ("figure 5 frequency response over input means", "mean_v", "Figure 5: input mean, 1 V around it"),
        ("figure 6 frequency response over input amplitudes", "amplitude_v", "Figure 6: input amplitude, no mean"),
    )
    for column, (name, by, words) in enumerate(sweeps):
        gain, phase = axes[column], axes[column + 2]
        for volts, rows, colour in with_colours(tables[name].groupby(by)):
            sure = rows["coherence"] >= LEAST_COHERENCE
            gain.plot(rows["frequency_hz"], MILLI * rows["gain"], color=colour, label=f"{volts:g} V")
            phase.plot(rows["frequency_hz"], rows["phase_deg"].where(sure), color=colour)
        gain.set(title=words)
        phase.set(xlabel="frequency [Hz]")
        phase.legend(*gain.get_legend_handles_labels(), loc="lower left", ncols=3, handlelength=1.2)
        bandwidth = SCALARS["bandwidth"].si_value
        for axis in (gain, phase):
            axis.axvline(bandwidth, color=GREY, linewidth=1.0, linestyle=(0, (4, 3)), zorder=0)
        foot, look = ("data", "axes fraction"), {"ha": "right", "va": "bottom", "color": GREY}
        label_point(gain, "published bandwidth", (bandwidth, 0.0), (-4, 4), xycoords=foot, **look)
    axes[0].set(xscale="log", yscale="log", ylabel="gain [mm/s per rad/s]")
    axes[2].set_xticks([1.0, 2.0, 5.0, 10.0, 20.0, 40.0], ["1", "2", "5", "10", "20", "40"])
    axes[2].xaxis.minorticks_off()
    axes[2].set(ylim=(-190.0, 20.0), ylabel="phase [degree]")
    return figure


def _draw_refits(tables: Tables) -> Figure:
    """Draw steady points with the refitted and the published laws, as Figures 8 and 9 do.

    Lost flow against pressure on the left, friction against velocity on the right.
    """
    title = "Leakage and friction refitted from steady points"
    figure, (left, right) = panels(title, 1, 2, 4.2, Margins(left=0.7, top=0.65, across=0.8))
    leakage, friction = tables["figure 8 leakage points"], tables["figure 9 friction points"]
    top = float(leakage["differential_pressure_pa"].max())
    pressure = np.linspace(0.0, 1.05 * top, 50)
    speed = np.linspace(0.0, 1.05 * float(friction["velocity_m_s"].max()), 100)

    def flow_law(laws: pd.Series) -> np.ndarray:
        return LITRES_A_MINUTE * (laws["leakage_coefficient"] * pressure + laws["flow_bias"])

    def friction_law(laws: pd.Series) -> np.ndarray:
        return laws["friction_quadratic"] * speed**2 + laws["friction_linear"] * speed + laws["friction_coulomb"]

    _draw_law(left, tables["figure 8 leakage flow refitted"], MEGA * pressure, flow_law)
    _draw_law(right, tables["figure 9 friction refitted"], speed, friction_law)
    for level, marker in MARKERS.items():
        points, forces = (table[table["level"] == level] for table in (leakage, friction))
        flow = LITRES_A_MINUTE * points["lost_flow_m3_s"]
        for axis, across, up, fault in (
            (left, MEGA * points["differential_pressure_pa"], flow, "leakage"),
            (right, forces["velocity_m_s"], forces["friction_n"], "friction"),
        ):
            label = f"{fault}: {LEVEL_WORDS[level]}"
            (marks,) = axis.plot(across, up, marker, color=LEVEL_COLOURS[level], markersize=4.5, label=label)
            marks.set(markeredgecolor=BLACK, markeredgewidth=0.4)
    left.set(xlabel="differential pressure [MPa]", ylabel="flow that is lost [L/min]", ylim=(0.0, None))
    right.set(xlabel="velocity [m/s]", ylabel="friction [N]", ylim=(0.0, 1.1 * float(friction["friction_n"].max())))
    for axis, number in ((left, 8), (right, 9)):
        axis.plot([], [], color=GREY, linewidth=1.3, label="refitted")
        axis.plot([], [], color=BLACK, linewidth=1.0, linestyle=(0, (1, 2)), label="published")
        axis.set(title=f"Figure {number}")
        axis.legend(loc="upper left")
    return figure


def _draw_law(axis: Axes, refit: pd.DataFrame, across: np.ndarray, law: Callable[[pd.Series], np.ndarray]) -> None:
    for level, rows in refit.groupby("level", sort=False):
        by_name = rows.set_index("coefficient")
        axis.plot(across, law(by_name["refitted"]), color=LEVEL_COLOURS[str(level)])
        axis.plot(across, law(by_name["published"]), color=BLACK, linewidth=1.0, linestyle=(0, (1, 2)), zorder=3)


def _draw_validation_input(tables: Tables) -> Figure:
    """Draw the nine steps of section 6, as Figure 10 does."""
    steps = tables["figure 10 validation input"]
    title = "The validation input: nine steps of 2.5 V to 4 V in alternating direction"
    figure, (axis,) = panels(title, 1, 1, 2.8, Margins(left=0.7))
    axis.step(steps["time_s"], steps["motor_voltage_v"], where="post", color=BLUE)
    for level in (-4.0, -2.5, 2.5, 4.0):
        axis.axhline(level, color=GREY, linewidth=0.8, linestyle=(0, (4, 3)), zorder=0)
    axis.set(yticks=[-4.0, -2.5, 0.0, 2.5, 4.0], xlim=(0.0, float(steps["time_s"].max())))
    axis.set(xlabel="time [s]", ylabel="motor voltage [V]")
    return figure


CIRCUIT_FIGURES: Drawings = {
    "figures_3_and_4": _draw_throttles,
    "figures_5_and_6": _draw_responses,
    "figure_7": lambda tables: draw_order(tables["figure 7 singular values"]),
    "figures_8_and_9": _draw_refits,
    "figure_10": _draw_validation_input,
    "figure_11": draw_bulk_modulus,
}
