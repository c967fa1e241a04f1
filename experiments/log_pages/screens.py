"""Terminal output of findings, for any actuator."""

from collections.abc import Iterable, Mapping, Sequence
from math import ceil, floor, isfinite, log10
from typing import TYPE_CHECKING, Any

from experiments.command.json_output import Result
from experiments.command.terminal import table
from experiments.command.visible_text import visible_name
from experiments.page.names_shown import quantity_name
from experiments.page.numbers import percent_text, reader_unit
from experiments.page.sentences import sentence

if TYPE_CHECKING:
    from rich.console import RenderableType


def quantities_shown(results: Sequence[Result], options: Mapping[str, Any]) -> "Iterable[RenderableType]":
    """Show what was found of each log: a table of quantities with their intervals, the outcome in words, what to do.

    Parameters
    ----------
    results : sequence of Result
        One a log, with ``quantities``; ``probabilities`` and ``advice`` of a diagnosis.
    options : Mapping[str, Any]
        As given to the verb; none matters here.
    """
    del options
    for result in results:
        about = result.get("file", result["plant"])
        entries = result["quantities"]
        total = any(entry.get("ci95_total") for entry in entries.values())
        shown = table("quantity", "value", "95 % interval", *(["with rig error"] if total else []), "unit", title=about)
        for name, entry in entries.items():
            scale, unit = reader_unit(entry["unit"])
            ends, whole = (_scaled(entry.get(which), scale) for which in ("ci95", "ci95_total"))
            value = "-" if entry["value"] is None else f"{scale * entry['value']:.{_digits(ends)}g}"
            said = [_ends(ends), *([_ends(whole)] if total else [])]
            shown.add_row(quantity_name(name), value, *said, unit)
        yield shown
        sure = result.get("probabilities", {}).get(result.get("condition"))
        probable = "" if sure is None else f", probability {percent_text(sure)} %"
        yield f"{about}: {result['outcome'].replace('_', ' ')}: {result['message']}{probable}"
        yield from (f"{about}: next: {one}" for one in result.get("advice", ()))


def messages_shown(results: Sequence[Result]) -> "Iterable[RenderableType]":
    """Show the message of each log, with what to do below it.

    Parameters
    ----------
    results : sequence of Result
        One a log, with ``message`` and ``advice``.
    """
    for result in results:
        yield f"{visible_name(result['file'])}: {result['message']}"
        yield from (f"  next  {sentence(one)}" for one in result["advice"])


def _digits(ends: Sequence[float] | None) -> int:
    """Return the digits that show an interval's width to two; at least four, and the whole of a number below 1e6."""
    largest = 0.0 if ends is None else max(map(abs, ends))
    if ends is None or not isfinite(largest) or not ends[1] > ends[0]:
        return 4
    whole = min(floor(log10(largest)) + 1, 6)
    return min(max(4, whole, ceil(log10(largest / (ends[1] - ends[0]))) + 2), 12)


def _scaled(ends: Sequence[float] | None, scale: float) -> list[float] | None:
    return None if ends is None else [scale * end for end in ends]


def _ends(ends: Sequence[float] | None) -> str:
    if ends is None:
        return "-"
    digits = _digits(ends)
    return f"{ends[0]:.{digits}g} to {ends[1]:.{digits}g}"
