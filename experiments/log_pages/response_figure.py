"""A measured frequency response with its 95 % circles, and the levels of noise and distortion."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from estimation.arrays import Array
from estimation.identification.signals.measured_response import MeasuredResponse
from experiments.page.figure_files import write_png
from experiments.page.style import BLUE, GREY, VERMILION, Margins, panels

TINY = 1e-300
"""Least power that is drawn [output unit squared]: zero has no logarithm."""


def _draw_response(found: MeasuredResponse, title: str) -> Figure:
    """Draw the gain with its uncertainty, and the output's spectral lines if the input is periodic, else the phase."""
    figure, axes = panels(f"{title}: {found.method.replace('-', ' ')}", 2, 1, 8.0, Margins(left=0.9, top=0.65))
    one, told = found.response, found.distortion
    gain, radius = np.abs(one.response), one.radius()
    low, high = (_decibels(np.maximum(gain + side * radius, TINY) ** 2) for side in (-1.0, 1.0))
    axes[0].fill_between(one.frequency, np.maximum(low, _decibels(gain**2) - 40.0), high, color=BLUE, alpha=0.2, lw=0)
    axes[0].semilogx(one.frequency, _decibels(gain**2), color=BLUE, lw=0.9, label="gain, 95 % interval shaded")
    axes[0].set(ylabel="gain [dB]")
    if told is None:
        known, phase = radius < gain, np.full(gain.size, np.nan)
        phase[known] = np.degrees(np.unwrap(np.angle(one.response[known])))
        axes[1].semilogx(one.frequency, phase, color=BLUE, lw=0.9, marker=".", ms=2)
        axes[1].set(ylabel="phase, where it is known [degrees]", xlabel="frequency [Hz]", xlim=axes[0].get_xlim())
    else:
        for name, marker, colour, where in (
            ("driven", ".", GREY, told.excited),
            ("odd, not driven", "x", VERMILION, told.odd & ~told.excited),
            ("even, not driven", "+", BLUE, ~told.odd & ~told.excited),
        ):
            if where.any():
                levels = _decibels(told.power[where])
                axes[1].semilogx(told.frequency[where], levels, marker, color=colour, ms=3, label=name)
        axes[1].semilogx(told.frequency, _decibels(told.noise), color=GREY, lw=0.6, label="noise")
        axes[1].set(ylabel="output power per line [dB]", xlabel="frequency [Hz]")
        axes[1].legend(loc="lower left")
    axes[0].legend(loc="lower left")
    return figure


def _decibels(power: Array) -> Array:
    return 10.0 * np.log10(np.maximum(power, TINY))


def write_response(found: MeasuredResponse, title: str, path: Path) -> None:
    """Write the figure as a PNG."""
    write_png(lambda: _draw_response(found, title), path)
