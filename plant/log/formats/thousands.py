"""Whole numbers with separators of thousands, which would be read as a thousandth of what they are."""

import re
from collections.abc import Sequence

from plant.errors import LogError

_GROUPED = re.compile(r"[-+\u2212]?[1-9]\d{0,2}[.,]\d{3}")
_SMALL = re.compile(r"[-+\u2212]?\d{1,3}")

LEAST = 30
"""Cells with a separator from which a column may be judged [count]: decimals of as many would not all be three."""


def groups_thousands(cells: Sequence[str]) -> bool:
    """Return whether a column holds whole numbers such as 998 and 1,002.

    Decimals leave other counts of digits behind the comma, or a zero before it.

    Parameters
    ----------
    cells : sequence of str
        Numbers of a column, as text.

    Examples
    --------
    >>> groups_thousands(["998", "1,002"] * 40), groups_thousands(["0", "0,998", "1,002"] * 40)
    (True, False)
    """
    parted = [cell for cell in cells if not _SMALL.fullmatch(cell)]
    return LEAST <= len(parted) < len(cells) and all(map(_GROUPED.fullmatch, parted))


def require_ungrouped(rows: Sequence[Sequence[str]], names: Sequence[str], source: str) -> None:
    """Refuse rows in which a column of numbers has separators of thousands.

    Parameters
    ----------
    rows : sequence of sequence of str
        Cells, all rows as wide as there are names.
    names : sequence of str
        What the columns are called.
    source : str
        What messages call the log.

    Raises
    ------
    LogError
        If a column does, by its name.
    """
    for place, name in enumerate(names):
        cells = [row[place] for row in rows if row[place]]
        if groups_thousands(cells):
            shown = next(cell for cell in cells if not _SMALL.fullmatch(cell))
            raise LogError(
                f"column {name[:80]!r} has separators of thousands, as in {shown!r}, which cannot be told from "
                "decimals everywhere; write the log without them",
                source,
            )
