"""Terminal output of findings, for any actuator."""

from collections.abc import Iterable, Mapping, Sequence
from math import ceil, floor, isfinite, log10
from typing import TYPE_CHECKING, Any

from experiments.command.json_output import Result
from experiments.command.terminal import clauses, table
from experiments.command.visible_text import visible_name
from experiments.log_pages.entries import NO_GATE
from experiments.page.names_shown import quantity_name
from experiments.page.numbers import percent_text, reader_unit
from experiments.page.sentences import sentence

NEXT_LINE = "\n" + 12 * " "
"""Separator between reasons and between pieces of advice: each gets its own line, aligned below the first."""

MOST_REASONS = 4
"""Largest number of reasons against a result shown on a terminal [count]."""

if TYPE_CHECKING:
    from rich.console import RenderableType


def quantities_shown(results: Sequence[Result], options: Mapping[str, Any]) -> "Iterable[RenderableType]":
    """Show the results of each log: a table of quantities with intervals, the outcome in words, and the next steps.

    Parameters
    ----------
    results : sequence of Result
        One for each log, with ``quantities``; ``probabilities`` and ``advice`` of a diagnosis.
    options : Mapping[str, Any]
        Options of the verb; not used here.
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
            said = [_interval_text(ends), *([_interval_text(whole)] if total else [])]
            shown.add_row(quantity_name(name), value, *said, unit)
        yield shown
        sure = result.get("probabilities", {}).get(result.get("condition"))
        probable = "" if sure is None else f", probability {percent_text(sure)} %"
        yield message_in_lines(result, about, f"{result['outcome'].replace('_', ' ')}: ", probable)
        yield from (f"{about}: next: {one}" for one in result.get("advice", ()))


def messages_shown(results: Sequence[Result]) -> "Iterable[RenderableType]":
    """Show the message of each log, with advice below it.

    Parameters
    ----------
    results : sequence of Result
        One for each log, with ``message`` and ``advice``.
    """
    for result in results:
        yield message_in_lines(result, visible_name(result["file"]))
        yield from (f"  next  {sentence(one)}" for one in result["advice"])


def message_in_lines(result: Result, about: str, before: str = "", after: str = "") -> str:
    """Return the message of a log; if there are several reasons against its result, each gets its own line.

    Parameters
    ----------
    result : Result
        Entries of the log; the reasons are those of ``gate`` and, for a diagnosis, ``reasons``.
    about : str
        Name of the log.
    before, after : str
        Text before and after the message.

    Examples
    --------
    >>> said = "no value: the model does not describe the log"
    >>> against = ["velocity reads wrong", "pressure lags"]
    >>> log = {"message": f"{said}; velocity reads wrong; pressure lags", "gate": {"reasons": against}}
    >>> print(message_in_lines(log, "run.csv"))
    run.csv: no value: the model does not describe the log
      reasons   velocity reads wrong
                pressure lags
    """
    message = str(result["message"])
    against = [*result.get("reasons", ()), *(result.get("gate") or NO_GATE)["reasons"]]
    told = [one for one in dict.fromkeys(against) if one.rstrip(".") in message]
    head, found, rest = message.partition(clauses(told) or "\n")
    if not found or (not head and len(told) < 2):
        return f"{about}: {before}{message}{after}"
    opening = f"{before}{head}".rstrip(" :;") or "no result"
    reasons = NEXT_LINE.join(told[:MOST_REASONS])
    more = f"{NEXT_LINE}and {len(told) - MOST_REASONS} more, see --json" if len(told) > MOST_REASONS else ""
    return f"{about}: {opening}{rest}{after}\n  reasons   {reasons}{more}"


def _digits(ends: Sequence[float] | None) -> int:
    """Return the digits that show an interval's width to two digits: at least four, and all of a number below 1e6."""
    largest = 0.0 if ends is None else max(map(abs, ends))
    if ends is None or not isfinite(largest) or not ends[1] > ends[0]:
        return 4
    whole = min(floor(log10(largest)) + 1, 6)
    return min(max(4, whole, ceil(log10(largest / (ends[1] - ends[0]))) + 2), 12)


def _scaled(ends: Sequence[float] | None, scale: float) -> list[float] | None:
    return None if ends is None else [scale * end for end in ends]


def _interval_text(ends: Sequence[float] | None) -> str:
    if ends is None:
        return "-"
    digits = _digits(ends)
    return f"{ends[0]:.{digits}g} to {ends[1]:.{digits}g}"
