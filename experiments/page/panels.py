"""Panels of a chart: curves with a common unit over an x axis, and lines across them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from experiments.page.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, VERMILION
from plant.arrays import Array

COLOURS: Mapping[str, str] = {
    "blue": BLUE,
    "orange": ORANGE,
    "green": GREEN,
    "vermilion": VERMILION,
    "purple": PURPLE,
    "grey": GREY,
    "black": BLACK,
}
"""Colours on paper, by name; a page's style gives each name a value for a light and a dark background."""


@dataclass(frozen=True, eq=False)
class Curve:
    """One curve.

    Parameters
    ----------
    values : ndarray, shape (n,)
        One for each position on the x axis [the panel's unit]; NaN is missing.
    colour : str
        A name in `COLOURS`.
    look : str
        ``"line"``, ``"dots"``, or ``"edge"`` for the edge of a band.
    """

    name: str
    values: Array
    colour: str = "blue"
    look: str = "line"


@dataclass(frozen=True)
class Mark:
    """A dashed line across a panel.

    Parameters
    ----------
    axis : str
        ``"x"`` or ``"y"``: the axis on which its position is given.
    at : float
        Position [that axis' unit].
    """

    axis: str
    at: float
    words: str


@dataclass(frozen=True, eq=False)
class Panel:
    """Curves with a common unit.

    Parameters
    ----------
    bands : sequence of tuple
        Pairs of curve indices, the upper and the lower, between which the area is shaded.
    ends : tuple of float, optional
        Ends of the y axis [its unit]; by default the range of all that is drawn.
    """

    label: str
    unit: str
    curves: Sequence[Curve]
    marks: Sequence[Mark] = ()
    bands: Sequence[tuple[int, int]] = ()
    ends: tuple[float, float] | None = None
