"""An identified model on one page: measured and simulated output, the residual, and the frequency response."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from estimation.arrays import Array
from estimation.finding import NORMAL_95
from estimation.identification.fit.residual_tests import DEFAULT_LAGS, correlations
from estimation.identification.fit.validate import Validation
from estimation.identification.model.linear_model import LinearModel
from estimation.identification.signals.automatic_window import automatic_response
from experiments.log_pages.free_run_figure import SHOWN_SAMPLES
from experiments.log_pages.identified_words import p_value_text
from experiments.page.figure_files import write_png
from experiments.page.style import BLUE, GREY, ORANGE, VERMILION, Margins, panels
from plant.log.record import CHANNELS

LEAST_COHERENCE = 0.1
"""Coherence below which the empirical response is meaningless and is left out."""


def _draw_identified(model: LinearModel, u: Array, y: Array, found: Validation, log: str) -> Figure:
    """Draw measured and simulated output, the residual with its correlations, and the gain with its band."""
    title = f"{log}: {model.structure} of order {model.denominator.size - 1}, fit {found.fit_percent:.1f} %"
    figure, axes = panels(title, 3, 2, 8.0, Margins(left=0.9, top=0.65, across=0.8, down=0.65))
    simulated = model.simulate(u, initial=model.initial_state)
    residual = y - simulated
    _over_time(axes[0], model, {"measured": (GREY, y), "simulated": (BLUE, simulated)})
    axes[0].set_title("running free", loc="left")
    _over_time(axes[2], model, {"residual": (VERMILION, residual)})
    axes[2].set_title("measured less simulated", loc="left")
    _correlations(axes[1], residual, residual, np.arange(1, DEFAULT_LAGS + 1))
    axes[1].set_title(f"residual with itself: white with {p_value_text(found.whiteness.p_value)}", loc="left")
    _correlations(axes[3], residual, u, np.arange(-DEFAULT_LAGS, DEFAULT_LAGS + 1))
    axes[3].set_title(f"residual with the input: none with {p_value_text(found.cross_correlation.p_value)}", loc="left")
    _response(axes[4], axes[5], model, u, y)
    return figure


def _over_time(axis: Axes, model: LinearModel, curves: dict[str, tuple[str, Array]]) -> None:
    for name, (colour, values) in curves.items():
        every = max(1, values.size // SHOWN_SAMPLES)
        time = model.sample_time * np.arange(values.size)[::every]
        axis.plot(time, values[::every], color=colour, lw=0.9, label=name)
    axis.set(xlabel="time [s]", ylabel=f"{model.output_name} [{CHANNELS.get(model.output_name, 'its unit')}]")
    if len(curves) > 1:
        axis.legend(loc="lower right", bbox_to_anchor=(1.0, 0.98), ncols=2)


def _correlations(axis: Axes, residual: Array, other: Array, lags: np.ndarray) -> None:
    axis.bar(lags, correlations(residual, other, lags), width=0.7, color=BLUE)
    reach = NORMAL_95 / np.sqrt(np.count_nonzero(np.isfinite(residual)))
    axis.axhspan(-reach, reach, color=GREY, alpha=0.25, lw=0)
    axis.set(xlabel="lag [samples]; grey, 95 % of white residuals", ylabel="correlation [ratio]")


def _response(gain: Axes, phase: Axes, model: LinearModel, u: Array, y: Array) -> None:
    frequency = np.geomspace(1.0 / (u.size * model.sample_time), 0.5 / model.sample_time, 200)
    band = model.frequency_response(frequency, ci=0.95)
    known = np.isfinite(y)
    filled = y if known.all() else np.interp(np.arange(y.size), np.flatnonzero(known), y[known])
    empirical = automatic_response(u, filled, model.sample_time)
    sure = empirical.coherence >= LEAST_COHERENCE
    low, high = empirical.gain_band()
    gain.fill_between(empirical.frequency_hz, low, high, where=sure.tolist(), color=ORANGE, alpha=0.35, lw=0)
    gain.plot(empirical.frequency_hz[sure], np.abs(empirical.response[sure]), color=ORANGE, lw=0.8, label="empirical")
    gain.fill_between(frequency, band.gain_low, band.gain_high, color=BLUE, alpha=0.35, lw=0)
    gain.plot(frequency, np.abs(band.response), color=BLUE, label="model")
    gain.set(yscale="log", ylim=(0.1 * np.abs(band.response).min(), 10.0 * np.abs(band.response).max()))
    gain.set(ylabel="gain [output unit per input unit]", title="gain with 95 % bands")
    gain.legend(loc="lower left")
    turn = np.degrees(np.angle(empirical.response[sure]))
    phase.plot(empirical.frequency_hz[sure], turn, ".", ms=1.5, color=ORANGE)
    phase.plot(frequency, np.degrees(np.angle(band.response)), color=BLUE)
    phase.set(ylim=(-190.0, 190.0), yticks=np.arange(-180.0, 181.0, 90.0), ylabel="phase [degree]")
    for axis in (gain, phase):
        axis.set(xscale="log", xlabel="frequency [Hz]")


def write_identified(model: LinearModel, u: Array, y: Array, found: Validation, log: str, path: Path) -> None:
    """Write the figure as a PNG; no partial file is left behind.

    Parameters
    ----------
    model : LinearModel
        Stable model, fitted to the data.
    u, y : ndarray, shape (n,)
        Input and output [in their channels' units].
    """
    write_png(lambda: _draw_identified(model, u, y, found, log), path)
