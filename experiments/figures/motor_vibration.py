"""Figures of the diaphragm-motor paper's linear models: Bode, Nyquist, poles, loop, hysteresis, fractional damping.

They read the tables of `hydrostate motor-paper`, and compute nothing.
"""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.figures.style import BLACK, BLUE, GREEN, GREY, ORANGE, SKY, VERMILION, Margins, panels
from experiments.figures.tables import TableFigure, Tables

MILLI, MICRO = 1e3, 1e6

_MODELS = MappingProxyType(
    {
        "equations 1 and 2, signs mended": (BLUE, "-"),
        "equations 1 and 2, as printed": (VERMILION, "--"),
        "equation 4, signs mended": (GREEN, "-"),
    }
)
_CONTROLLERS = MappingProxyType({"P": GREY, "PI": BLUE, "PID": ORANGE})
_ORDERS = MappingProxyType({0.5: BLUE, 1.0: BLACK, 1.5: VERMILION})


def _bode(gain: Axes, phase: Axes, rows: pd.DataFrame) -> None:
    for name, part in rows.groupby("model", sort=False):
        colour, line = _MODELS.get(str(name), (BLUE, "-"))
        gain.loglog(part["frequency_hz"], part["gain"], line, color=colour, label=str(name))
        phase.semilogx(part["frequency_hz"], part["phase_deg"], line, color=colour)
    gain.set_ylabel("gain over that at rest")
    phase.set_ylabel("phase [°]")
    phase.set_xlabel("frequency [Hz]")


def draw_bode(tables: Tables) -> Figure:
    """Draw gain and phase from force to displacement, as Figure 22 does.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        The study's tables.

    Returns
    -------
    Figure
        Two panels over one frequency axis.
    """
    margins = Margins(left=0.75, top=0.45)
    figure, (gain, phase) = panels("From force to displacement", 2, 1, 5.2, margins, sharex=True)
    _bode(gain, phase, tables["vibration responses"])
    gain.axvline(480.0, color=GREY, linewidth=0.8)
    gain.set_ylim(1e-4, 50.0)
    gain.legend(loc="lower left")
    return figure


def draw_poles(tables: Tables) -> Figure:
    """Draw poles and the Nyquist curve, as Figures 23 and 24 do.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        The study's tables.

    Returns
    -------
    Figure
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
    left.set_xlim(-450.0, 450.0)
    left.set_xlabel("real part [1/s]; right of zero is unstable")
    left.set_ylabel("imaginary part [1000 rad/s]")
    left.set_ylim(-6.5, 6.5)
    left.legend(loc="center left", fontsize=8.0)
    slow = tables["vibration responses"].query("frequency_hz < 2000")
    for name, part in slow.groupby("model", sort=False):
        colour, line = _MODELS[str(name)]
        angle = np.radians(part["phase_deg"])
        right.plot(part["gain"] * np.cos(angle), part["gain"] * np.sin(angle), line, color=colour)
    right.plot([-1.0], [0.0], "+", color=BLACK, markersize=10)
    right.annotate("-1", (-1.0, 0.0), (4, 4), textcoords="offset points")
    right.set_xlim(-6.0, 6.0)
    right.set_ylim(-6.0, 6.0)
    right.set_xlabel("real part")
    right.set_ylabel("imaginary part")
    return figure


def draw_loop(tables: Tables) -> Figure:
    """Draw the step under P, PI and PID, and the spectrum of what they ask for, as Figures 19 and 20 do.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        The study's tables.

    Returns
    -------
    Figure
        Displacement on the left, spectra on the right.
    """
    title = "A step under three controllers, with noise and a delay of 50 µs"
    figure, (left, right) = panels(title, 1, 2, 3.8, Margins(left=0.65, across=0.8))
    for name, run in tables["loop runs"].groupby("controller", sort=False):
        colour = _CONTROLLERS[str(name)]
        left.plot(MILLI * run["time_s"], MICRO * run["output_m"], color=colour, label=str(name))
    last = tables["loop runs"].groupby("controller").get_group("P")
    left.plot(MILLI * last["time_s"], MICRO * last["reference_m"], color=BLACK, linewidth=0.8, linestyle=":")
    left.set_xlim(0.0, 30.0)
    left.set_xlabel("time [ms]")
    left.set_ylabel("displacement [µm]")
    left.legend(loc="center right")
    for name, lines in tables["loop spectra"].groupby("controller", sort=False):
        right.loglog(lines["frequency_hz"], lines["amplitude_n"], color=_CONTROLLERS[str(name)], label=str(name))
    right.set_xlabel("frequency [Hz]")
    right.set_ylabel("amplitude of the force, reference at rest [N]")
    right.legend(loc="upper left")
    return figure


def draw_hysteresis(tables: Tables) -> Figure:
    """Draw hysteresis loops by both laws, as Figures 27 and 34 do.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        The study's tables.

    Returns
    -------
    Figure
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
        axis.set_title(words, loc="left")
        axis.set_xlabel("voltage [V]")
        axis.legend(loc="upper left")
    axes[0].set_ylabel("hysteresis h [V]")
    return figure


