"""Panels of a chart: curves of one unit over an x axis, and lines across them."""

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
"""Names of colours: a page's style gives each a value for a light and for a dark ground; here that on paper."""


@dataclass(frozen=True, eq=False)
class Curve:
    """One curve.

    Parameters
    ----------
    values : ndarray, shape (n,)
        One a place on the x axis [the panel's unit]; NaN is missing.
    colour : str
        Of `COLOURS`.
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
        ``"x"`` or ``"y"``: the axis on which it stands.
    at : float
        Where [that axis' unit].
    """

    axis: str
    at: float
    words: str


@dataclass(frozen=True, eq=False)
class Panel:
    """Curves of one unit.

    Parameters
    ----------
    bands : sequence of tuple
        Places of two curves, the upper and the lower, between which it is shaded.
    ends : tuple of float, optional
        Ends of the y axis [its unit]; by default those of all that is drawn.
    """

    label: str
    unit: str
    curves: Sequence[Curve]
    marks: Sequence[Mark] = ()
    bands: Sequence[tuple[int, int]] = ()
    ends: tuple[float, float] | None = None
