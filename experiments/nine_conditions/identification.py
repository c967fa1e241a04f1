"""Section 4: frequency responses, the order test, and gains beside the range that Table 6 allows."""

from collections.abc import Mapping

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator, NullFormatter

from estimation.finding import NORMAL_95
from experiments.page.drawing import label_point
from experiments.page.style import BESIDE_CONDITIONS, BLUE, GREY, ORANGE, VERMILION, Margins, condition_levels, panels

MILLI = 1e3

LEAST_COHERENCE = 0.3
"""Coherence below which the empirical phase carries no information and is not drawn."""

LEVEL_WORDS = {"none": "normal", "minor": "minor", "major": "major"}
LEVEL_COLOURS = {"none": BLUE, "minor": ORANGE, "major": VERMILION}


def draw_bode(responses: pd.DataFrame, conditions: pd.DataFrame) -> Figure:
    """Draw the nine transfer functions over the empirical frequency responses, as Figures 5 and 6 do.

    Returns
    -------
    Figure
        Gain above, phase below, one column for each leakage level.
    """
    title = "Frequency response from motor speed to velocity: fitted (thick), empirical (thin)"
    figure, axes = panels(title, 2, 3, 5.6, Margins(left=0.7, down=0.2), sharex=True, sharey="row")
    by_condition: Mapping[str, pd.DataFrame] = {str(k): rows for k, rows in responses.groupby("condition", sort=False)}
    for column, leakage in enumerate(LEVEL_WORDS):
        gain, phase = axes[column], axes[column + 3]
        for row in conditions[conditions["leakage"] == leakage].itertuples():
            _response(gain, phase, by_condition[str(row.condition)], str(row.friction))
        gain.set(title=f"leakage: {LEVEL_WORDS[leakage]}")
        phase.set(xlabel="frequency [Hz]")
    for level, colour in LEVEL_COLOURS.items():
        axes[0].plot([], [], color=colour, linewidth=2.0, label=f"friction: {LEVEL_WORDS[level]}")
    axes[0].legend(loc="lower left")
    axes[0].set(ylabel="gain [mm/s per rad/s]", xscale="log", yscale="log", ylim=(3e-4, 1.0))
    phase = axes[3]
    phase.set(ylabel="phase [degree]", ylim=(-180.0, 90.0), yticks=[-180.0, -135.0, -90.0, -45.0, 0.0, 45.0, 90.0])
    phase.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    phase.xaxis.set_minor_formatter(NullFormatter())
    return figure


def _response(gain: Axes, phase: Axes, rows: pd.DataFrame, friction: str) -> None:
    colour = LEVEL_COLOURS[friction]
    for source, width, alpha in (("etfe", 0.8, 0.45), ("model", 2.0, 1.0)):
        curve = rows[rows["source"] == source]
        sure = curve["coherence"] >= LEAST_COHERENCE
        wrapped = (curve["phase_deg"] + 180.0) % 360.0 - 180.0
        steady = sure & (wrapped.diff().abs().fillna(0.0) < 180.0)
        gain.plot(curve["frequency_hz"], MILLI * curve["gain"], color=colour, linewidth=width, alpha=alpha)
        phase.plot(curve["frequency_hz"], wrapped.where(steady), color=colour, linewidth=width, alpha=alpha)


def draw_order(order: pd.DataFrame) -> Figure:
    """Draw singular values with their noise floor, as Figure 7 does.

    Returns
    -------
    Figure
        Two panels: of the impulse response, and of the projected data.
    """
    figure, axes = panels("Singular values of the normal condition", 1, 2, 3.4, Margins(left=0.8, top=0.6, across=0.85))
    shown = (("hankel", "Hankel matrix of the impulse response"), ("projected", "projected data matrix"))
    for axis, (name, words) in zip(axes, shown, strict=True):
        floor = float(order[f"{name}_floor"].iloc[0])
        above = order[name] > floor
        axis.vlines(order["index"], 0.3 * float(order[name].min()), order[name], color="#d0d0d0", linewidth=1.5)
        axis.plot(order.loc[above, "index"], order.loc[above, name], "o", color=BLUE)
        axis.plot(order.loc[~above, "index"], order.loc[~above, name], "o", color=GREY, markerfacecolor="white")
        axis.axhline(floor, color=VERMILION, linewidth=1.2)
        last = float(order["index"].max())
        label_point(axis, "noise floor", (last + 0.6, floor), (0, -4), color=VERMILION, ha="right", va="top")
        axis.set(yscale="log", ylim=(0.5 * min(floor, float(order[name].min())), None), xlim=(0.4, last + 0.6))
        axis.xaxis.set_major_locator(MaxNLocator(integer=True))
        axis.set(title=f"{words}: {int(above.sum())} above the noise", xlabel="index [count]")
    axes[0].set(ylabel="singular value [m/s per rad/s]")
    axes[1].set(ylabel="singular value [normalised]")
    return figure


def draw_gains(models: pd.DataFrame) -> Figure:
    """Draw steady gains with their intervals over the ranges allowed by the rounding of Table 6 (errata E14)."""
    figure, (axis,) = panels("Steady gain from motor speed to velocity", 1, 1, 3.9, BESIDE_CONDITIONS)
    level = condition_levels(axis, models["condition"])
    low, high = (MILLI * models[f"published_dc_gain_{end}"] for end in ("low", "high"))
    axis.hlines(level - 0.16, low, high, color=ORANGE, linewidth=5.0, label="Table 6: what its four digits leave open")
    gain, reach = MILLI * models["dc_gain"], NORMAL_95 * MILLI * models["dc_gain_std"]
    axis.errorbar(
        gain, level + 0.16, None, reach, "o", markersize=4, capsize=2, color=BLUE, label="ours, with 95 % interval"
    )
    axis.set(xlim=(0.0, None), xlabel="steady gain [mm/s per rad/s]")
    axis.legend(loc="lower right")
    return figure
