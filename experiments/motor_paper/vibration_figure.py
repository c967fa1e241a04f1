"""Figures of the diaphragm-motor paper's linear models: Bode, Nyquist, poles, loop, hysteresis, fractional damping.

They read the tables of `hydrostate motor-paper`, and compute nothing.
"""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.page.drawing import label_point
from experiments.page.figure_files import Drawings
from experiments.page.frames import Tables
from experiments.page.style import BLACK, BLUE, GREEN, GREY, ORANGE, SKY, VERMILION, Margins, panels

MILLI, MICRO = 1e3, 1e6

_MODELS = {
    "equations 1 and 2, signs mended": (BLUE, "-"),
    "equations 1 and 2, as printed": (VERMILION, "--"),
    "equation 4, signs mended": (GREEN, "-"),
}
_CONTROLLERS = {"P": GREY, "PI": BLUE, "PID": ORANGE}
_ORDERS = {0.5: BLUE, 1.0: BLACK, 1.5: VERMILION}


def _bode(gain: Axes, phase: Axes, rows: pd.DataFrame) -> None:
    for name, part in rows.groupby("model", sort=False):
        colour, line = _MODELS.get(str(name), (BLUE, "-"))
        gain.loglog(part["frequency_hz"], part["gain"], line, color=colour, label=str(name))
        phase.semilogx(part["frequency_hz"], part["phase_deg"], line, color=colour)
    gain.set(ylabel="gain over that at rest")
    phase.set(ylabel="phase [°]", xlabel="frequency [Hz]")


def _nyquist(axis: Axes, rows: pd.DataFrame) -> None:
    for name, part in rows.groupby("model", sort=False):
        colour, line = _MODELS.get(str(name), (BLUE, "-"))
        angle = np.radians(part["phase_deg"])
        axis.plot(part["gain"] * np.cos(angle), part["gain"] * np.sin(angle), line, color=colour)
    axis.plot([-1.0], [0.0], "+", color=BLACK, markersize=10)
    axis.set(xlabel="real part", ylabel="imaginary part")


def _draw_bode(tables: Tables) -> Figure:
    """Draw gain and phase from force to displacement, as Figure 22 does. Two panels over one frequency axis."""
    margins = Margins(left=0.75, top=0.45)
    figure, (gain, phase) = panels("From force to displacement", 2, 1, 5.2, margins, sharex=True)
    _bode(gain, phase, tables["vibration responses"])
    gain.axvline(480.0, color=GREY, linewidth=0.8)
    gain.set(ylim=(1e-4, 50.0))
    gain.legend(loc="lower left")
    return figure


def _draw_poles(tables: Tables) -> Figure:
    """Draw poles and the Nyquist curve, as Figures 23 and 24 do.

    Slow poles on the left, Nyquist's curves on the right.
    """
    title = "Poles, and Nyquist's curves of the models with a gain of 1 at rest"
    figure, (left, right) = panels(title, 1, 2, 4.2, Margins(left=0.75, top=0.55, across=0.8))
    for name, part in tables["poles"].groupby("model", sort=False):
        if str(name) in _MODELS:
            first = part.sort_values("frequency_hz").iloc[0]
            both = np.array([first["imaginary_rad_s"], -first["imaginary_rad_s"]]) / MILLI
            short = str(name).removeprefix("equations ").removeprefix("equation ")
            left.plot([first["real_rad_s"]] * 2, both, "x", color=_MODELS[str(name)][0], markersize=8, label=short)
    left.axvline(0.0, color=BLACK, linewidth=0.8)
    left.set(xlabel="real part [1/s]; right of zero is unstable", ylabel="imaginary part [1000 rad/s]")
    left.set(xlim=(-450.0, 450.0), ylim=(-6.5, 6.5))
    left.legend(loc="center left", fontsize=8.0)
    _nyquist(right, tables["vibration responses"].query("frequency_hz < 2000"))
    label_point(right, "-1", (-1.0, 0.0), (4, 4))
    right.set(xlim=(-6.0, 6.0), ylim=(-6.0, 6.0))
    return figure


