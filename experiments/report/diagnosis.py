"""The page on one log: the verdict, probabilities, severities, measured against fitted, what to measure next."""

from collections.abc import Mapping
from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from experiments.command.verdict import SHOWN, amount, believed, headline, next_step
from experiments.figures.style import BLUE, GREY, ORANGE, VERMILION, Margins, panels, styled
from experiments.report.sectioned import Section, render_sections
from experiments.report.tables import Column, html_table

if TYPE_CHECKING:
    from faults.diagnosis import Diagnosis

ASSUMED = (
    "The rig file's geometry, pump and relief setting are taken as true; the piston starts at rest in mid-stroke; "
    "leakage, flow bias, friction and bulk modulus are constant over the log. Probabilities hold if the actuator is in "
    "one of the nine conditions, each as likely as the next before the log; they were calibrated on simulated logs of "
    "the whole circuit. Intervals are 95 %."
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
            (f"To be believed? {believed(result)}.",),
            *_svg(_draw_probabilities(found)),
        ),
        Section("severity", "How bad", tuple(result["not_told"]), tables=[_severities(result)]),
        Section("fit", "Measured and fitted", (), *_svg(_draw_fit(found))),
        Section("next", "What to measure next", (f"{next_step(result)}.",)),
        Section("assumed", "What was assumed", (ASSUMED,)),
    ]
    return render_sections(headline(result), f"diagnosis of {result['file']}", _introduction(result), sections)


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


def _draw_fit(found: "Diagnosis") -> tuple[Figure, str]:
    blocks, fit = found.scoreboard.blocks, found.scoreboard.fits.best
    time = (np.arange(len(blocks.velocity)) + 0.5) * blocks.block * blocks.sample_time
    outputs = blocks.outputs.shape[1]
    with styled():
        title = "Log and fitted circuit, means over 10 ms, and what is left"
        figure, axes = panels(title, 2 * outputs, 1, 1.0 + 2.2 * outputs, Margins(left=0.9, down=0.3), sharex=True)
        for i, (name, unit, scale) in enumerate(CHANNELS[:outputs]):
            measured = scale * blocks.outputs[:, i]
            axes[2 * i].plot(time, measured, color=BLUE, lw=1.6, label="measured")
            axes[2 * i].plot(time, scale * fit.fitted[:, i], color=ORANGE, lw=0.9, label="fitted circuit")
            axes[2 * i].set_ylabel(f"{name}\n[{unit}]")
            axes[2 * i].legend(loc="upper right", ncols=2)
            axes[2 * i + 1].plot(time, measured - scale * fit.fitted[:, i], color=GREY, lw=0.7)
            axes[2 * i + 1].set_ylabel(f"left\n[{unit}]")
        axes[-1].set_xlabel("time [s]")
    return (
        figure,
        "Measured velocity and pressure, the circuit that fits best, and the residuals on a scale of their own.",
    )
