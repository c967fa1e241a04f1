"""The still picture of a chart as SVG. It is written directly, because a plotting library needs 50 ms for one."""

import math
from bisect import bisect_left
from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
from markupsafe import escape

from experiments.page.packed import ends_of_stretches
from experiments.page.panels import COLOURS, Curve, Panel
from experiments.page.style import BLUE
from plant.arrays import Array

MOST_STILL = 1_600
"""Largest number of points of a series in the still picture [count]."""

LEGEND_FROM = 2
"""Number of curves from which a still panel has a legend [count]."""

LOW_ROWS_FROM = 3
"""Number of rows from which each row is lower, so that the picture fills the width of a page [count]."""

ONE_COLUMN = 4
"""Largest number of panels in one column; more are set in two columns, so that they are not tiny on paper [count]."""

WIDTH, LEFT, RIGHT, TOP, BOTTOM, ACROSS, DOWN = 720.0, 66.0, 10.0, 20.0, 38.0, 70.0, 26.0
"""Width of the picture, its margins, and the distances between panels [point]."""

TALL, LOW = 100.0, 72.0
"""Height of a panel, and its height if there are at least `LOW_ROWS_FROM` rows [point]."""

LETTER = 4.6
"""Mean width of a letter in a legend [point]."""

MOST_ACROSS, MOST_UP = 8, 4
"""Largest number of steps between ticks on the x and y axes [count]."""

TICK_STEPS = (0.1, 0.2, 0.25, 0.5, 1.0, 2.0, 2.5, 5.0, 10.0, 20.0)
"""Distances between ticks, times a power of ten [dimensionless]."""

DATE_WIDE = 70.0
"""Smallest distance between two dates on an axis [point]."""

DAYS = (1, 2, 7, 14, 28, 56, 91, 182, 365, 730, 1825, 3650)
"""Distances between ticks of a date axis, here and in a browser [day]."""

FEW_DECADES = 2.5
"""Range below which a logarithmic axis also has ticks between the powers of ten [decade]."""

EDGE = 1e-9
"""A tick this close outside the end of an axis still counts as on it, as a share of a step [fraction]."""

ROOM = 0.05
"""Margin above and below the data, as a share of their range [fraction]."""

STYLE = (
    "text{font:8.5px 'DejaVu Sans',Verdana,sans-serif;fill:#000}.grid{stroke:#e3e3e3;stroke-width:.6}"
    ".frame{stroke:#000;stroke-width:.8;fill:none}.mark{stroke:#d55e00;stroke-width:1.1;stroke-dasharray:4 2}"
    ".told{fill:#b04a00}"
    ".line{fill:none;stroke-linejoin:round}.dots{fill:none;stroke-linecap:round;stroke-width:3.4}"
)

STROKES: Mapping[str, str] = {"dots": 'class="dots"', "edge": 'class="line" stroke-width=".4"'}
"""SVG attributes of a curve, by its look; any other look is a plain line."""


def still_picture(x: Array, label: str, panels: Sequence[Panel], *, log: bool = False, dates: bool = False) -> bytes:
    """Return the picture as an SVG file.

    Parameters
    ----------
    x : ndarray, shape (n,)
        Positions of the values, rising [unit of the label].
    label : str
        Label of the x axis, with its unit.
    panels : sequence of Panel
        From the top; two per row if there are more than `ONE_COLUMN`.
    log : bool
        Whether the x axis is logarithmic.
    dates : bool
        Whether positions are dates, in days since 1970-01-01.
    """
    places = np.log10(x) if log else x
    columns = 1 if len(panels) <= ONE_COLUMN else 2
    rows = -(-len(panels) // columns)
    high = TALL if rows < LOW_ROWS_FROM else LOW
    wide = (WIDTH - LEFT - RIGHT - (columns - 1) * ACROSS) / columns
    height = TOP + rows * high + (rows - 1) * DOWN + BOTTOM
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH:g}pt" height="{height:g}pt" '
        f'viewBox="0 0 {WIDTH:g} {height:g}"><style>{STYLE}</style><rect width="100%" height="100%" fill="#fff"/>'
    ]
    for place, panel in enumerate(panels):
        row, column = divmod(place, columns)
        corner = f"{LEFT + column * (wide + ACROSS):g} {TOP + row * (high + DOWN):g}"
        last = place >= len(panels) - columns
        parts.append(f'<g transform="translate({corner})">')
        parts.extend(_panel(places, panel, (wide, high), f"p{place}", label if last else "", log=log, dates=dates))
        parts.append("</g>")
    return "".join([*parts, "</svg>"]).encode()


