"""Section 6: the nine steps, the predictions of both kinds of model, and their errors beside Table 5."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.page.drawing import label_point
from experiments.page.style import BLACK, BLUE, GREY, VERMILION, Margins, condition_levels, panels
from experiments.page.words import condition_in_words

MILLI = 1e3

BEFORE, AFTER = 0.12, 0.28
"""Time before and after a reversal that the enlargement shows [s]."""

LINES = (
    ("velocity_m_s", "measured", GREY, 1.0),
    ("transfer_function_m_s", "transfer function", VERMILION, 1.3),
    ("mathematical_m_s", "mathematical model", BLUE, 1.3),
)
"""Column, label, colour and width of each velocity."""


def draw_validation_run(runs: pd.DataFrame, condition: str) -> Figure:
    """Draw a validation run: the drive of Figure 10, the velocities, and a reversal enlarged.

    Returns
    -------
    Figure
        Drive above, velocities below, the second reversal enlarged beside them.
    """
    run = runs[runs["condition"] == condition]
    shares = {"width_ratios": [2.1, 1.0], "height_ratios": [1.0, 1.9], "sharex": "col"}
    margins = Margins(left=0.75, across=0.7, down=0.5)
    figure, axes = panels(f"The nine steps, {condition_in_words(condition)}", 2, 2, 5.2, margins, **shares)
    drive, drive_near, velocity, velocity_near = axes
    reversal = _reversal(run)
    near = run[run["time_s"].between(reversal - BEFORE, reversal + AFTER)]
    for axis, rows in ((drive, run), (drive_near, near)):
        axis.plot(rows["time_s"], rows["motor_speed_rad_s"], color=BLACK)
        axis.set(ylabel="motor speed [rad/s]")
    for axis, rows in ((velocity, run), (velocity_near, near)):
        for column, label, colour, width in LINES:
            axis.plot(rows["time_s"], MILLI * rows[column], color=colour, linewidth=width, label=label)
        axis.set(ylabel="velocity [mm/s]", xlabel="time [s]")
    for axis in (drive, velocity):
        axis.axvspan(reversal - BEFORE, reversal + AFTER, color="#f4ead2", zorder=0)
        axis.set(xlim=(float(run["time_s"].iloc[0]), float(run["time_s"].iloc[-1])))
    drive.set(title="drive, as in the paper's Figure 10")
    drive_near.set(title="one reversal, enlarged")
    velocity.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)
    _mark_sticking(velocity_near, near)
    return figure


def _reversal(run: pd.DataFrame) -> float:
    sign = np.sign(run["motor_speed_rad_s"].to_numpy())
    changes = np.flatnonzero(sign[1:] * sign[:-1] < 0)
    place = int(changes[min(1, len(changes) - 1)]) if len(changes) else len(run) // 2
    return float(run["time_s"].iloc[place])


def _mark_sticking(axis: Axes, near: pd.DataFrame) -> None:
    still = near[near["mathematical_m_s"] == 0.0]
    if len(still) > 1:
        middle = 0.5 * (float(still["time_s"].min()) + float(still["time_s"].max()))
        label_point(axis, "sticks", (middle, 0.0), (28, 24), color=BLUE, arrowprops={"arrowstyle": "->", "color": BLUE})


def draw_rmse(rmse: pd.DataFrame) -> Figure:
    """Draw the errors of both kinds of model beside the published ones, as in Table 5.

    Returns
    -------
    Figure
        Ours on the left, the published ones on the right, one row a condition.
    """
    title = "Error in velocity on the nine steps, beside Table 5"
    figure, axes = panels(title, 1, 2, 3.9, Margins(left=2.0, top=0.6), sharex=True, sharey=True)
    for axis, prefix, title in ((axes[0], "", "ours, simulated"), (axes[1], "published_", "published, measured")):
        level = condition_levels(axis, rmse["condition"])
        mathematical = MILLI * rmse[f"{prefix}rmse_mathematical_m_s"]
        identified = MILLI * rmse[f"{prefix}rmse_transfer_function_m_s"]
        axis.hlines(level, mathematical, identified, color="#c4c4c4", linewidth=2.0)
        axis.plot(mathematical, level, "o", color=BLUE, label="mathematical model")
        axis.plot(identified, level, "s", color=VERMILION, label="transfer function")
        axis.set(title=title, xlabel="root-mean-square error in velocity [mm/s]")
    axes[0].set(xlim=(0.0, None))
    figure.legend(*axes[0].get_legend_handles_labels(), loc="upper right", ncols=2)
    return figure
