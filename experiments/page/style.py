"""Common style of all figures: Okabe-Ito colours, small type, no state outside the figure itself."""

from collections.abc import Generator, Iterable, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from experiments.page.words import condition_in_words

if TYPE_CHECKING:  # imports take half a second, and a page without figures does not need them
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
BLUE, VERMILION, PURPLE = "#0072B2", "#D55E00", "#CC79A7"
"""Okabe-Ito palette, which colour-blind readers can tell apart."""

GREY = "#6b6b6b"
"""Colour of background elements."""

WIDTH_INCHES = 10.0
"""Width of every figure; the report shows them at about the same size."""

STYLE = Path(__file__).with_name("hydrostate.mplstyle")
"""Type, lines and grid of every figure, as a matplotlib style file."""


@contextmanager
def project_style() -> Generator[None]:
    """Apply the project's style to figures drawn and saved inside this block."""
    from matplotlib import style

    with style.context(STYLE):
        yield


@dataclass(frozen=True)
class Margins:
    """Space around and between panels. It is fixed, since computing it for each figure takes as long as drawing.

    Parameters
    ----------
    left, right, top, bottom : float
        Distance from the figure's edge to the outer panels [inch].
    across, down : float
        Between panels side by side, and one above the other [inch].
    """

    left: float = 0.6
    right: float = 0.1
    top: float = 0.55
    bottom: float = 0.5
    across: float = 0.2
    down: float = 0.3


BESIDE_CONDITIONS = Margins(left=2.0, top=0.4)
"""Margins with space for the names of conditions on the left."""


def panels(
    title: str, rows: int, columns: int, height_inches: float, margins: Margins, **options: Any
) -> "tuple[Figure, list[Axes]]":
    """Return a titled figure and its axes, row by row.

    Parameters
    ----------
    height_inches : float
        Height [inch].
    **options : Any
        Passed to `matplotlib.figure.Figure.subplots`: shared axes, ratios.

    Returns
    -------
    tuple of Figure and list of Axes
        The figure, and its axes in reading order.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH_INCHES, height_inches))
    figure.suptitle(title, x=0.01, y=1.0 - 0.08 / height_inches, ha="left", va="top")
    width = (WIDTH_INCHES - margins.left - margins.right - (columns - 1) * margins.across) / columns
    height = (height_inches - margins.top - margins.bottom - (rows - 1) * margins.down) / rows
    placed = {
        "left": margins.left / WIDTH_INCHES,
        "right": 1.0 - margins.right / WIDTH_INCHES,
        "top": 1.0 - margins.top / height_inches,
        "bottom": margins.bottom / height_inches,
        "wspace": margins.across / width,
        "hspace": margins.down / height,
    }
    axes = figure.subplots(rows, columns, squeeze=False, gridspec_kw=placed, **options)
    return figure, [axis for row in axes for axis in row]


def condition_rows(axis: "Axes", conditions: Sequence[str]) -> Mapping[str, float]:
    """Place conditions on the vertical axis, the first at the top, and return their positions.

    Parameters
    ----------
    conditions : sequence of str
        Names as in results, from the top.

    Returns
    -------
    Mapping[str, float]
        Height of each condition's row [count].
    """
    heights = {name: float(len(conditions) - 1 - place) for place, name in enumerate(conditions)}
    axis.set_yticks(list(heights.values()), [condition_in_words(name) for name in conditions])
    axis.set_ylim(-0.6, len(conditions) - 0.4)
    axis.tick_params(axis="y", length=0)
    axis.grid(visible=False, axis="y")
    return heights


def condition_levels(axis: "Axes", conditions: Iterable[str]) -> NDArray[np.float64]:
    """Place the conditions of a table on the vertical axis, the first at the top, and return the position of each row.

    Parameters
    ----------
    conditions : iterable of str
        Names as in results, one per row.

    Returns
    -------
    ndarray, shape (n,)
        Height of each row [count].
    """
    names = list(conditions)
    heights = condition_rows(axis, list(dict.fromkeys(names)))
    return np.array([heights[name] for name in names])


def spread_offsets(count: int, span: float) -> list[float]:
    """Return offsets that separate the marks of one row.

    Parameters
    ----------
    span : float
        Distance between the first and the last offset [any unit].

    Returns
    -------
    list of float
        Offsets around zero, in the span's unit.

    Examples
    --------
    >>> spread_offsets(3, 0.4)
    [0.2, 0.0, -0.2]
    """
    if count == 1:
        return [0.0]
    return [float(offset) for offset in np.linspace(0.5 * span, -0.5 * span, count)]
