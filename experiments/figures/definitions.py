"""Section 3: where each condition settles at 4 V, beside the levels' published definitions (errata E7)."""

from collections.abc import Mapping
from types import MappingProxyType

import pandas as pd
from matplotlib.figure import Figure

from experiments.figures.style import BESIDE_CONDITIONS, BLUE, ORANGE, condition_rows, panels
from experiments.published import SCALARS

DEFINED: Mapping[str, Mapping[str, str]] = MappingProxyType(
    {
        "velocity": {"minor_leakage": "minor_leakage_velocity", "major_leakage": "major_leakage_velocity"},
        "pressure": {"minor_friction": "minor_friction_pressure", "major_friction": "major_friction_pressure"},
    }
)
"""By quantity, then condition: the published scalar that defines it."""


def draw_definitions(conditions: pd.DataFrame) -> Figure:
    """Draw steady velocity and pressure of every condition, with the published definitions.

    Parameters
    ----------
    conditions : pandas.DataFrame
        The table ``conditions``.

    Returns
    -------
    Figure
        Velocity on the left, differential pressure on the right, both in percent of normal.
    """
    title = "Steady state at 4 V: what Tables 3 and 4 give, and how section 3 defines the levels"
    figure, axes = panels(title, 1, 2, 3.9, BESIDE_CONDITIONS, sharey=True)
    words = {"velocity": "steady velocity", "pressure": "steady differential pressure"}
    for axis, quantity in zip(axes, words, strict=True):
        heights = condition_rows(axis, list(conditions["condition"]))
        level = [heights[name] for name in conditions["condition"]]
        ours = conditions[f"{quantity}_percent_of_normal"]
        axis.barh(level, ours, height=0.62, color=BLUE)
        for height, value in zip(level, ours, strict=True):
            axis.annotate(f"{value:.0f}", (0.0, height), (4, 0), textcoords="offset points", va="center", color="white")
        for name, scalar in DEFINED[quantity].items():
            published = 100.0 * SCALARS[scalar].si_value
            axis.plot(published, heights[name], "D", color=ORANGE, markeredgecolor="black", markersize=7)
        axis.plot([], [], "D", color=ORANGE, markeredgecolor="black", markersize=7, label="published definition")
        axis.set_xlim(0.0, 1.05 * float(ours.max()))
        axis.set_xlabel(f"{words[quantity]} [% of normal]")
    axes[1].legend(loc="lower right")
    return figure
