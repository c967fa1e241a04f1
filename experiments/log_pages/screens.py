"""What a terminal shows of findings, whatever the actuator."""

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from experiments.command.json_output import Result
from experiments.command.terminal import table

if TYPE_CHECKING:
    from rich.console import RenderableType


def quantities_shown(results: Sequence[Result], options: Mapping[str, Any]) -> "Iterable[RenderableType]":
    """Show what was estimated of each log: a table of quantities with their intervals, and the outcome in words.

    Parameters
    ----------
    results : sequence of Result
        One a log, with ``quantities``.
    options : Mapping[str, Any]
        As given to the verb; none matters here.
    """
    del options
    for result in results:
        about = result.get("file", result["plant"])
        shown = table("quantity", "value", "95 % interval", "unit", title=about)
        for name, entry in result["quantities"].items():
            words = "-" if entry["ci95"] is None else f"{entry['ci95'][0]:.4g} to {entry['ci95'][1]:.4g}"
            value = "-" if entry["value"] is None else f"{entry['value']:.4g}"
            shown.add_row(name.replace("_", " "), value, words, entry["unit"])
        yield shown
        yield f"{about}: {result['outcome'].replace('_', ' ')}: {result['message']}"
