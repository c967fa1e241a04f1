"""`hydrostate compare A B` for two logs: diagnoses both, and shows what is higher or lower in the second."""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from experiments.actuators import verb_of_kind
from experiments.command.json_output import json_text, write_whole
from experiments.command.logs import read_log, run_logs
from experiments.command.options import load_actuator, load_columns, require_positive
from experiments.command.output_paths import require_no_log
from experiments.command.terminal import emit, note, render_text, short_names, table
from experiments.log_pages.comparison import (
    compare_view,
    comparison_rows,
    headings,
    is_unreliable,
    plain_words,
    quantities_shown,
)
from plant.errors import HydrostateError

if TYPE_CHECKING:
    from rich.console import RenderableType


def compare_logs(
    logs: Sequence[Path],
    out: Path | None,
    *,
    plant: str | None,
    rig: Path | None,
    columns: Sequence[str] | None,
    sample_time: float | None,
    seed: int,
    as_json: bool,
) -> None:
    """Diagnose two logs, and print their quantities with the differences.

    Parameters
    ----------
    sample_time : float or None
        Time between rows, which replaces the logs' own times [s].

    Raises
    ------
    HydrostateError
        If an option cannot be used.
    typer.Exit
        If a log cannot be read.
    """
    if len({str(log) for log in logs}) < 2:
        raise HydrostateError(f"two logs are compared, got {logs[0]} twice")
    require_positive("--sample-time", sample_time, "s")
    kind, bench = load_actuator(plant, rig)
    chosen = verb_of_kind(kind, "diagnose")
    actual, prepared = chosen.prepare(bench, {**chosen.options, "seed": seed})
    named = load_columns(columns)
    read = partial(read_log, rig_columns=bench.columns, columns=named, required=kind.required, sample_time=sample_time)
    about = {"plant": kind.name, "rig": bench.name, "seed": seed}

    def work(log: Path) -> dict[str, Any]:
        return {**chosen.blank, **about, **chosen.entries(chosen.run(read(log), actual, prepared))}

    if out is not None:
        require_no_log("--out", [out], logs)
    batch = run_logs(logs, work, {**chosen.blank, **about}, "diagnosing")
    if len(batch.done) < len(logs):
        raise typer.Exit(batch.exit_code)
    first, second = (
        {**result, "file": name} for result, name in zip(batch.results, short_names(batch.results), strict=True)
    )
    if out is not None:
        write_whole(out, compare_view(first, second), "--out", parents=True)
        note(f"written: {out}; open it in a browser")
    if as_json:
        files = [str(log) for log in logs]
        entries = {"outcome": "ok", "first": files[0], "second": files[1], "seed": seed}
        emit(json_text([{**entries, "differences": comparison_rows(first, second)}]))
        return
    emit(render_text(*_comparison_screen(first, second)))


def _comparison_screen(first: Mapping[str, Any], second: Mapping[str, Any]) -> "list[RenderableType]":
    rows = comparison_rows(first, second)
    doubt = " Do not rely on its numbers."
    said = [
        f"{one['file']}: {plain_words(one) or one['message']}{doubt if is_unreliable(one) else ''}"
        for one in (first, second)
    ]
    shown = table("quantity", "verdict", first["file"], second["file"], "difference", "95 % interval of the difference")
    doubted = is_unreliable(first) or is_unreliable(second)
    for row in quantities_shown(rows, doubted=doubted).to_dict("records"):
        shown.add_row(*(row[name] for name in ("quantity", "says", "first", "second", "difference", "interval")))
    return [*headings(first, second, rows), "", *said, shown]
