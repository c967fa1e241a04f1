"""Figures of velocity from sensing voltages on the simulated diaphragm motor, and of its spectra.

They read the tables of `hydrostate motor-paper`, and compute nothing.
"""

from matplotlib.figure import Figure

from experiments.page.drawing import draw_paired_bars, with_colours
from experiments.page.figure_files import Drawings
from experiments.page.frames import Tables
from experiments.page.style import BLUE, GREY, ORANGE, VERMILION, Margins, panels

MILLI = 1e3

SHOWN = ("A3, A4, A5, as the paper wants", "A4 and drive voltage")


def _draw_velocity(tables: Tables) -> Figure:
    """Draw velocity fitted from sensing voltages over the motor's true velocity."""
    title = "Velocity from sensing voltages, thirty drives and loads at 480 Hz"
    figure, axes = panels(title, 1, 2, 3.9, Margins(left=0.65, top=0.75, across=0.5), sharey=True)
    rows = tables["sensing predictions"]
    most = MILLI * float(rows["velocity_m_s"].max())
    for axis, words in zip(axes, SHOWN, strict=True):
        for swing, part, colour in with_colours(rows[rows["regressors"] == words].groupby("peak_to_peak_v")):
            fitted = MILLI * part["fitted_m_s"]
            axis.plot(MILLI * part["velocity_m_s"], fitted, "o", color=colour, label=f"{swing:g} V")
        axis.plot([0.0, most], [0.0, most], color=GREY, linewidth=0.9)
        axis.set(title=words, xlabel="velocity [mm/s]")
    axes[0].set(ylabel="fitted velocity [mm/s]")
    axes[1].legend(loc="upper left", title="drive, peak to peak")
    return figure


def _draw_faults(tables: Tables) -> Figure:
    """Draw the errors of the regressions when one part fails. One pair of bars for each fault."""
    table = tables["sensing faults"].iloc[::-1]
    title = "What a regression fitted to the healthy motor says of a faulty one, less its velocity (200 V, 10 N)"
    figure, (axis,) = panels(title, 1, 1, 3.4, Margins(left=2.3, top=0.45))
    pairs = [(words, MILLI * table[words], colour) for words, colour in zip(SHOWN, (VERMILION, BLUE), strict=True)]
    draw_paired_bars(axis, table["fault"].tolist(), pairs)
    axis.axvline(MILLI * float(table["velocity_m_s"].iloc[-1]), color=ORANGE, linewidth=1.0, label="velocity itself")
    axis.set(xlabel="error of velocity [mm/s]")
    axis.legend(loc="lower left")
    return figure


def _draw_spectra(tables: Tables) -> Figure:
    """Draw the harmonics of the motor's signals at 200 V, as Figure 21 does."""
    rows = tables["motor spectra"]
    rows = rows[(rows["peak_to_peak_v"] == 200.0) & (rows["harmonic"] > 0)]
    groups = list(rows.groupby("signal", sort=False))
    title = "Harmonics of 480 Hz at 200 V peak to peak, without load"
    figure, axes = panels(title, 1, len(groups), 3.4, Margins(left=0.65, top=0.75, across=0.2), sharey=True)
    for axis, (name, part) in zip(axes, groups, strict=True):
        axis.bar(part["harmonic"], part["relative_percent"], 0.7, color=BLUE)
        axis.set(title=str(name).split(" [")[0], xlabel="harmonic", xticks=[1, 3, 5, 7, 9])
        axis.set(yscale="log", ylim=(1e-3, 200.0))
    axes[0].set(ylabel="% of the first")
    return figure


SENSING_FIGURES: Drawings = {"sensing": _draw_velocity, "sensing_faults": _draw_faults, "spectra": _draw_spectra}
