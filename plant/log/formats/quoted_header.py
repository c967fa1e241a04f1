"""Headers whose quoted names go over several lines, as spreadsheets write a cell with a line break."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from plant.log.formats.csv_layout import Layout

UNNAMED = "column "
"""How the name of a column without a name begins."""


def with_quoted_header(
    layout: "Layout", lines: Sequence[str], layout_of_lines: Callable[[Sequence[str]], "Layout"]
) -> "Layout":
    """Return the layout of a log with its header's names, if these go over several lines.

    Parameters
    ----------
    layout : Layout
        As if each line were complete.
    lines : sequence of str
        The first lines of the log.
    layout_of_lines : callable
        From lines to their layout.
    """
    joined = _joined(lines[: layout.skipped])
    if joined is None:
        return layout
    made = layout_of_lines([*joined, *lines[layout.skipped :]])
    if len(made.headings) != len(layout.headings) or any(one.name.startswith(UNNAMED) for one in made.headings):
        return layout
    return replace(made, skipped=made.skipped + layout.skipped - len(joined))


def _joined(lines: Sequence[str]) -> list[str] | None:
    """Return lines with those in which a quote is open put in one; None if there are none, or the last stays open."""
    out: list[str] = []
    is_open = False
    for line in lines:
        if is_open:
            out[-1] += f" {line}"
        else:
            out.append(line)
        is_open ^= bool(line.count('"') % 2)
    return None if is_open or len(out) == len(lines) else out
