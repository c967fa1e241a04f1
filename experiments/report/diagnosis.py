"""The page on one log: the verdict, probabilities, severities, measured against fitted, what to measure next."""

import math
from collections.abc import Mapping
from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from experiments.command.verdict import SHOWN, amount, believed, headline, next_step, since
from experiments.figures.style import BLACK, BLUE, GREY, ORANGE, SKY, VERMILION, Margins, panels, styled
from experiments.report.sectioned import Section, render_sections
from experiments.report.tables import Column, html_table
from faults.circuit_runs import blocks_of

if TYPE_CHECKING:
    from faults.diagnosis import Diagnosis

ASSUMED = (
    "The rig file's geometry, pump and relief setting are taken as true; the piston starts at rest in mid-stroke; "
    "leakage, flow bias, friction and bulk modulus change at most once, at the time under 'Since when'. Probabilities "
    "hold if the actuator is in one of the nine conditions, each as likely as the next before the log; they were "
    "calibrated on simulated logs of the whole circuit. Intervals are 95 %, wider the more of the log the circuit "
    "leaves unexplained. Without pressure leakage, friction and bulk modulus share a scale that no log holds: their "
    "intervals then rest on how alike actuators of one kind are."
)

CHANNELS = (("velocity", "mm/s", 1e3), ("differential pressure", "bar", 1e-5))


def diagnosis_page(result: Mapping[str, Any], found: "Diagnosis") -> str:
    """Return the page on a log.

    Parameters
    ----------
    result : Mapping
        Its entries, with a verdict.
    found : Diagnosis
        The same diagnosis.

    Returns
    -------
    str
        HTML that loads nothing.
    """
    sections = [
        Section(
            "probabilities",
            "Which condition",
            (f"To be believed? {_sentence(believed(result))}",),
            *_svg(_draw_probabilities(found)),
        ),
        Section(
            "severity",
            "How bad",
            tuple(_sentence(said) for said in result["not_told"]),
            *_svg(_draw_severities(found)),
            tables=[_severities(result)],
        ),
        Section(
            "since", "Since when", (_sentence(since(result) or "nothing began: healthy from the log's beginning"),)
        ),
        Section("fit", "Measured and fitted", (), *_svg(_draw_fit(found))),
        Section("next", "What to measure next", (_sentence(next_step(result)),)),
        Section("assumed", "What was assumed", (ASSUMED,)),
    ]
    title = _sentence(headline(result)).removesuffix(".")
    return render_sections(title, f"diagnosis of {result['file']}", _introduction(result), sections)


def _sentence(said: str) -> str:
    """Return a clause as a sentence."""
    return f"{said[:1].upper()}{said[1:]}."


def _introduction(result: Mapping[str, Any]) -> str:
    leaked, lost = (amount(result["severity"][name]) for name in ("leakage_flow", "velocity_lost"))
    return f"Leakage {leaked} at rated pressure; {lost} of the velocity lost at rated speed. Rig: {result['rig']}."


def _severities(result: Mapping[str, Any]) -> Any:
    rows = [(SHOWN[name], amount(one)) for name, one in result["severity"].items()]
    frame = pd.DataFrame(rows, columns=["what", "value"])
    columns = [Column("what", "what", words=str), Column("value", "estimate and 95 % interval", words=str)]
    return html_table(
        frame, columns, "Severities; rated pressure is the relief setting, rated speed that of the rig file."
    )


def _svg(figure: tuple[Figure, str]) -> tuple[bytes, str]:
    drawn, caption = figure
    buffer = BytesIO()
    with styled():
        drawn.savefig(buffer, format="svg", metadata={"Date": None})
    return buffer.getvalue(), caption


def _draw_probabilities(found: "Diagnosis") -> tuple[Figure, str]:
    with styled():
        figure, axes = panels("Probability of each condition", 1, 1, 2.8, Margins(left=2.2, down=0.35))
        names = list(found.probabilities)[::-1]
        shares = [100.0 * found.probabilities[name] for name in names]
        colours = [VERMILION if name == found.condition else GREY for name in names]
        axes[0].barh([name.replace("_", " ") for name in names], shares, color=colours)
        for place, share in enumerate(shares):
            axes[0].text(share + 0.7, place, f"{share:.1f}" if share >= 0.05 else "< 0.1", va="center", fontsize=8)
        axes[0].set_xlim(0.0, 108.0)
        axes[0].set_xlabel("probability [%], if it is one of the nine")
    return figure, "Probabilities of the nine conditions."


