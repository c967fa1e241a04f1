"""Terminal output for logs of the gear-pump actuator."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from experiments.command.json_output import Result
from experiments.command.options import PRESSURE
from experiments.command.terminal import short_names, table
from experiments.command.visible_text import visible_name
from experiments.eha.entries import costs
from experiments.eha.verdict_words import equally_likely, verdict_lines
from experiments.log_pages.screens import message_in_lines
from experiments.page.condition_names import condition_in_words
from experiments.page.numbers import decimals_of, percent_text

if TYPE_CHECKING:
    from rich.console import RenderableType

COLUMNS = {
    "leakage_flow": "leakage [L/min]",
    "velocity_lost": "velocity lost [%]",
    "added_friction": "added friction [N]",
}
"""Severities in a table of many logs."""

MOST_MESSAGES = 3
"""Largest number of logs for which all evidence against a result is shown [count]."""

MOST_TABLES = 3
"""Largest number of logs for which every condition's score is shown [count]."""


def estimates_shown(results: Sequence[Result], options: Mapping[str, Any]) -> "Iterable[RenderableType]":
    """Show bulk modulus of each log with its interval and verdict.

    Parameters
    ----------
    results : sequence of Result
        One result for each log, with the entries of `experiments.eha.entries.NO_ESTIMATE`.
    options : Mapping[str, Any]
        Options of the verb; none is used here.
    """
    del options
    shown = table("log", "bulk modulus [MPa]", "95 % interval [MPa]", "with rig error [MPa]", "bound [%]", "verdict")
    for name, result in zip(short_names(results), results, strict=True):
        shown.add_row(name, *_bulk_modulus_cells(result))
    yield shown
    doubtful = [result for result in results if not result["gate"]["passed"]]
    if len(results) <= MOST_MESSAGES:
        yield from (message_in_lines(result, visible_name(result["file"])) for result in doubtful)
    elif doubtful:
        yield f"{len(doubtful)} of {len(results)} logs gave no reliable value; --json and --out give the reasons"
    yield from costs(results)


def _bulk_modulus_cells(result: Result) -> list[str]:
    modulus = result["bulk_modulus_pa"]
    verdict = result["outcome"].replace("_", " ")
    bound = f"{result['bound_percent']:.2g}" if math.isfinite(result["bound_percent"] or math.inf) else "-"
    if modulus["value"] is None:
        return ["-", "-", "-", bound, verdict]
    value, given = 1e-6 * modulus["value"], modulus["ci95"]
    ends = (value, value) if given is None else (1e-6 * given[0], 1e-6 * given[1])
    decimals = decimals_of(*ends)
    trusted = verdict if result["gate"]["passed"] else "doubtful"
    return [
        f"{value:.{decimals}f}",
        _interval_text(given, decimals),
        _interval_text(modulus["ci95_total"], 0),
        bound,
        trusted,
    ]


def _interval_text(ends: Sequence[float] | None, decimals: int) -> str:
    return "-" if ends is None else f"{1e-6 * ends[0]:.{decimals}f} to {1e-6 * ends[1]:.{decimals}f}"


def diagnoses_shown(results: Sequence[Result], options: Mapping[str, Any]) -> "Iterable[RenderableType]":
    """Show the diagnosis of each log, as one table if there are many logs.

    Parameters
    ----------
    results : sequence of Result
        One result for each log, with the entries of `experiments.eha.entries.NO_DIAGNOSIS`.
    options : Mapping[str, Any]
        Options of the verb; ``scores`` and ``transfer_functions`` select a table of errors.
    """
    tables = options["scores"] or options["transfer_functions"]
    detailed = len(results) <= MOST_TABLES
    if not detailed:
        yield _summary(results)
    for place, result in enumerate(results):
        judged = result["probabilities"] is not None
        if detailed and judged:
            yield from ["", *verdict_lines(result)][not place :]
        if tables and detailed:
            yield _scores_table(result)
        if detailed and judged and result["outcome"] == "ok" and result["expected"] is not None:
            yield f"  {_agreement(result)}"
        elif not judged or result["outcome"] != "ok" or result["expected"] is not None:
            yield message_in_lines(result, visible_name(result["file"]))
    notes = list(costs(results))
    yield from ["", *notes] if notes and detailed else notes


def _agreement(result: Result) -> str:
    """Return whether the condition is the expected one; the lines above name it."""
    agreed = not result["unknown"] and result["condition"] == result["expected"]
    return f"expected  {condition_in_words(result['expected'])}: {'agrees' if agreed else 'does not agree'}"


def _summary(results: Sequence[Result]) -> "RenderableType":
    shown = table("log", "condition", "probability [%]", "runner-up", *COLUMNS.values(), "reliable")
    for name, result in zip(short_names(results), results, strict=True):
        shares = result["probabilities"]
        alike: list[str] = [] if shares is None else equally_likely(result)
        share = "-" if shares is None else percent_text(sum(shares[one] for one in alike))
        named = " or ".join(alike) if len(alike) > 1 else result["condition"] or "-"
        believe = "UNKNOWN" if result["unknown"] else "-" if shares is None else "yes"
        second = "-" if result["runner_up"] in alike else result["runner_up"] or "-"
        sizes = [_size(result, severity) for severity in COLUMNS]
        shown.add_row(name, named, share, second, *sizes, believe)
    return shown


def _size(result: Result, severity: str) -> str:
    """Return a severity without its interval, or a dash if the log does not determine it."""
    value = None if result["severity"] is None else result["severity"][severity]["value"]
    return "-" if value is None or not math.isfinite(value) else f"{value:z.1f}"


def _scores_table(result: Result) -> "RenderableType":
    unit = "1" if PRESSURE in result["channels"] else "m/s"
    others = result["transfer_function_scores"]
    headings = ["condition", f"model error [{unit}]", *([] if others is None else ["transfer function [m/s]"]), ""]
    shown = table(*headings, title=visible_name(result["file"]))
    winners = {
        "<- best": "condition",
        "runner-up": "runner_up",
        "best transfer function": "transfer_function_condition",
    }
    for name, score in result["scores"].items():
        marks = [words for words, entry in winners.items() if result[entry] == name]
        cells = [name, f"{score:.4g}", *([] if others is None else [f"{others[name]:.4g}"]), ", ".join(marks)]
        shown.add_row(*cells, style="bold" if name == result["condition"] else None)
    return shown
