"""A filtered log on one page: the estimate with its band, the innovations, and their expected size."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from estimation.eha.bulk_modulus import BulkModulusEstimate
from estimation.filters.run import Estimate
from estimation.finding import NORMAL_95
from estimation.models.eha_forms import BULK_MODULUS
from estimation.trust.consistency import mean_chi_square_bounds
from experiments.page.figure_files import write_png
from experiments.page.style import BLACK, BLUE, GREY, ORANGE, VERMILION, Margins, panels

SHOWN_INNOVATIONS = 4000
"""Approximate number of innovations drawn for each channel."""

WINDOWS = 100
"""Number of windows over which the squared innovations are averaged."""

COLOURS = (BLUE, ORANGE, VERMILION)

NAMES = {"position_m": "position", "velocity_m_s": "velocity", "differential_pressure_pa": "differential pressure"}


def draw_innovations(found: BulkModulusEstimate, log: str) -> Figure:
    """Draw the estimate with its 95 % band, the normalised innovations and their mean square over time.

    Returns
    -------
    Figure
        Three panels with a common time axis, or one panel if innovations were not kept.

    Raises
    ------
    ValueError
        If the log was not filtered.
    """
    estimate = found.estimate
    if estimate is None:
        raise ValueError("the log was fitted, not filtered: there is no track to draw")
    kept = len(estimate.residuals) > 0
    verdict = "the gate passes" if found.gate.passed else "not to be relied on"
    title = f"{log}: effective bulk modulus by the {found.form} form; {verdict}"
    figure, axes = panels(title, 3 if kept else 1, 1, 7.0 if kept else 3.2, Margins(left=0.8, down=0.35), sharex=True)
    _track(axes[0], found, estimate)
    if kept:
        time = np.linspace(estimate.time[0], estimate.time[-1], len(estimate.residuals))
        normalised = estimate.residuals / np.sqrt(estimate.residual_variances)
        _innovations(axes[1], time, normalised, estimate)
        _mean_square(axes[2], time, normalised, estimate)
    axes[-1].set_xlabel("time [s]")
    return figure


def _track(axis: Axes, found: BulkModulusEstimate, estimate: Estimate) -> None:
    mean, std = estimate.track(BULK_MODULUS)
    std = std * found.gate.inflation
    low, high = (mean - NORMAL_95 * std) / 1e6, (mean + NORMAL_95 * std) / 1e6
    axis.fill_between(estimate.time, low, high, color=BLUE, alpha=0.25, lw=0, label="95 % band")
    axis.plot(estimate.time, mean / 1e6, color=BLUE, label="estimate")
    late = mean[len(mean) // 10 :]
    if np.all(np.isfinite(late)):
        spread = max(float(np.ptp(late)), 4.0 * float(std[-1]), 0.02 * abs(float(late[-1])))
        axis.set_ylim((late[-1] - 1.5 * spread) / 1e6, (late[-1] + 1.5 * spread) / 1e6)
    axis.set(ylabel="bulk modulus [MPa]")
    axis.legend(loc="upper right", ncols=2)


def _innovations(axis: Axes, time: np.ndarray, normalised: np.ndarray, estimate: Estimate) -> None:
    every = max(1, len(time) // SHOWN_INNOVATIONS)
    for i, channel in enumerate(estimate.channels):
        look: Any = {"ms": 1.5, "color": COLOURS[i % 3], "label": NAMES.get(channel, channel)}
        axis.plot(time[::every], normalised[::every, i], ".", **look)
    axis.axhspan(-NORMAL_95, NORMAL_95, color=GREY, alpha=0.15, lw=0)
    axis.set(ylim=(-6.0, 6.0), ylabel="innovation over its\nexpected deviation")
    axis.legend(loc="upper right", ncols=3, markerscale=5)


def _mean_square(axis: Axes, time: np.ndarray, normalised: np.ndarray, estimate: Estimate) -> None:
    window = max(1, len(time) // WINDOWS)
    count = len(time) // window
    centres = time[: count * window].reshape(count, window).mean(axis=1)
    for i, channel in enumerate(estimate.channels):
        squares = normalised[: count * window, i].reshape(count, window) ** 2
        present = np.isfinite(squares)
        sums = np.where(present, squares, 0.0).sum(axis=1)
        with np.errstate(invalid="ignore", divide="ignore"):  # a window without samples is a gap
            axis.plot(centres, sums / present.sum(axis=1), color=COLOURS[i % 3], label=NAMES.get(channel, channel))
    low, high = mean_chi_square_bounds(1, window)
    axis.axhspan(low, high, color=GREY, alpha=0.25, lw=0)
    axis.axhline(1.0, color=BLACK, lw=0.6)
    axis.set(yscale="log", ylabel=f"NIS, mean of {window} samples\n(grey: 95 % of windows)")


def write_innovations(found: BulkModulusEstimate, log: str, path: Path) -> None:
    """Write the figure as a PNG; no partial file is left behind."""
    write_png(lambda: draw_innovations(found, log), path)
