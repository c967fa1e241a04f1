"""Drawing functions shared by several figures."""

from collections.abc import Hashable, Iterable, Iterator, Sequence
from typing import Any, TypeAlias

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from experiments.page.style import BLACK, ORANGE

Colour: TypeAlias = str | tuple[float, ...]


def label_point(
    axis: Axes, words: str, at: tuple[float, float], shift: tuple[float, float] = (0.0, 0.0), **look: Any
) -> None:
    """Write text beside a point.

    Parameters
    ----------
    at : tuple of float
        The point [axes' units].
    shift : tuple of float
        Offset of the text from the point, in points of type [unit of fonts].
    **look : Any
        Passed to `matplotlib.axes.Axes.annotate`.
    """
    axis.annotate(words, at, shift, textcoords="offset points", **look)


def draw_published(axis: Axes, x: Any, y: Any, label: str | None = None) -> None:
    """Mark published values.

    Parameters
    ----------
    x, y : float or sequence of float
        The points [axes' units]; empty for an entry in the legend only.
    label : str, optional
        For the legend.
    """
    axis.plot(x, y, "D", color=ORANGE, markeredgecolor=BLACK, markersize=7, label=label)


def with_colours(groups: Iterable[tuple[Hashable, Any]], last: float = 0.7) -> Iterator[tuple[float, Any, Colour]]:
    """Assign colours to a series of curves, from dark to light.

    Parameters
    ----------
    groups : iterable of tuple
        For each curve its value and its rows, as from `groupby`.
    last : float
        Lightest colour used, between 0 and 1 [dimensionless]; lighter ones are unreadable on white, or on black if
        reversed.

    Yields
    ------
    tuple
        Value, rows, colour.
    """
    curves = list(groups)
    for (value, rows), shade in zip(curves, np.linspace(0.0, last, len(curves)), strict=True):
        yield float(str(value)), rows, mpl.colormaps["viridis"](shade)


def named_rows(axis: Axes, names: Sequence[str]) -> "np.ndarray[Any, np.dtype[np.int_]]":
    """Place names on the vertical axis, the first at the bottom, and return their positions.

    Returns
    -------
    ndarray of int, shape (n,)
        Height of each name's row [count].
    """
    places = np.arange(len(names))
    axis.set_yticks(places, names)
    axis.grid(visible=False, axis="y")
    return places


def draw_paired_bars(axis: Axes, names: Sequence[str], pairs: Sequence[tuple[str, pd.Series, Colour]]) -> None:
    """Draw two bars for each name, to the right and to the left of zero.

    Parameters
    ----------
    pairs : sequence of tuple
        Label, lengths [axis' unit] and colour of the upper bars, and of the lower ones.
    """
    places = named_rows(axis, names)
    for (label, lengths, colour), beside in zip(pairs, (0.2, -0.2), strict=True):
        axis.barh(places + beside, lengths, 0.38, color=colour, label=label)
    axis.axvline(0.0, color=BLACK, linewidth=0.8)


Course: TypeAlias = tuple[tuple[str, float], Sequence[tuple[str, Colour, str]]]
"""One panel over time: axis label and factor to its unit, columns with colour and label."""


def draw_courses(
    axes: Sequence[Axes], time: pd.Series, frame: pd.DataFrame, panels: Sequence[Course], room: float
) -> None:
    """Draw signals over a common time axis, one panel for each unit, with space for a legend above the curves.

    Parameters
    ----------
    axes : sequence of Axes
        One for each panel, from the top.
    panels : sequence of Course
        Contents of each panel [its label's unit].
    room : float
        Ratio of the legend's height to that of the curves [dimensionless].
    """
    for axis, ((label, scale), columns) in zip(axes, panels, strict=True):
        for column, colour, words in columns:
            axis.plot(time, scale * frame[column], color=colour, label=words)
        low, high = axis.get_ylim()
        axis.set(ylabel=label, ylim=(low, high + room * (high - low)))
        axis.legend(loc="upper right", ncols=4)
    axes[-1].set(xlabel="time [ms]", xlim=(0.0, float(time.max())))