def _draw_loop(tables: Tables) -> Figure:
    """Draw the step under P, PI and PID, and the spectrum of their commands, as Figures 19 and 20 do.

    Displacement on the left, spectra on the right.
    """
    title = "A step under three controllers, with noise and a delay of 50 µs"
    figure, (left, right) = panels(title, 1, 2, 3.8, Margins(left=0.65, across=0.8))
    for name, run in tables["loop runs"].groupby("controller", sort=False):
        colour = _CONTROLLERS[str(name)]
        left.plot(MILLI * run["time_s"], MICRO * run["output_m"], color=colour, label=str(name))
    last = tables["loop runs"].groupby("controller").get_group("P")
    left.plot(MILLI * last["time_s"], MICRO * last["reference_m"], color=BLACK, linewidth=0.8, linestyle=":")
    left.set(xlim=(0.0, 30.0), xlabel="time [ms]", ylabel="displacement [µm]")
    left.legend(loc="center right")
    for name, lines in tables["loop spectra"].groupby("controller", sort=False):
        right.loglog(lines["frequency_hz"], lines["amplitude_n"], color=_CONTROLLERS[str(name)], label=str(name))
    right.set(xlabel="frequency [Hz]", ylabel="amplitude of the force, reference at rest [N]")
    right.legend(loc="upper left")
    return figure


def _draw_hysteresis(tables: Tables) -> Figure:
    """Draw hysteresis loops by both laws, as Figures 27 and 34 do.

    The law with rates on the left, as printed on the right.
    """
    title = "Hysteresis at 100 V: one loop at every frequency, or one that vanishes"
    figure, axes = panels(title, 1, 2, 3.8, Margins(left=0.65, top=0.65, across=0.6), sharey=True)
    loops = tables["hysteresis loops"]
    colours = (BLACK, BLUE, SKY, ORANGE)
    for axis, law, words in zip(axes, ("mended", "printed"), ("equation 21, mended", "as printed"), strict=True):
        groups = loops[loops["law"] == law].groupby("frequency_hz")
        for (frequency, loop), colour, width in zip(groups, colours, (5.0, 3.4, 2.0, 0.9), strict=True):
            label = f"{float(str(frequency)):g} Hz"
            axis.plot(loop["voltage_v"], loop["hysteresis_v"], color=colour, linewidth=width, label=label)
        axis.set(title=words, xlabel="voltage [V]")
        axis.legend(loc="upper left")
    axes[0].set(ylabel="hysteresis h [V]")
    return figure


def _draw_linearised(tables: Tables) -> Figure:
    """Draw Bode, Nyquist and impulse response of the linearised equation 20: Figures 31, 32 and 35."""
    margins = Margins(left=0.75, top=0.5, across=0.8, down=0.55)
    figure, (gain, nyquist, phase, impulse) = panels("Equation 20 for small voltages", 2, 2, 5.6, margins)
    rows = tables["hysteresis response"]
    _bode(gain, phase, rows)
    _nyquist(nyquist, rows)
    moved = tables["impulse response"]
    impulse.plot(MILLI * moved["time_s"], MILLI * moved["displacement_m_per_v_s"], color=BLUE)
    impulse.set(xlabel="time [ms]", ylabel="after 1 V s [mm]")
    return figure


def _draw_fractional(tables: Tables) -> Figure:
    """Draw integrals and derivatives of t², and the resonance with dampers of three orders: Figures 7 to 9."""
    title = "Orders 0.5, 1 and 1.5: lines exact, dots sampled or by Oustaloup's states"
    figure, (left, middle, right) = panels(title, 1, 3, 3.7, Margins(left=0.6, top=0.75, across=0.6))
    for order, rows in tables["figures 7 to 9"].groupby("order"):
        a = float(str(order))
        for axis, column in ((left, "integral"), (middle, "derivative")):
            axis.plot(rows["time_s"], rows[column], color=_ORDERS[a], label=f"a = {a:g}")
            few = rows.iloc[::100]
            axis.plot(few["time_s"], few[f"sampled_{column}"], "o", color=_ORDERS[a], markersize=3.5)
    for order, rows in tables["fractional responses"].groupby("order"):
        a = float(str(order))
        near = rows[rows["frequency_hz"].between(200.0, 900.0)]
        right.plot(near["frequency_hz"], MICRO * near["gain"], color=_ORDERS[a])
        few = near.iloc[::15]
        right.plot(few["frequency_hz"], MICRO * few["imitated_gain"], "o", color=_ORDERS[a], markersize=3.5)
    for axis, head in ((left, "integral of t²"), (middle, "derivative of t²"), (right, "resonance, µm/N")):
        axis.set(title=head, xlabel="time [s]")
    right.set(xlabel="frequency [Hz]")
    left.legend(loc="upper left")
    return figure


VIBRATION_FIGURES: Drawings = {
    "bode": _draw_bode,
    "poles": _draw_poles,
    "loop": _draw_loop,
    "hysteresis_loops": _draw_hysteresis,
    "linearised": _draw_linearised,
    "fractional": _draw_fractional,
}
