"""The page on one log, whatever the actuator: the verdict, quantities with intervals, notes, measured channels."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import pandas as pd
from matplotlib.figure import Figure
from numpy import linspace

from experiments.page.figure_files import svg_of
from experiments.page.numbers import MISSING, number, pretty_unit
from experiments.page.render import render_page
from experiments.page.style import BLUE, Margins, panels, styled
from experiments.page.tables import Column
from plant.log.columns import UNITS

if TYPE_CHECKING:
    from estimation.finding import Finding, Quantity
    from plant.log.record import Record

MOST_CHANNELS = 10
"""Up to so many channels are drawn."""

MOST_POINTS = 4000
"""About so many samples are drawn of each."""

LEAST_SHARE = 0.001
"""Probability below which a condition is not listed."""


def finding_page(result: Mapping[str, Any], found: "Finding", record: "Record") -> str:
    """Return the page on a log.

    Parameters
    ----------
    result : Mapping
        Its entries: ``file``, ``rig``, ``message`` and others.
    """
    with styled():
        figure = _draw_channels(record, [*found.channels, *record])
    title = " or ".join(found.named) if found.named and not found.unknown else found.outcome.value
    shown = {**found.quantities, **found.severities}
    shares = sorted(found.probabilities.items(), key=lambda item: -item[1])
    facts = {
        "result": result,
        "title": _capital(title.replace("_", " ")),
        "actuator": found.actuator,
        "message": _sentence(result["message"]),
        "believed": _believed(found),
        "duration": f"{record.duration:g}",
        "channels": ", ".join(found.channels),
        "notes": [_sentence(str(note)) for note in found.all_notes],
        "quantities": pd.DataFrame([_row(name, one) for name, one in shown.items()]),
        "probabilities": pd.DataFrame(
            [(name.replace("_", " "), f"{100.0 * share:.1f}") for name, share in shares if share >= LEAST_SHARE],
            columns=["condition", "percent"],
        ),
    }
    columns = {
        "quantities": (
            "quantity",
            "value",
            Column("interval", "95 % interval"),
            Column("total", "with what is not known of the rig"),
            "unit",
        ),
        "probabilities": ("condition", Column("percent", "probability", "%")),
    }
    return render_page("log_pages/finding.html", facts, columns, {"figures/measured.svg": svg_of(figure)})


def _capital(said: str) -> str:
    return said[:1].upper() + said[1:]


def _sentence(said: str) -> str:
    """Return a clause as a sentence."""
    return f"{_capital(said).rstrip('.')}."


def _believed(found: "Finding") -> str:
    doubts = [*found.against, *found.gate.reasons]
    if not doubts:
        return "Yes: nothing speaks against it."
    return _sentence("no: " + "; ".join(dict.fromkeys(map(str, doubts))))


def _row(name: str, one: "Quantity") -> dict[str, str]:
    return {
        "quantity": name.replace("_", " "),
        "value": number(one.value),
        "interval": _ends(one.ci95),
        "total": _ends(one.ci95_total),
        "unit": pretty_unit(one.unit),
    }


def _ends(interval: tuple[float, float] | None) -> str:
    return MISSING if interval is None else f"{number(interval[0])} to {number(interval[1])}"


def _draw_channels(record: "Record", names: Sequence[str]) -> Figure:
    shown = [name for name in dict.fromkeys(names) if name in record and name in UNITS][:MOST_CHANNELS]
    places = linspace(0, len(record) - 1, min(len(record), MOST_POINTS)).astype(int)
    margins = Margins(left=0.9, down=0.35)
    figure, axes = panels("Measured", len(shown), 1, 0.9 + 1.5 * len(shown), margins, sharex=True)
    for axis, name in zip(axes, shown, strict=True):
        axis.plot(record.time[places], record[name][places], color=BLUE, lw=0.8)
        axis.set(title=name, ylabel=f"[{UNITS[name]}]")
    axes[-1].set_xlabel("time [s]")
    return figure
