"""Charts that a reader zooms: panels over one x axis, their numbers inside the page, and a still picture of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.page.figure_files import image_of
from experiments.page.numbers import number
from experiments.page.packed import ends_of_stretches, packed, stretch_length
from experiments.page.scripting import data_block
from experiments.page.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, VERMILION, Margins, panels, styled
from plant.arrays import Array

MOST_DRAWN = 200_000
"""A longer series is carried as the ends of so many half stretches [count]: 20 s at 10 kHz are carried whole."""

MOST_STILL = 1_600
"""Points of a series in the still picture [count]."""

LEGEND_FROM = 2
"""Curves from which a still panel has a legend [count]."""

LOW_FROM = 3
"""Rows of a still picture from which each is lower, so that the picture fills the width of a page [count]."""

ONE_COLUMN = 4
"""Panels of a still picture in one column; more stand in two, so that they are not tiny on paper [count]."""

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
    """

    label: str
    unit: str
    curves: Sequence[Curve]
    marks: Sequence[Mark] = ()
    bands: Sequence[tuple[int, int]] = ()


@dataclass(frozen=True, eq=False)
class Charts:
    """Panels over one x axis.

    Parameters
    ----------
    x : ndarray, shape (n,)
        Places of the values, rising [unit of the label].
    label : str
        Of the x axis, with its unit.
    file : str
        What a download is called, without suffix.
    group : str
        Charts of one group zoom together.
    """

    x: Array
    label: str
    panels: Sequence[Panel]
    file: str
    group: str = "time"

    def html(self, name: str, caption: str) -> Markup:
        """Return the figure with its numbers, the still picture of them, and a table of their ranges.

        Parameters
        ----------
        name : str
            Anchor of the figure.
        """
        still = Markup('<div class="still">{}</div>').format(image_of(self._still(), caption))
        body = Markup('<script type="application/json" class="numbers">{}</script>').format(self._json())
        said = Markup('<figure class="charts" id="figure-{}">{}<figcaption>{}</figcaption>{}{}</figure>')
        return said.format(name, still, caption, self._table(), body)

    def _json(self) -> Markup:
        count = len(self.x)
        length = stretch_length(count, MOST_DRAWN)
        found = {
            "x": {"label": self.label, **_places(self.x, length)},
            "file": self.file,
            "group": self.group,
            "panels": [
                {
                    "label": panel.label,
                    "unit": panel.unit,
                    "marks": [vars(mark) for mark in panel.marks],
                    "bands": [list(band) for band in panel.bands],
                    "curves": [
                        {"name": one.name, "colour": one.colour, "look": one.look, **_carried(one.values)}
                        for one in panel.curves
                    ],
                }
                for panel in self.panels
            ],
        }
        return data_block(found)

    def _table(self) -> Markup:
        rows = [
            Markup('<tr><th scope="row">{}, {}</th>{}<td>{}</td></tr>').format(
                panel.label,
                curve.name,
                Markup("").join(Markup('<td class="number">{}</td>').format(number(end)) for end in _summary(curve)),
                panel.unit,
            )
            for panel in self.panels
            for curve in panel.curves
        ]
        head = Markup("").join(Markup('<th scope="col">{}</th>').format(one) for one in _SUMMARY)
        made = Markup(
            "<details><summary>The curves as a table</summary>"
            '<div class="scroll" tabindex="0" role="region" aria-label="Ranges of the curves"><table><thead><tr>{}</tr>'
            "</thead><tbody>{}</tbody></table></div></details>"
        )
        return made.format(head, Markup("\n").join(rows))

    def _still(self) -> Figure:
        with styled():
            columns = 1 if len(self.panels) <= ONE_COLUMN else 2
            rows = -(-len(self.panels) // columns)
            margins = Margins(left=0.9, top=0.25, across=0.9, down=0.35)
            figure, axes = panels(
                "", rows, columns, 0.85 + (1.55 if rows < LOW_FROM else 1.05) * rows, margins, sharex=True
            )
            for axis, panel in zip(axes, self.panels, strict=False):
                _draw_panel(axis, self.x, panel)
            for axis in axes[len(self.panels) :]:
                axis.set_visible(False)
            for axis in axes[len(self.panels) - columns : len(self.panels)]:
                axis.set_xlabel(self.label)
                axis.tick_params(labelbottom=True)
        return figure


_SUMMARY = ("curve", "least", "largest", "mean", "RMS", "unit")


def _summary(curve: Curve) -> list[float | None]:
    there = curve.values[np.isfinite(curve.values)]
    if not len(there):
        return [None] * 4
    return [float(one) for one in (there.min(), there.max(), there.mean(), np.sqrt(np.mean(there**2)))]


def _carried(values: Array) -> Mapping[str, Any]:
    return packed(ends_of_stretches(np.asarray(values, dtype=np.float64), MOST_DRAWN))


def _places(x: Array, length: int) -> Mapping[str, Any]:
    """Return the x axis: start and step where it is uniform, else its values."""
    count = len(x)
    step = float(x[-1] - x[0]) / max(count - 1, 1)
    if np.allclose(np.diff(x), step, rtol=1e-3, atol=0.0) and step > 0.0:
        shown = count if length == 1 else 2 * -(-count // length)
        start = float(x[0]) if length == 1 else float(x[0]) + 0.25 * length * step
        return {"start": start, "step": step if length == 1 else 0.5 * length * step, "count": shown}
    return packed(x)


def _draw_panel(axis: Axes, x: Array, panel: Panel) -> None:
    for upper, lower in panel.bands:
        axis.fill_between(x, panel.curves[upper].values, panel.curves[lower].values, color=BLUE, alpha=0.15, lw=0)
    for curve in panel.curves:
        values = ends_of_stretches(np.asarray(curve.values, dtype=np.float64), MOST_STILL)
        places = np.interp(np.linspace(0.0, 1.0, len(values)), np.linspace(0.0, 1.0, len(x)), x)
        dots = curve.look == "dots"
        look: Any = {"ls": "none", "marker": "o", "ms": 3} if dots else {"lw": 0.4 if curve.look == "edge" else 0.9}
        axis.plot(places, values, color=COLOURS[curve.colour], label=curve.name, **look)
    for mark in panel.marks:
        draw = axis.axvline if mark.axis == "x" else axis.axhline
        draw(mark.at, color=VERMILION, ls="--", lw=1.1)
    axis.set_ylabel(f"{panel.label}\n[{panel.unit}]")
    if len(panel.curves) >= LEGEND_FROM:
        # above the panel, where it hides no data
        axis.legend(loc="lower right", bbox_to_anchor=(1.0, 0.98), borderaxespad=0.1, ncols=4, fontsize=7.5)