def _panel(
    x: Array, panel: Panel, size: tuple[float, float], name: str, label: str, *, log: bool, dates: bool
) -> Iterator[str]:
    wide, high = size
    across, up = _range(x, 0.0), panel.ends or _range(_all_values(panel), ROOM)
    places = (x - across[0]) * (wide / (across[1] - across[0]))
    scale = high / (up[1] - up[0])

    def heights(values: Array) -> Array:
        return high - (values - up[0]) * scale

    yield f'<clipPath id="{name}"><path d="M0 -2H{wide:g}V{high + 2:g}H0z"/></clipPath>'
    for tick, words in _days(*across, wide) if dates else _decades(*across) if log else _ticks(*across, MOST_ACROSS):
        at = (tick - across[0]) * wide / (across[1] - across[0])
        yield f'<path class="grid" d="M{at:.1f} 0V{high:g}"/>'
        yield f'<text x="{at:.1f}" y="{high + 11:g}" text-anchor="middle">{words}</text>'
    for tick, words in _ticks(*up, MOST_UP):
        at = high - (tick - up[0]) * scale
        yield f'<path class="grid" d="M0 {at:.1f}H{wide:g}"/>'
        yield f'<text x="-4" y="{at + 3:.1f}" text-anchor="end">{words}</text>'
    yield f'<g clip-path="url(#{name})">'
    for upper, lower in panel.bands:
        edges = [
            (places, heights(panel.curves[upper].values)),
            (places[::-1], heights(panel.curves[lower].values[::-1])),
        ]
        outline = _points(*np.concatenate(edges, axis=1))
        yield f'<polygon points="{outline}" fill="{BLUE}" fill-opacity=".15"/>'
    for curve in panel.curves:
        yield _curve(curve, places, heights)
    for mark in panel.marks:
        along = (_place(mark.at, mark.axis, log) - across[0]) * wide / (across[1] - across[0])
        line = f"M{along:.1f} 0V{high:g}" if mark.axis == "x" else f"M0 {high - (mark.at - up[0]) * scale:.1f}H{wide:g}"
        yield f'<path class="mark" d="{line}"/>'
    for mark in panel.marks:
        along = (_place(mark.at, mark.axis, log) - across[0]) * wide / (across[1] - across[0])
        left, top = (along + 3.0, 7.0) if mark.axis == "x" else (wide - 2.0, high - (mark.at - up[0]) * scale - 3.0)
        anchor = "start" if mark.axis == "x" else "end"
        yield f'<text class="told" x="{left:.1f}" y="{top:.1f}" text-anchor="{anchor}">{escape(mark.words)}</text>'
    yield f'</g><path class="frame" d="M0 0V{high:g}H{wide:g}"/>'
    for words, shift in ((panel.label, 48.0), (f"[{panel.unit}]", 38.0)):
        turned = f'transform="translate({-shift:g} {high / 2:g}) rotate(-90)"'
        yield f'<text {turned} text-anchor="middle">{escape(words)}</text>'
    if label:
        yield f'<text x="{wide / 2:g}" y="{high + 25:g}" text-anchor="middle">{escape(label)}</text>'
    if len(panel.curves) >= LEGEND_FROM:
        yield from _legend([curve for curve in panel.curves if curve.look != "edge"], wide)  # captions explain bands


def _place(at: float, axis: str, log: bool) -> float:
    """Return the position of a mark on its axis."""
    return math.log10(at) if log and axis == "x" else at


def _curve(curve: Curve, places: Array, heights: Callable[[Array], Array]) -> str:
    values = ends_of_stretches(np.asarray(curve.values, dtype=np.float64), MOST_STILL)
    along = np.interp(np.linspace(0.0, 1.0, len(values)), np.linspace(0.0, 1.0, len(places)), places)
    stroke = STROKES.get(curve.look, 'class="line" stroke-width=".9"')
    path = _path(along, heights(values), dots=curve.look == "dots")
    return f'<path {stroke} stroke="{COLOURS[curve.colour]}" d="{path}"/>'


