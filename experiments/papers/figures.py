"""Figures of the diaphragm-motor paper that show its tables and that no other study draws. They compute nothing."""

import matplotlib.ticker as ticker
import numpy as np
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from experiments.page.figure_files import Drawings
from experiments.page.frames import Tables
from experiments.page.style import BLUE, VERMILION, Margins, panels

RISING = LinearSegmentedColormap.from_list("rising", (VERMILION, "#f7f7f7", BLUE))
"""Colours from negative through zero to positive."""


def _draw_table_4(tables: Tables) -> Figure:
    """Draw flow and displacement of Table 4 over frequency, with its errors: Figures 36, 37, 49 and 50."""
    margins = Margins(left=0.75, top=0.5, across=0.8, down=0.55)
    figure, (flow, stroke, error, both) = panels("Table 4 of the diaphragm-motor paper", 2, 2, 5.6, margins)
    rows = tables["table 4"]
    frequency = rows["frequency_hz"]
    flow.plot(frequency, rows["theory_ml_per_min"], color=BLUE, label="theory, computed anew")
    flow.plot(frequency, rows["flowmeter_ml_per_min"], "o", color=BLUE, label="flow meter, as printed")
    flow.set(xlabel="frequency [Hz]", ylabel="flow [mL/min]")
    flow.legend()
    stroke.plot(frequency, rows["pumping_displacement_mm"], "o-", color=BLUE)
    stroke.set(xlabel="frequency [Hz]", ylabel="displacement [µm]")
    error.plot(frequency, rows["error_by_flowmeter_percent"], color=BLUE, label="computed anew")
    error.plot(frequency, rows["error_percent"], "o", color=BLUE, label="as printed")
    error.set(xlabel="frequency [Hz]", ylabel="error [%]")
    error.legend()
    both.plot(rows["pumping_displacement_mm"], rows["flowmeter_ml_per_min"], "o-", color=BLUE)
    both.set(xlabel="displacement [µm]", ylabel="flow [mL/min]")
    return figure


def _draw_table_5(tables: Tables) -> Figure:
    """Draw velocity and force of Table 5's actuators over their working frequency: Figure 46."""
    margins = Margins(left=0.75, top=0.5, across=0.8)
    figure, (speed, force) = panels("Table 5 of the diaphragm-motor paper: six actuators", 1, 2, 3.6, margins)
    rows = tables["table 5"]
    for axis, column, label in (
        (speed, "no_load_velocity_mm_per_s", "no-load velocity [mm/s]"),
        (force, "blocking_force_n", "blocking force [N]"),
    ):
        axis.plot(rows["frequency_hz"], rows[column], "o", color=BLUE)
        axis.set(xlabel="working frequency [Hz]", ylabel=label)
    return figure


def _draw_modes(tables: Tables) -> Figure:
    """Draw the frequencies of the dry plate's first six modes: Figure 44."""
    figure, (axis,) = panels("First six modes of the dry plate", 1, 1, 3.6, Margins(left=0.75, top=0.5))
    rows = tables["dry modes"]
    axis.plot(range(1, len(rows) + 1), 1e-3 * rows["frequency_hz"], "o-", color=BLUE)
    axis.xaxis.set_major_locator(ticker.MaxNLocator(integer=True))
    axis.set(xlabel="mode", ylabel="frequency [kHz]")
    return figure


def _draw_bent_plate(tables: Tables) -> Figure:
    """Draw the deflection of the diaphragm under a voltage and under a pressure: Figure 42."""
    figure, (axis,) = panels("Deflection of the dry diaphragm along a radius", 1, 1, 3.6, Margins(left=0.75, top=0.5))
    rows = tables["bent plate"]
    axis.plot(1e3 * rows["radius_m"], 1e6 * rows["at_100_v_m"], color=BLUE, label="100 V, no pressure")
    axis.plot(1e3 * rows["radius_m"], 1e6 * rows["at_10_kpa_m"], "--", color=VERMILION, label="10 kPa, no voltage")
    axis.set(xlabel="distance from the centre [mm]", ylabel="deflection [µm]")
    axis.legend()
    return figure


def _draw_mode_shapes(tables: Tables) -> Figure:
    """Draw the shapes of the dry plate's first six modes: Figure 43."""
    margins = Margins(left=0.3, top=0.75, across=0.4, down=0.5, bottom=0.2)
    figure, axes = panels(
        "Shapes of the dry plate's first six modes: blue rises while orange falls", 2, 3, 5.4, margins
    )
    for axis, (number, rows) in zip(axes, tables["mode shapes"].groupby("mode"), strict=True):
        radius, angle = rows["share_of_radius"], rows["angle_rad"]
        across, up = radius * np.cos(angle), radius * np.sin(angle)
        axis.tricontourf(across, up, rows["shape"], levels=np.linspace(-1.0, 1.0, 15), cmap=RISING)
        axis.set(aspect="equal", title=f"mode {number}: {1e-3 * rows['frequency_hz'].iloc[0]:.1f} kHz")
        axis.set_axis_off()
    return figure


def _draw_poles(tables: Tables) -> Figure:
    """Draw the poles of equation 20 for small voltages; it has no zeros: Figure 33."""
    figure, (axis,) = panels("Poles of equation 20 for small voltages", 1, 1, 3.6, Margins(left=0.75, top=0.5))
    poles = tables["poles"]
    rows = poles[poles["model"] == "equation 20, small voltages"]
    for sign in (1.0, -1.0):
        axis.plot(rows["real_rad_s"], sign * 1e-3 * rows["imaginary_rad_s"], "x", color=BLUE)
    axis.axvline(0.0, color="grey", linewidth=1.0)
    axis.set(xlabel="real part [rad/s]", ylabel="imaginary part [10³ rad/s]")
    return figure


PAPERS_FIGURES: Drawings = {
    "table_4": _draw_table_4,
    "table_5": _draw_table_5,
    "bent_plate": _draw_bent_plate,
    "mode_shapes": _draw_mode_shapes,
    "dry_modes": _draw_modes,
    "poles": _draw_poles,
}
"""Figures by name."""
