"""Figures that are drawn from named tables, and the files that they become."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from io import BytesIO

import pandas as pd
from matplotlib.figure import Figure

from experiments.figures.style import styled

Tables = Mapping[str, pd.DataFrame]

PNG_DOTS_PER_INCH = 150
"""Resolution of the PNG figures; 1500 pixels wide."""


@dataclass(frozen=True)
class TableFigure:
    """One figure of a report.

    Parameters
    ----------
    heading : str
        What it shows.
    caption : str
        What to look at.
    draw : callable
        From the tables to the figure.
    """

    heading: str
    caption: str
    draw: Callable[[Tables], Figure]


def figure_files(kinds: Mapping[str, TableFigure], tables: Tables) -> Mapping[str, Mapping[str, bytes]]:
    """Return figures as files.

    Parameters
    ----------
    kinds : Mapping[str, TableFigure]
        The figures, by name.
    tables : Mapping[str, pandas.DataFrame]
        What they are drawn from.

    Returns
    -------
    Mapping[str, Mapping[str, bytes]]
        By format, ``svg`` and ``png``, then by name.
    """
    files: dict[str, dict[str, bytes]] = {"svg": {}, "png": {}}
    with styled():
        for name, kind in kinds.items():
            figure = kind.draw(tables)
            vector, pixels = BytesIO(), BytesIO()
            figure.savefig(vector, format="svg", metadata={"Date": None})
            figure.savefig(pixels, format="png", dpi=PNG_DOTS_PER_INCH)
            files["svg"][name], files["png"][name] = vector.getvalue(), pixels.getvalue()
    return files
