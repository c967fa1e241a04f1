"""Every estimate with its interval; and the published form beside ours on a plant with stick-slip friction."""

from collections.abc import Callable, Mapping, Sequence

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.nine_conditions.convergence import MEGA
from experiments.nine_conditions.findings import by_experiment, experiment_in_words
from experiments.page.drawing import label_point
from experiments.page.style import (
    BESIDE_CONDITIONS,
    BLACK,
    BLUE,
    GREY,
    VERMILION,
    Margins,
    condition_rows,
    panels,
    spread_offsets,
)
from experiments.page.tables import Row

NARROW = 0.035
"""Half-width of the axis of estimates, as a fraction of the truth."""


def draw_estimates(estimates: pd.DataFrame, truth_pa: float) -> Figure:
    """Draw every estimate with its 95 % interval, one panel for each experiment, one row for each condition.

    Parameters
    ----------
    estimates : pandas.DataFrame
        The table ``bulk_modulus``.
    truth_pa : float
        Simulated bulk modulus [Pa].

    Returns
    -------
    Figure
        One panel for each experiment. Estimates that are not observable or lie off the axis are given as text.
    """
    groups = list(by_experiment(estimates))
    count = (len(groups) + 2) // 3
    margins = Margins(left=2.0, top=0.75, down=0.85)
    figure, axes = panels("Estimates of bulk modulus with 95 % intervals", count, 3, 3.6 * count, margins, sharey=True)
    conditions = list(dict.fromkeys(estimates["condition"]))
    for axis, (key, rows) in zip(axes, groups, strict=False):
        heights = condition_rows(axis, conditions)
        form_words, plant_words, rest = experiment_in_words(key).split(", ", 2)
        axis.set(title=f"{form_words}, {plant_words},\n{rest}")
        _experiment(axis, rows, heights, truth_pa)
    for axis in axes[len(groups) :]:
        axis.set_visible(False)
    return figure


def _experiment(axis: Axes, rows: pd.DataFrame, heights: Mapping[str, float], truth_pa: float) -> None:
    truth = truth_pa / MEGA
    low, high = truth * (1.0 - NARROW), truth * (1.0 + NARROW)
    axis.axvspan(truth * 0.99, truth * 1.01, color="#eef4f8", zorder=0)
    axis.axvline(truth, color=BLACK, linewidth=1.0, linestyle=(0, (4, 3)))
    axis.set(xlim=(low, high), xlabel="effective bulk modulus [MPa]")
    for condition, found in rows.groupby("condition", sort=False):
        height = heights[str(condition)]
        values = found.dropna(subset=["value_pa"])
        inside = values[(values["value_pa"] / MEGA).between(low, high)]
        if len(values) == 0:
            _hatched_note(axis, height, truth, str(found["outcome"].iloc[0]).replace("_", " "))
        elif len(inside) == 0:
            errors = dict.fromkeys(f"{error:.0f} %" for error in sorted(values["error_percent"]))
            _hatched_note(
                axis, height, truth, f"off the axis: {' to '.join([*errors][:1] + [*errors][1:][-1:])}", VERMILION
            )
        draw_intervals(axis, inside, height, 2.6, lambda row: BLUE if row["gate_passed"] else VERMILION)


def draw_intervals(axis: Axes, rows: pd.DataFrame, height: float, size: float, colour: Callable[[Row], str]) -> None:
    """Draw estimates with their 95 % intervals around one height.

    Parameters
    ----------
    axis : Axes
        Axes to draw on; the horizontal axis is bulk modulus [MPa].
    height : float
        Vertical position of the centre of the marks [count].
    size : float
        Marker size in points [unit of fonts].
    colour : callable
        Function from an estimate's row to its colour.
    """
    for offset, row in zip(spread_offsets(len(rows), 0.5), rows.to_dict("records"), strict=True):
        centre = row["value_pa"] / MEGA
        reach = 0.5 * (row["ci95_high_pa"] - row["ci95_low_pa"]) / MEGA
        axis.errorbar(centre, height + offset, xerr=reach, fmt="o", markersize=size, linewidth=0.9, color=colour(row))


def _hatched_note(axis: Axes, height: float, centre: float, words: str, colour: str = GREY) -> None:
    axis.axhspan(height - 0.38, height + 0.38, facecolor="none", edgecolor="#d4d4d4", hatch="////", linewidth=0.0)
    box = {"boxstyle": "round,pad=0.2", "facecolor": "white", "edgecolor": "none"}
    axis.text(centre, height, words, ha="center", va="center", fontsize=8, color=colour, bbox=box)


def draw_forms(estimates: pd.DataFrame, truth_pa: float) -> Figure:
    """Draw where both forms settle on the plant with stick-slip friction, under the paper's sine (errata E9).

    Parameters
    ----------
    estimates : pandas.DataFrame
        The table ``bulk_modulus``.
    truth_pa : float
        Simulated bulk modulus [Pa].

    Returns
    -------
    Figure
        One dot for each first guess, one row for each condition.
    """
    sine = estimates[(estimates["plant"] == "lumped") & (estimates["drive"] == "sine")]
    shown: Sequence[tuple[pd.DataFrame, str, str]] = (
        (sine[sine["form"] == "acceleration"], VERMILION, "published acceleration form"),
        (sine[(sine["form"] == "pressure") & sine["pressure_logged"]], BLUE, "pressure form, with pressure"),
    )
    title = "Where two filters settle on a plant that sticks, driven by the 10 Hz sine"
    figure, (axis,) = panels(title, 1, 1, 3.9, BESIDE_CONDITIONS)
    heights = condition_rows(axis, list(dict.fromkeys(sine["condition"])))
    truth = truth_pa / MEGA
    places = ((0.0, 8, "left"), (truth, -8, "right"))
    for (rows, colour, words), (x, shift, side) in zip(shown, places, strict=True):
        for condition, found in rows.groupby("condition", sort=False):
            level = [heights[str(condition)] + offset for offset in spread_offsets(len(found), 0.4)]
            axis.plot(found["filter_settled_at_pa"] / MEGA, level, "o", markersize=4, color=colour, alpha=0.8)
        look = {"color": colour, "ha": side, "fontweight": "bold", "annotation_clip": False}
        label_point(axis, words, (x, len(heights) - 0.45), (shift, 0), **look)
    axis.axvline(truth, color=BLACK, linewidth=1.0, linestyle=(0, (4, 3)), zorder=0)
    label_point(axis, f"truth {truth:.0f}", (truth, -0.5), (5, 0), va="bottom")
    axis.set(ylim=(-0.6, len(heights) - 0.1), xlim=(-0.04, 1.2 * truth))
    axis.set(xlabel="where the filter settles: mean over the last 20 % [MPa]")
    return figure
