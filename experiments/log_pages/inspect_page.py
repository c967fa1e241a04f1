"""The page of `hydrostate inspect`: columns with guesses and reasons, the rig file's block, a chart of each column."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from experiments.page.figure_files import svg_of
from experiments.page.numbers import MISSING, number
from experiments.page.render import render_page
from experiments.page.sentences import sentence
from experiments.page.style import BLUE, Margins, panels, project_style
from experiments.page.tables import Column
from plant.arrays import Array
from plant.log.clock.stamps import seconds_from_first
from plant.log.columns import TIME

if TYPE_CHECKING:
    from plant.log.inspection import ColumnFacts, TableFacts

MOST_COLUMNS, MOST_POINTS = 24, 2000
"""Largest number of columns drawn, and of points in each."""


def inspect_page(result: Mapping[str, Any], tables: "Sequence[TableFacts]") -> str:
    """Return the page on the contents of a log."""
    from experiments.log_pages.inspected import clock_sentence, columns_block, guessed_units

    rows = [row for one in result["tables"] for row in one["columns"]]
    told = [row for row in rows if row["channel"] == TIME]
    times = [_time_of(facts, told) for facts in tables]
    drawn = [
        (one, time)
        for facts, time in zip(tables, times, strict=True)
        for one in facts.columns
        if len(one.present) > 1 and (time is None or one is not time.column)
    ]
    with project_style():
        figure = _draw(drawn[:MOST_COLUMNS])
    units = ["unit"] if any(row["unit"] for row in rows) else []
    guessed = guessed_units(result["tables"])
    unsure = "; check the units that were guessed" if guessed else ""
    facts = {
        "result": {**result, "file": Path(result["file"]).name},  # a page is passed on, and names no folder
        "title": f"This log can be diagnosed{unsure}." if result["reads"] else "This log cannot be diagnosed yet.",
        "message": f"{result['message'][:1].upper()}{result['message'][1:]}.",
        "block": columns_block(result["columns"], guessed),
        "guessed": [name for _, name in guessed],
        "clocks": [sentence(clock_sentence(one)) for one in result["tables"]],
        "most": MOST_COLUMNS,
        "columns": pd.DataFrame([_row(row) for row in rows]),
    }
    sure = Column("sure", "sure", "%")
    shown = {"columns": ("number", "column", *units, "range", "missing", "channel", sure, "because")}
    return render_page("log_pages/inspect.html", facts, shown, {"figures/columns.svg": svg_of(figure)})


def _row(row: Mapping[str, Any]) -> dict[str, str]:
    ends = row["range"]
    return {
        "number": str(row["number"]),
        "column": row["name"],
        "unit": row["unit"] or "",
        "range": row["kind"] if ends is None else f"{number(ends[0])} to {number(ends[1])}",
        "missing": str(row["missing"]),
        "channel": row["channel"] or MISSING,
        "sure": "" if row["probability"] is None else f"{100.0 * row['probability']:.0f}",
        "because": "; ".join(note["text"] for note in row["why"]),
    }


class _Time(NamedTuple):
    """The time column of a table: its values as drawn, and the name of the axis."""

    column: "ColumnFacts"
    values: Array
    label: str


def _time_of(facts: "TableFacts", told: Sequence[Mapping[str, Any]]) -> _Time | None:
    """Return the time of a table if it rises with each row; dates become seconds since the first one."""
    names = {row["name"] for row in told}
    for one in facts.columns:
        if one.heading.name in names and one.values is not None:
            stamps: Any = one.values
            dated = stamps.dtype.kind == "M"
            values: Array = seconds_from_first(stamps) if dated else stamps
            unit = "" if one.heading.name.endswith(("]", ")")) else _bracketed(one.heading.unit)
            label = "time since the first row [s]" if dated else f"{one.heading.name} {unit}"
            return _Time(one, values, label.rstrip()) if bool(np.all(np.diff(values) > 0.0)) else None
    return None


def _draw(columns: "Sequence[tuple[ColumnFacts, _Time | None]]") -> Figure:
    """Draw numeric columns against the time of their table, or against the row number if it has no time."""
    count = max(1, len(columns))
    figure, axes = panels("", count, 1, 0.9 + 1.45 * count, Margins(left=0.9, down=0.6))
    for place, (axis, (one, time)) in enumerate(zip(axes, columns, strict=False)):
        values = one.values if one.values is not None else np.empty(0)
        rows = np.linspace(0, len(values) - 1, min(len(values), MOST_POINTS)).astype(int)
        finite = np.where(np.isfinite(values), np.clip(values, -1e300, 1e300), np.nan)
        by, label = rows, "row"
        if time is not None and len(time.values) == len(values):
            by, label = time.values[rows], time.label
        axis.plot(by, finite[rows], color=BLUE, lw=0.8)
        axis.set_title(_plain(one.heading.name[:80]))
        axis.set_ylabel(_plain(_bracketed(one.heading.unit)))
        if place == count - 1 or columns[place + 1][1] is not time:
            axis.set_xlabel(_plain(label))
    return figure


def _bracketed(unit: str | None) -> str:
    return f"[{unit}]" if unit else ""


def _plain(text: str) -> str:
    return text.replace("$", r"\$")
