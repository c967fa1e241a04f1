"""The page on one log: the verdict, probabilities, severities, measured against fitted, what to measure next."""

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from experiments.eha.verdict_words import SHOWN, amount, believed, headline, next_step, since
from experiments.page.figure_files import svg_of
from experiments.page.render import render_page
from experiments.page.style import BLACK, BLUE, GREY, ORANGE, SKY, VERMILION, Margins, panels, styled
from experiments.page.tables import Column
from faults.diagnosis.circuit_runs import blocks_of

if TYPE_CHECKING:
    from estimation.finding import Finding

CHANNELS = (("velocity", "mm/s", 1e3), ("differential pressure", "bar", 1e-5))


def diagnosis_page(result: Mapping[str, Any], found: "Finding") -> str:
    """Return the page on a log."""
    drawn = {"probabilities": _draw_probabilities(found), "severity": _draw_severities(found), "fit": _draw_fit(found)}
    rows = [(SHOWN[name], amount(one)) for name, one in result["severity"].items()]
    facts = {
        "result": result,
        "title": _sentence(headline(result)).removesuffix("."),
        "leaked": amount(result["severity"]["leakage_flow"]),
        "lost": amount(result["severity"]["velocity_lost"]),
        "believed": _sentence(believed(result)),
        "not_told": [_sentence(said) for said in result["not_told"]],
        "since": _sentence(since(result) or "nothing began: healthy from the log's beginning"),
        "next_step": _sentence(next_step(result)),
        "captions": {name: caption for name, (_, caption) in drawn.items()},
        "severities": pd.DataFrame(rows, columns=["what", "value"]),
    }
    columns = {"severities": ("what", Column("value", "estimate and 95 % interval"))}
    files = {f"figures/{name}.svg": svg_of(figure) for name, (figure, _) in drawn.items()}
    return render_page("eha/diagnosis.html", facts, columns, files)


def _sentence(said: str) -> str:
    """Return a clause as a sentence."""
    return f"{said[:1].upper()}{said[1:]}."


def _draw_probabilities(found: "Finding") -> tuple[Figure, str]:
    with styled():
        figure, axes = panels("Probability of each condition", 1, 1, 2.8, Margins(left=2.2, down=0.35))
        names = list(found.probabilities)[::-1]
        shares = [100.0 * found.probabilities[name] for name in names]
        colours = [VERMILION if name == found.condition else GREY for name in names]
        axes[0].barh([name.replace("_", " ") for name in names], shares, color=colours)
        for place, share in enumerate(shares):
            axes[0].text(share + 0.7, place, f"{share:.1f}" if share >= 0.05 else "< 0.1", va="center", fontsize=8)
        axes[0].set(xlim=(0.0, 108.0), xlabel="probability [%], if it is one of the nine")
    return figure, "Probabilities of the nine conditions."


def _draw_severities(found: "Finding") -> tuple[Figure, str]:
    """Draw a bar for each severity, on a scale of its own, from zero, with its interval and the healthy value."""
    shown = {
        name: (one.value, *one.ci95)
        for name, one in found.severities.items()
        if one.value is not None and one.ci95 is not None and all(map(math.isfinite, one.ci95))
    }
    with styled():
        margins = Margins(left=2.4, right=2.5, top=0.75, bottom=0.35, down=0.32)
        height = 1.1 + len(shown) * (0.24 + margins.down)
        figure, axes = panels("Severities, with 95 % intervals", len(shown), 1, height, margins)
        for axis, (name, numbers) in zip(axes, shown.items(), strict=True):
            one = found.severities[name]
            scale = 1e-6 if one.unit == "Pa" else 1.0
            value, low, high, sound = (scale * number for number in (*numbers, found.healthy[name]))
            axis.barh([0.0], [value], height=0.8, color=SKY)
            error = [[max(value - low, 0.0)], [max(high - value, 0.0)]]
            axis.errorbar([value], [0.0], xerr=error, fmt="none", ecolor=BLACK, elinewidth=1.6, capsize=5.0)
            total = [scale * end for end in one.ci95_total or one.ci95 or ()]
            axis.plot(total, [0.0, 0.0], color=BLACK, lw=0.7)
            axis.axvline(sound, color=VERMILION, ls="--", lw=1.4)
            reach = max(abs(number) for number in (value, *total, sound)) or 1.0
            least, most = min(0.0, *total, sound), max(value, *total, sound)
            axis.set(xlim=(1.08 * least - 0.01 * reach, 1.08 * most + 0.01 * reach), ylim=(-0.6, 0.6))
            unit = "MPa" if one.unit == "Pa" else one.unit
            axis.set_yticks([0.0], [f"{SHOWN[name].replace(', at most', '')} [{unit}]"])
            axis.tick_params(axis="y", length=0)
            axis.grid(visible=False, axis="y")
            words = amount({**vars(one), "ci95_total": one.ci95_total or [None, None]})
            axis.text(1.02, 0.5, words.replace("; ", ";\n"), transform=axis.transAxes, va="center", fontsize=8.5)
        handles = [
            Patch(color=SKY, label="estimate"),
            Line2D([], [], color=BLACK, lw=1.6, label="95 % interval"),
            Line2D([], [], color=BLACK, lw=0.7, label="with the rig's"),
            Line2D([], [], color=VERMILION, ls="--", lw=1.4, label="healthy actuator"),
        ]
        figure.legend(handles=handles, loc="upper right", ncols=4, bbox_to_anchor=(1.0, 1.0))
    return figure, "Each on a scale of its own; the estimate and its interval in figures on the right."


def _draw_fit(found: "Finding") -> tuple[Figure, str]:
    board = found.evidence.diagnosis.scoreboard
    blocks, fit = blocks_of(board.window), board.fits.best
    onset, begin = board.onset, board.window.start_time
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