def draw_linearised(tables: Tables) -> Figure:
    """Draw Bode, Nyquist and impulse response of the linearised equation 20: Figures 31, 32 and 35.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        The study's tables.

    Returns
    -------
    Figure
        Four panels.
    """
    margins = Margins(left=0.75, top=0.5, across=0.8, down=0.55)
    figure, (gain, nyquist, phase, impulse) = panels("Equation 20 for small voltages", 2, 2, 5.6, margins)
    rows = tables["hysteresis response"]
    _bode(gain, phase, rows)
    angle = np.radians(rows["phase_deg"])
    nyquist.plot(rows["gain"] * np.cos(angle), rows["gain"] * np.sin(angle), color=BLUE)
    nyquist.plot([-1.0], [0.0], "+", color=BLACK, markersize=10)
    nyquist.set_xlabel("real part")
    nyquist.set_ylabel("imaginary part")
    moved = tables["impulse response"]
    impulse.plot(MILLI * moved["time_s"], MILLI * moved["displacement_m_per_v_s"], color=BLUE)
    impulse.set_xlabel("time [ms]")
    impulse.set_ylabel("after 1 V s [mm]")
    return figure


def draw_fractional(tables: Tables) -> Figure:
    """Draw integrals and derivatives of t², and the resonance with dampers of three orders: Figures 7 to 9.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        The study's tables.

    Returns
    -------
    Figure
        Three panels.
    """
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
        axis.set_title(head, loc="left")
        axis.set_xlabel("time [s]")
    right.set_xlabel("frequency [Hz]")
    left.legend(loc="upper left")
    return figure


VIBRATION_FIGURES: Mapping[str, TableFigure] = MappingProxyType(
    {
        "bode": TableFigure(
            "Figure 22: Bode",
            "The line is at 480 Hz. The sharp mode at 4.5 kHz is the diaphragms' mass on its springs, which equation 1 "
            "does not damp (errata M1).",
            draw_bode,
        ),
        "poles": TableFigure(
            "Figures 23 and 24: Nyquist and poles",
            "Poles of the slow mode; Nyquist's curves up to 2 kHz. With the printed signs two poles lie right of zero, "
            "so the stable diagrams of the paper do not belong to its equations (errata M1, M2, M30).",
            draw_poles,
        ),
        "loop": TableFigure(
            "Figures 19 and 20: the loop",
            "More proportional gain swings at the resonance; the integral leaves no error; the derivative damps, and "
            "pays in noise.",
            draw_loop,
        ),
        "hysteresis_loops": TableFigure(
            "Figures 27 and 34: hysteresis",
            "On the left four loops lie on each other. Printed, the law lacks the rate of the voltage in two terms "
            "(errata M21).",
            draw_hysteresis,
        ),
        "linearised": TableFigure(
            "Figures 31 to 35: equation 20 linearised",
            "For small voltages hysteresis only lowers the gain, by alpha (errata M20).",
            draw_linearised,
        ),
        "fractional": TableFigure(
            "Figures 7 to 9: fractional orders",
            "The paper titles them integrals, equation 6 is the derivative (errata M6). Below order 1 a damper "
            "stiffens as well, above it weighs: the resonance moves.",
            draw_fractional,
        ),
    }
)
"""The figures, by file name."""