def _path(x: Array, y: Array, *, dots: bool) -> str:
    """Return a path with breaks at missing values; dots are strokes of zero length."""
    said: list[str] = []
    down = False
    for one, other in zip(x.tolist(), y.tolist(), strict=True):
        if not math.isfinite(other):
            down = False
            continue
        said.append(f"{'L' if down else 'M'}{one:.1f} {other:.1f}{'h0' if dots else ''}")
        down = not dots
    return "".join(said)


def _points(x: Array, y: Array) -> str:
    there = np.isfinite(y)
    return " ".join(f"{one:.1f},{other:.1f}" for one, other in zip(x[there].tolist(), y[there].tolist(), strict=True))


def _all_values(panel: Panel) -> Array:
    """Return all values of a panel, and the positions of lines across it."""
    lines = [mark.at for mark in panel.marks if mark.axis == "y"]
    return np.concatenate([np.asarray(lines, dtype=np.float64), *(curve.values for curve in panel.curves)])


PLAIN_TO = 1e5
"""Size below which a number on an axis is written without a power of ten [any unit]."""

LEAST_SIZE = 1e-290
"""Size below which a constant channel is drawn as zero [any unit]."""


def _range(values: Array, room: float) -> tuple[float, float]:
    there = values[np.isfinite(values)]
    low, high = (float(there.min()), float(there.max())) if len(there) else (0.0, 1.0)
    if high - low <= 1e-9 * max(abs(low), abs(high), 1e-300):
        half = 0.05 * abs(low) if abs(low) > LEAST_SIZE else 0.5
        return low - half, high + half
    return low - room * (high - low), high + room * (high - low)


def _ticks(low: float, high: float, most: int) -> list[tuple[float, str]]:
    """Return round positions within a range, at least two, with their labels.

    Their distance is the smallest in `TICK_STEPS` that gives at most this many steps; if fewer than two fit, it is
    smaller.
    """
    least = (high - low) / most
    decade = 10.0 ** math.floor(math.log10(least))
    distances = [one * decade for one in TICK_STEPS]
    step, first, last = least, 0, 0
    for step in distances[bisect_left(distances, least) :: -1]:
        first, last = math.ceil(low / step - EDGE), math.floor(high / step + EDGE)
        if last > first:
            break
    within = [place * step for place in range(first, last + 1)]
    largest = max(map(abs, within), default=1.0)
    whole = len(f"{largest:.0f}") if largest < PLAIN_TO else 0
    digits = min(max(math.ceil(math.log10(largest / step + 1e-300)) + 2, 3, whole), 12)
    return [(one, f"{one:.{digits}g}".replace("-", "\N{MINUS SIGN}")) for one in within]


def _days(low: float, high: float, wide: float) -> list[tuple[float, str]]:
    """Return dates within a range of days since 1970-01-01, with their labels, for an axis of this width [point]."""
    step = next((one for one in DAYS if (high - low) / one <= wide / DATE_WIDE), DAYS[-1])
    within = np.arange(step * math.ceil(low / step - EDGE), high + EDGE * step, step, dtype=np.float64)
    return [(float(one), str(np.datetime64(round(one), "D"))) for one in within]


def _decades(low: float, high: float) -> list[tuple[float, str]]:
    """Return the powers of ten within a range of logarithms, and also 2 and 5 times these if there are few."""
    steps = (1.0, 2.0, 5.0) if high - low < FEW_DECADES else (1.0,)
    within = [one * 10.0**power for power in range(math.floor(low), math.ceil(high) + 1) for one in steps]
    return [(math.log10(one), f"{one:g}") for one in within if low - EDGE <= math.log10(one) <= high + EDGE]


def _legend(curves: Sequence[Curve], wide: float) -> Iterator[str]:
    """Yield the names of the curves, placed above a panel where they hide no data, the last at the right."""
    at = wide
    for curve in reversed(curves):
        at -= LETTER * len(curve.name)
        yield f'<text x="{at:.1f}" y="-5">{escape(curve.name)}</text>'
        at -= 18.0
        yield f'<path stroke="{COLOURS[curve.colour]}" stroke-width="2" d="M{at:.1f} -8h14"/>'
        at -= 12.0
