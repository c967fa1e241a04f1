"""Charts that a reader can zoom: panels over one x axis, with their numbers embedded, and a still picture of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from markupsafe import Markup

from experiments.page.figure_files import image_of
from experiments.page.numbers import number
from experiments.page.packed import ends_of_stretches, packed_series, stretch_length
from experiments.page.panels import Curve, Panel
from experiments.page.scripting import data_block
from experiments.page.still import DAYS, still_picture
from plant.arrays import Array

MOST_DRAWN = 200_000
"""Largest number of values of a series stored in a page [count], which is 20 s at 10 kHz. For a longer series, the page
stores the minimum and maximum of each interval."""


@dataclass(frozen=True, eq=False)
class Charts:
    """Panels over one x axis.

    Parameters
    ----------
    x : ndarray, shape (n,)
        Positions of the values, rising [unit of the label].
    label : str
        Label of the x axis, with its unit.
    file : str
        File name of a download, without suffix.
    group : str
        Name of a group of charts that zoom together.
    log : bool
        Whether the x axis is logarithmic; all positions must then be above zero.
    dates : bool
        Whether positions are dates, in days since 1970-01-01.
    """

    x: Array
    label: str
    panels: Sequence[Panel]
    file: str
    group: str = "time"
    log: bool = False
    dates: bool = False

    def html(self, name: str, caption: str) -> Markup:
        """Return the figure with its numbers, their still picture, and a table of their ranges.

        Parameters
        ----------
        name : str
            Anchor of the figure.
        """
        still = Markup('<div class="still">{}</div>').format(
            image_of(still_picture(self.x, self.label, self.panels, log=self.log, dates=self.dates), caption)
        )
        body = Markup('<script type="application/json" class="numbers">{}</script>').format(self._json())
        said = Markup('<figure class="charts" id="figure-{}">{}<figcaption>{}</figcaption>{}{}</figure>')
        return said.format(name, still, caption, self._table(), body)

    def _json(self) -> Markup:
        count = len(self.x)
        length = stretch_length(count, MOST_DRAWN)
        found = {
            "x": {
                "label": self.label,
                "log": self.log,
                "dates": DAYS if self.dates else False,
                **_places(np.log10(self.x) if self.log else self.x, length),
            },
            "file": self.file,
            "group": self.group,
            "panels": [
                {
                    "label": panel.label,
                    "unit": panel.unit,
                    "marks": [vars(mark) for mark in panel.marks],
                    "bands": [list(band) for band in panel.bands],
                    **({"ends": list(panel.ends)} if panel.ends else {}),
                    "curves": [
                        {"name": one.name, "colour": one.colour, "look": one.look, **_packed_curve(one.values)}
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
            "<details><summary>The range of each curve, as a table</summary>"
            '<div class="scroll" tabindex="0" role="region" aria-label="Ranges of the curves"><table>'
            "<caption>Range of each curve.</caption><thead><tr>{}</tr>"
            "</thead><tbody>{}</tbody></table></div></details>"
        )
        return made.format(head, Markup("\n").join(rows))


_SUMMARY = ("curve", "least", "largest", "mean", "RMS", "unit")


def _summary(curve: Curve) -> list[float | None]:
    there = curve.values[np.isfinite(curve.values)]
    if not len(there):
        return [None] * 4
    return [float(one) for one in (there.min(), there.max(), there.mean(), np.sqrt(np.mean(there**2)))]


def _packed_curve(values: Array) -> Mapping[str, Any]:
    return packed_series(ends_of_stretches(np.asarray(values, dtype=np.float64), MOST_DRAWN))


def _places(x: Array, length: int) -> Mapping[str, Any]:
    """Return the x axis: start and step if it is uniform, else its values."""
    count = len(x)
    step = float(x[-1] - x[0]) / max(count - 1, 1)
    if np.allclose(np.diff(x), step, rtol=1e-3, atol=0.0) and step > 0.0:
        shown = count if length == 1 else 2 * -(-count // length)
        start = float(x[0]) if length == 1 else float(x[0]) + 0.25 * length * step
        return {"start": start, "step": step if length == 1 else 0.5 * length * step, "count": shown}
    return packed_series(x)
