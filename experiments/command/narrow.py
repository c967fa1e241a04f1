"""Tables on a terminal that is too narrow: each row becomes several lines, so that no number or verdict is cut off."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.table import Table

MOST_WORD = 20
"""Longest word that stays whole in a text column [characters], judged: longer file names are folded."""

FRAME = 3
"""Width that a column needs in addition to its cells: a space on each side and the border [characters]."""


def fit_to_width(shown: "Table", width: int) -> "Table | None":
    """Return a table that fits the width of the terminal; headings of number columns are folded if necessary.

    Parameters
    ----------
    shown : rich.table.Table
        The table; number columns are those that may not wrap.
    width : int
        Width of the terminal [characters].

    Returns
    -------
    rich.table.Table or None
        The table; None if numbers would be cut off, or words would be broken.
    """
    if not _fits(shown, width):
        for column, (cells, whole) in zip(shown.columns, _columns(shown), strict=True):
            if whole:
                column.header = _folded_heading(cells[0], max(map(_width, cells[1:]), default=0))
    return shown if _fits(shown, width) else None


def as_lines(shown: "Table") -> str:
    """Return a table as lines: the first cell of each row, and below it one line per further cell with its heading.

    Returns
    -------
    str
        Lines of any length, with an empty line after each row; empty cells are left out.

    Examples
    --------
    >>> from experiments.command.terminal import table
    >>> shown = table("log", "bulk modulus [MPa]", "verdict")
    >>> shown.add_row("run.csv", "206.0", "ok")
    >>> print(as_lines(shown))
    run.csv
      bulk modulus [MPa]   206.0
      verdict              ok
    """
    (_, *headings), *rows = [list(one) for one in zip(*(cells for cells, _ in _columns(shown)), strict=True)]
    headings = [" ".join(heading.split()) for heading in headings]
    longest = max(map(len, headings), default=0)
    below = "\n" + " " * (longest + 5)
    parts = [] if shown.title is None else [str(shown.title)]
    for first, *cells in rows:
        named = zip(headings, cells, strict=True)
        lines = (f"  {heading:{longest}}   {cell}".rstrip().replace("\n", below) for heading, cell in named if cell)
        parts.append("\n".join([first, *lines]))
    return "\n\n".join(parts)


def _fits(shown: "Table", width: int) -> bool:
    return sum(_least_width(*column) for column in _columns(shown)) + FRAME * len(shown.columns) + 1 <= width


def _columns(shown: "Table") -> list[tuple[list[str], bool]]:
    """Return heading and cells of each column, and whether its cells must stay whole."""
    return [([str(column.header), *map(str, column.cells)], column.no_wrap) for column in shown.columns]


def _least_width(cells: list[str], whole: bool) -> int:
    """Return the smallest width of a column [characters]."""
    if whole:
        return max(map(_width, cells))
    return max((min(_width(word), MOST_WORD) for cell in cells for word in cell.split()), default=0)


def _width(text: str) -> int:
    from rich.cells import cell_len

    return max(map(cell_len, text.split("\n")))


def _folded_heading(heading: str, width: int) -> str:
    """Return a heading folded to the width of the cells below it, or of its longest word."""
    import textwrap

    return "\n".join(textwrap.wrap(heading, max([width, *map(len, heading.split())]), break_on_hyphens=False))