def _draw_severities(found: "Diagnosis") -> tuple[Figure, str]:
    """Draw a bar for each severity, on a scale of its own, from zero, with its interval and the healthy value."""
    shown = [name for name, one in found.severity.items() if all(map(math.isfinite, (one.value, *one.ci95)))]
    with styled():
        margins = Margins(left=2.4, right=2.5, top=0.75, bottom=0.35, down=0.32)
        height = 1.1 + len(shown) * (0.24 + margins.down)
        figure, axes = panels("Severities, with 95 % intervals", len(shown), 1, height, margins)
        for axis, name in zip(axes, shown, strict=True):
            one = found.severity[name]
            scale = 1e-6 if one.unit == "Pa" else 1.0
            value, low, high, sound = (scale * number for number in (one.value, *one.ci95, found.healthy[name]))
            axis.barh([0.0], [value], height=0.8, color=SKY)
            error = [[max(value - low, 0.0)], [max(high - value, 0.0)]]
            axis.errorbar([value], [0.0], xerr=error, fmt="none", ecolor=BLACK, elinewidth=1.6, capsize=5.0)
            axis.axvline(sound, color=VERMILION, ls="--", lw=1.4)
            reach = max(abs(number) for number in (value, low, high, sound)) or 1.0
            axis.set_xlim(1.08 * min(0.0, low, sound) - 0.01 * reach, 1.08 * max(value, high, sound) + 0.01 * reach)
            axis.set_ylim(-0.6, 0.6)
            unit = "MPa" if one.unit == "Pa" else one.unit
            axis.set_yticks([0.0], [f"{SHOWN[name].replace(', at most', '')} [{unit}]"])
            axis.tick_params(axis="y", length=0)
            axis.grid(visible=False, axis="y")
            words = amount({"value": one.value, "unit": one.unit, "ci95": one.ci95})
            axis.text(1.02, 0.5, words, transform=axis.transAxes, va="center", fontsize=8.5)
        handles = [
            Patch(color=SKY, label="estimate"),
            Line2D([], [], color=BLACK, lw=1.6, label="95 % interval"),
            Line2D([], [], color=VERMILION, ls="--", lw=1.4, label="healthy actuator"),
        ]
        figure.legend(handles=handles, loc="upper right", ncols=3, bbox_to_anchor=(1.0, 1.0))
    return figure, "Each on a scale of its own; the estimate and its interval in figures on the right."


def _draw_fit(found: "Diagnosis") -> tuple[Figure, str]:
    blocks, fit = blocks_of(found.scoreboard.window), found.scoreboard.fits.best
    onset, begin = found.scoreboard.onset, found.scoreboard.window.start_time
    time = begin + (np.arange(len(blocks.velocity)) + 0.5) * blocks.block * blocks.sample_time
    outputs = blocks.outputs.shape[1]
    with styled():
        title = "Log and fitted circuit, means over 10 ms, and what is left"
        figure, axes = panels(title, 2 * outputs, 1, 1.0 + 2.2 * outputs, Margins(left=0.9, down=0.3), sharex=True)
        for i, (name, unit, scale) in enumerate(CHANNELS[:outputs]):
            measured = scale * blocks.outputs[:, i]
            axes[2 * i].plot(time, measured, color=BLUE, lw=1.6, label="measured")
            axes[2 * i].plot(time, scale * fit.fitted[:, i], color=ORANGE, lw=0.9, label="fitted circuit")
            axes[2 * i].set_ylabel(f"{name}\n[{unit}]")
            axes[2 * i + 1].plot(time, measured - scale * fit.fitted[:, i], color=GREY, lw=0.7)
            axes[2 * i + 1].set_ylabel(f"left\n[{unit}]")
        for axis in axes:
            if onset is not None:
                axis.axvline(onset.since, color=VERMILION, ls="--", lw=1.2)
        axes[-1].set_xlabel("time [s]")
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="upper right", ncols=2, bbox_to_anchor=(1.0, 1.0))
    dated = "" if onset is None else " The dashed line is the change, between two circuits."
    said = "Measured velocity and pressure, the circuit that fits best, and the residuals on a scale of their own."
    return figure, f"{said}{dated}"
