"""Section 3: each condition's steady state at 4 V, beside the levels' published definitions (errata E7)."""

from collections.abc import Mapping

import pandas as pd
from matplotlib.figure import Figure

from experiments.page.drawing import draw_published, label_point
from experiments.page.style import BESIDE_CONDITIONS, BLUE, condition_levels, panels
from experiments.published import SCALARS

DEFINED: Mapping[str, Mapping[str, str]] = {
    "velocity": {"minor_leakage": "minor_leakage_velocity", "major_leakage": "major_leakage_velocity"},
    "pressure": {"minor_friction": "minor_friction_pressure", "major_friction": "major_friction_pressure"},
}
"""By quantity, then condition: the published scalar that defines the condition."""


def draw_definitions(conditions: pd.DataFrame) -> Figure:
    """Draw steady velocity and pressure of every condition, with the published definitions.

    Returns
    -------
    Figure
        Velocity on the left, differential pressure on the right, both in percent of normal.
    """
    title = "Steady state at 4 V: what Tables 3 and 4 give, and how section 3 defines the levels"
    figure, axes = panels(title, 1, 2, 3.9, BESIDE_CONDITIONS, sharey=True)
    words = {"velocity": "steady velocity", "pressure": "steady differential pressure"}
    for axis, quantity in zip(axes, words, strict=True):
        level = condition_levels(axis, conditions["condition"])
        heights = dict(zip(conditions["condition"], level, strict=True))
        ours = conditions[f"{quantity}_percent_of_normal"]
        axis.barh(level, ours, height=0.62, color=BLUE)
        for height, value in zip(level, ours, strict=True):
            label_point(axis, f"{value:.0f}", (0.0, height), (4, 0), va="center", color="white")
        for name, scalar in DEFINED[quantity].items():
            draw_published(axis, 100.0 * SCALARS[scalar].si_value, heights[name])
        draw_published(axis, [], [], "published definition")
        axis.set(xlim=(0.0, 1.05 * float(ours.max())), xlabel=f"{words[quantity]} [% of normal]")
    axes[1].legend(loc="lower right")
    return figure
