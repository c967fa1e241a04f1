"""The page of `hydrostate inspect`: columns with guesses and reasons, the block of a rig file, every column drawn."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from experiments.page.figure_files import svg_of
from experiments.page.numbers import MISSING, number
from experiments.page.render import render_page
from experiments.page.style import BLUE, Margins, panels, styled
from experiments.page.tables import Column

if TYPE_CHECKING:
    from plant.log.inspection import ColumnFacts, TableFacts

MOST_COLUMNS, MOST_POINTS = 24, 2000
"""Columns that are drawn, and points of each, at most."""


def inspect_page(result: Mapping[str, Any], tables: "Sequence[TableFacts]") -> str:
    """Return the page on what a log holds.

    Parameters
    ----------
    result : Mapping
        Entries of `hydrostate inspect`.
    tables : sequence of TableFacts
        The tables of the log.
    """
    from experiments.log_pages.inspected import block_of

    drawn = [one for facts in tables for one in facts.columns if len(one.present) > 1][:MOST_COLUMNS]
    with styled():
        figure = _draw(drawn)
    rows = [row for one in result["tables"] for row in one["columns"]]
    facts = {
        "result": result,
        "title": "What the log contains",
        "message": f"{result['message'][:1].upper()}{result['message'][1:]}.",
        "block": block_of(result["columns"]),
        "most": MOST_COLUMNS,
        "columns": pd.DataFrame([_row(row) for row in rows]),
    }
    shown = {
        "columns": ("number", "column", "unit", "range", "missing", "channel", Column("sure", "sure", "%"), "because")
    }
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


def _draw(columns: "Sequence[ColumnFacts]") -> Figure:
    count = max(1, len(columns))
    figure, axes = panels("Columns", count, 1, 0.9 + 1.45 * count, Margins(left=0.9, down=0.6))
    for axis, one in zip(axes, columns, strict=False):
        values = one.values if one.values is not None else np.empty(0)
        places = np.linspace(0, len(values) - 1, min(len(values), MOST_POINTS)).astype(int)
        finite = np.where(np.isfinite(values), np.clip(values, -1e300, 1e300), np.nan)
        axis.plot(places, finite[places], color=BLUE, lw=0.8)
        axis.set_title(one.heading.name[:80].replace("$", r"\$"))
        unit = (one.heading.unit or "").replace("$", "")
        axis.set_ylabel(f"[{unit}]" if unit else "")
    axes[-1].set_xlabel("row")
    return figure
