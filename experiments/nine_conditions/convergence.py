"""Figure 11: bulk modulus from many first guesses over time, nine conditions side by side."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullLocator

from experiments.nine_conditions.bulk_modulus import POSITION_STEPS, PRESSURE_STEPS, PUBLISHED_METHOD, Experiment
from experiments.page.drawing import label_point
from experiments.page.style import BLACK, BLUE, SKY, VERMILION, Margins, panels
from experiments.page.words import condition_in_words

MEGA = 1e6
"""Bulk modulus is drawn in MPa, as in the text and tables; Figure 11 uses units of 1e8 Pa."""

GUESS_COLOURS = LinearSegmentedColormap.from_list("guesses", [BLUE, SKY, VERMILION])
"""Colours from the lowest first guess to the highest."""

TOP = 600.0
"""Upper end of the axis [MPa]; Figure 11 ends at 500."""


TITLES: Mapping[Experiment, str] = {
    PRESSURE_STEPS: "Pressure form, plant that sticks, nine steps, differential pressure logged",
    POSITION_STEPS: "Pressure form, plant that sticks, nine steps, position and velocity alone",
    PUBLISHED_METHOD: "Acceleration form (the published one), plant without sticking, 10 Hz sine",
}


def draw_convergence(shown: Experiment, curves: pd.DataFrame, truth_pa: float) -> Figure:
    """Draw the estimates of one experiment over time, from every first guess, with one panel for each condition.

    Parameters
    ----------
    shown : Experiment
        One of `TITLES`.
    curves : pandas.DataFrame
        The series ``convergence``.
    truth_pa : float
        Simulated bulk modulus [Pa].

    Returns
    -------
    Figure
        Nine panels with a common logarithmic time axis.
    """
    chosen = curves[np.logical_and.reduce([curves[name] == value for name, value in shown._asdict().items()])]
    figure, axes = panels(TITLES[shown], 3, 3, 6.4, Margins(), sharex=True, sharey=True)
    guesses = sorted(chosen["start_pa"].unique())
    colours = {guess: GUESS_COLOURS(place / max(1, len(guesses) - 1)) for place, guess in enumerate(guesses)}
    first_tick = float(chosen.loc[chosen["time_s"] > 0.0, "time_s"].min())
    last = float(chosen["time_s"].max())
    for axis, (condition, rows) in zip(axes, chosen.groupby("condition", sort=False), strict=False):
        _panel(axis, rows, colours, truth_pa)
        axis.set(title=condition_in_words(str(condition)))
    _time_axis(axes[0], first_tick, last)
    figure.supxlabel(f"time [s], logarithmic after the first {1e3 * first_tick:g} ms", fontsize=9, y=0.01)
    figure.supylabel("effective bulk modulus [MPa]", fontsize=9, x=0.005)
    truth = truth_pa / MEGA
    label_point(axes[0], f"truth {truth:.0f}", (last, truth), (0, 4), ha="right")
    label_point(axes[0], "first guesses", (0.0, TOP), (6, -6), va="top", fontsize=8)
    return figure


def _panel(axis: Axes, rows: pd.DataFrame, colours: Mapping[float, object], truth_pa: float) -> None:
    for guess, curve in rows.groupby("start_pa", sort=True):
        value = curve["bulk_modulus_pa"] / MEGA
        colour = colours[float(str(guess))]
        axis.plot(curve["time_s"], value, color=colour, linewidth=1.2)
        axis.plot(curve["time_s"].iloc[:1], value.iloc[:1], "o", color=colour, markersize=4, clip_on=False, zorder=5)
    axis.axhline(truth_pa / MEGA, color=BLACK, linewidth=1.0, linestyle=(0, (4, 3)), zorder=4)


def _time_axis(axis: Axes, first_tick: float, last: float) -> None:
    axis.set_xscale("symlog", linthresh=first_tick, linscale=0.6)
    decades = [tick for tick in (1e-4, 1e-3, 0.01, 0.1, 1.0, 10.0, 100.0) if first_tick <= tick <= 1.05 * last]
    axis.set(xlim=(0.0, 1.05 * last), xticks=[0.0, *decades])
    axis.xaxis.set_minor_locator(NullLocator())
    axis.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set(ylim=(0.0, TOP))
