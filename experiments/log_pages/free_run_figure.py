"""Measured and simulated output of a model between any channels, and the residual."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.model import FreeRunModel
from experiments.page.figure_files import write_png
from experiments.page.style import BLUE, GREY, VERMILION, Margins, panels

SHOWN_SAMPLES = 8000
"""Approximate number of samples drawn for each curve."""


def draw_free_run(model: FreeRunModel, data: Channels, log: str) -> Figure:
    """Draw measured and simulated output of the first log, and the difference.

    Parameters
    ----------
    data : Channels
        The data used for the fit, in the channels' units.
    """
    u, y = data.u[0], data.y[0]
    simulated = model.simulate(u, y)
    fit = model.quality([u], [y]).fit_percent
    figure, axes = panels(f"{log}: {model.structure}, fit {fit:.1f} %", 2, 1, 8.0, Margins(left=0.9, top=0.65))
    every = max(1, y.size // SHOWN_SAMPLES)
    time = model.sample_time * np.arange(y.size)[::every]
    for axis, curves in (
        (axes[0], (("measured", GREY, y), ("simulated", BLUE, simulated))),
        (axes[1], (("measured less simulated", VERMILION, y - simulated),)),
    ):
        for name, colour, values in curves:
            axis.plot(time, values[::every], color=colour, lw=0.9, label=name)
        axis.set(xlabel="time [s]", ylabel=f"{model.output} [its unit]")
        axis.legend(loc="upper right")
    return figure


def write_free_run(model: FreeRunModel, data: Channels, log: str, path: Path) -> None:
    """Write the figure as a PNG."""
    write_png(lambda: draw_free_run(model, data, log), path)
