"""Charts of an identified model: the log with its free run, the residual, the step response, the Bode diagram."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from estimation.arrays import Array, BoolArray, ComplexArray, IntArray
from estimation.finding import NORMAL_95
from estimation.identification.fit.residual_tests import DEFAULT_LAGS, correlations
from estimation.identification.model.step_response import step_response
from estimation.identification.signals.automatic_window import automatic_response
from estimation.identification.signals.measured_response import measured_response
from experiments.log_pages.identified_view import AS_LOGGED, IdentifiedView
from experiments.page.charts import Charts
from experiments.page.numbers import number
from experiments.page.panels import Curve, Mark, Panel
from plant.errors import HydrostateError

MOST_LOCAL = 20_000
"""Longest log whose response is measured at each frequency line [count]; for a longer log a smoothed response is
computed, which is faster."""

LEAST_STEPS = 50
"""Smallest number of samples of a step response [count]."""

TIME_CONSTANTS = 6.0
"""Length of a step response in time constants of the slowest pole [dimensionless]."""

A_DECADE, MOST_DECADES = 60, 5.0
"""Largest number of frequencies drawn per decade, and of decades below half the sample rate."""

PER_DECADE = 10
"""Intervals per decade in which the measured response is judged [count]."""

LARGEST_KNOWN_RADIUS = 0.5
"""Largest ratio of the 95 % circle's radius to the gain at which an interval counts as known [fraction], judged."""

COLOURS = ("blue", "vermilion", "green", "purple", "orange", "grey")
"""Colours of the inputs, in their order."""


@dataclass(frozen=True, eq=False)
class MeasuredCurve:
    """The frequency response measured from the log itself.

    Parameters
    ----------
    frequency : ndarray, shape (k,)
        In rising order [Hz].
    response : ndarray of complex, shape (k,)
        In the log's units.
    radius : ndarray, shape (k,)
        Radius of the 95 % circle around each value [the log's units].
    """

    frequency: Array
    response: ComplexArray
    radius: Array

    @cached_property
    def begins(self) -> IntArray:
        """Index at which each interval starts, `PER_DECADE` per decade, shape (s,)."""
        cells = np.floor(PER_DECADE * np.log10(self.frequency))
        return np.flatnonzero(np.diff(cells, prepend=-np.inf))

    @cached_property
    def known(self) -> BoolArray:
        """Whether the log determines the response in each interval, shape (s,).

        This uses the median of the interval: among many lines of pure noise, some are large by chance.
        """
        with np.errstate(divide="ignore", invalid="ignore"):
            relative = self.radius / np.abs(self.response)
        return np.array(
            [np.median(one) <= LARGEST_KNOWN_RADIUS for one in np.split(relative, self.begins[1:])], dtype=np.bool_
        )


def measured_curve(view: IdentifiedView) -> MeasuredCurve | None:
    """Return the response measured from a log with one input; None for several inputs, or if it cannot be measured."""
    if len(view.inputs) > 1:
        return None
    u, y, known = view.u[:, 0], view.y, np.isfinite(view.y)
    if known.all() and y.size <= MOST_LOCAL:
        try:
            one = measured_response(u, y, view.sample_time).response
            return MeasuredCurve(one.frequency, one.response, one.radius())
        except HydrostateError:
            pass  # the input lacks some bands; smoothing does not need them
    try:
        filled = y if known.all() else np.interp(np.arange(y.size), np.flatnonzero(known), y[known])
        found = automatic_response(u, filled, view.sample_time)
    except HydrostateError:
        return None
    there = found.frequency_hz > 0.0
    return MeasuredCurve(found.frequency_hz[there], found.response[there], NORMAL_95 * found.gain_std[there])


def run_charts(view: IdentifiedView, stem: str) -> Charts:
    """Return charts of the inputs, the output with its free run, and the residual.

    Parameters
    ----------
    stem : str
        Start of the file name of a download.
    """
    out = view.output
    driven = [
        Panel(one.name, one.unit, (Curve("measured", one.scale * view.u[:, k], "grey"),))
        for k, one in enumerate(view.inputs)
    ]
    both = (
        Curve("measured", out.scale * view.y, "blue"),
        Curve("simulated", out.scale * view.simulated, "orange"),
    )
    left = (Curve("measured minus simulated", out.scale * view.residual, "grey"),)
    panels = [*driven, Panel(out.name, out.unit, both), Panel(f"{out.name}, residual", out.unit, left)]
    time = view.sample_time * np.arange(view.y.size, dtype=np.float64)
    return Charts(time, "time [s]", panels, f"{stem}-free-run")


def residual_charts(view: IdentifiedView, stem: str) -> Charts:
    """Return charts of the residual's correlation with itself and each input, with the limits expected by chance."""
    lags = np.arange(-DEFAULT_LAGS, DEFAULT_LAGS + 1)
    reach = NORMAL_95 / np.sqrt(max(np.count_nonzero(np.isfinite(view.residual)), 1))
    chance = (Mark("y", reach, "95 % of white noise"), Mark("y", -reach, ""))

    def panel(label: str, values: Array) -> Panel:
        curve = Curve("correlation", values, "blue", "dots")
        return Panel(label, "ratio", (curve,), chance, ends=_ends(values, -2.0 * reach, 2.0 * reach))

    own = np.where(lags > 0, correlations(view.residual, view.residual, lags), np.nan)
    panels = [panel("residual with itself", own)]
    for k, one in enumerate(view.inputs):
        label = "residual with input" if len(view.inputs) == 1 else f"residual with {one.name}"
        panels.append(panel(label, correlations(view.residual, view.u[:, k], lags)))
    return Charts(lags.astype(np.float64), "lag [samples]", panels, f"{stem}-residual", "lags")


def _ends(values: Array, low: float, high: float) -> tuple[float, float]:
    """Return axis limits that include all values and at least the given range."""
    there = values[np.isfinite(values)]
    least, most = min([low, *there.tolist()]), max([high, *there.tolist()])
    return least - 0.05 * (most - least), most + 0.05 * (most - least)


def step_charts(view: IdentifiedView, stem: str) -> Charts:
    """Return charts of the step response to each input, with a 95 % interval if a covariance is known.

    The height of a step is half the input's range, rounded.
    """
    count = _count(view)
    time = view.sample_time * np.arange(count, dtype=np.float64)
    curves: list[Curve] = []
    bands: list[tuple[int, int]] = []
    for k, one in enumerate(view.inputs):
        height = step_height(view.u[:, k])
        label = f"{one.name} {one.amount('+' + number(one.scale * height, 2))}"
        scale = view.output.scale
        if view.linear is not None:
            found = step_response(view.linear, count)
            low, high = (scale * height * end for end in found.band95)
            curves.append(Curve(label, scale * height * found.response, COLOURS[0]))
            if np.isfinite(low).all():
                curves += [Curve("95 % from", low, COLOURS[0], "edge"), Curve("95 % to", high, COLOURS[0], "edge")]
                bands.append((2, 1))
            continue
        curves.append(Curve(label, scale * _step_response(view, k, height, count), COLOURS[k % len(COLOURS)]))
    ends = _ends(np.concatenate([one.values for one in curves]), 0.0, 0.0)
    panel = Panel(f"change of {view.output.name}", view.output.unit, curves, bands=bands, ends=ends)
    return Charts(time, "time after the step [s]", [panel], f"{stem}-step", "step")


def step_height(values: Array) -> float:
    """Return half the range of an input, rounded to one digit.

    Parameters
    ----------
    values : ndarray, shape (n,)
        The input [any unit].

    Returns
    -------
    float
        Half its range [the input's unit].

    Examples
    --------
    >>> step_height(np.array([-209.4, 209.4])), step_height(np.array([0.0, 5.0]))
    (200.0, 2.0)
    """
    half = 0.5 * float(np.ptp(values))
    return float(f"{half:.0e}")


def _count(view: IdentifiedView) -> int:
    """Return the number of samples to show of a step response."""
    moduli = [float(np.max(np.abs(np.roots(f)), initial=0.0)) for _, f in view.transfers]
    slowest = max(moduli, default=1.0)
    lasting = TIME_CONSTANTS / -np.log(slowest) if 0.0 < slowest < 1.0 else np.inf
    delays = max((int(np.argmax(b != 0.0)) for b, _ in view.transfers), default=0)
    return int(min(max(lasting + 2 * delays, LEAST_STEPS), max(view.y.size // 2, LEAST_STEPS)))


def _step_response(view: IdentifiedView, which: int, height: float, count: int) -> Array:
    """Return the change of the output after a step from the inputs' means, which are first held for the same time."""
    inputs = np.tile(view.u.mean(axis=0), (2 * count, 1))
    inputs[count:, which] += height
    output = view.run(inputs)
    return output[count:] - output[count - 1]


def bode_charts(view: IdentifiedView, measured: MeasuredCurve | None, stem: str) -> Charts | None:
    """Return charts of the model's gain and phase with its 95 % band, and of the response measured from the log.

    Parameters
    ----------
    measured : MeasuredCurve or None
        From `measured_curve`.

    Returns
    -------
    Charts or None
        None if the model is not linear and no response was measured.
    """
    if not view.is_linear and measured is None:
        return None
    shown = None if measured is None else _thinned_curve(measured)
    frequency = _grid(view) if shown is None else np.unique(np.concatenate([_grid(view), shown.frequency]))
    gains: list[Curve] = []
    phases: list[Curve] = []
    bands: list[tuple[int, int]] = []
    scale, unit = view.gain_unit(0)
    units = {unit}
    if view.is_linear:
        for k, one in enumerate(view.inputs):
            scale, unit = view.gain_unit(k)
            units.add(unit)
            response = scale * view.response(k, frequency)
            name = "model" if len(view.inputs) == 1 else one.name
            gains.append(Curve(name, _decibels(np.abs(response)), COLOURS[k % len(COLOURS)]))
            phases.append(Curve(name, _degrees(response), COLOURS[k % len(COLOURS)]))
    if view.linear is not None:
        band = view.linear.frequency_response(frequency, ci=0.95)
        least = 1e-2 * np.abs(band.response)  # a gain of zero has no decibels, so stop at 40 dB below
        if np.isfinite(band.gain_low).all():
            gains += [
                Curve("95 % from", _decibels(scale * np.maximum(band.gain_low, least)), COLOURS[0], "edge"),
                Curve("95 % to", _decibels(scale * band.gain_high), COLOURS[0], "edge"),
            ]
            bands.append((2, 1))
    if shown is not None:
        at = np.searchsorted(frequency, shown.frequency)
        gain, phase = np.full((2, frequency.size), np.nan)
        gain[at] = _decibels(scale * np.abs(shown.response))
        turned = np.degrees(np.angle(shown.response))
        near = phases[0].values[at] if phases else np.zeros(at.size)
        phase[at] = turned + 360.0 * np.round((near - turned) / 360.0)
        gains.append(Curve("measured", gain, "orange", "dots"))
        phases.append(Curve("measured", phase, "orange", "dots"))
    level = "dB" if unit == AS_LOGGED or len(units) > 1 else f"dB of {unit}"
    panels = [Panel("gain", level, gains, bands=bands), Panel("phase", "°", phases)]
    return Charts(frequency, "frequency [Hz]", panels, f"{stem}-bode", "frequency", log=True)


def _grid(view: IdentifiedView) -> Array:
    highest = 0.5 / view.sample_time
    decades = min(float(np.log10(0.5 * view.y.size)), MOST_DECADES)
    return highest * np.logspace(-decades, 0.0, max(int(A_DECADE * decades), 2))


def _thinned_curve(measured: MeasuredCurve) -> MeasuredCurve:
    """Return the lines of the intervals in which the response is known, at most `A_DECADE` per decade."""
    there = np.flatnonzero(np.repeat(measured.known, np.diff(np.append(measured.begins, measured.frequency.size))))
    cells = np.floor(A_DECADE * np.log10(measured.frequency[there])).astype(int)
    _, first = np.unique(cells, return_index=True)
    kept = there[first]
    return MeasuredCurve(measured.frequency[kept], measured.response[kept], measured.radius[kept])


def _decibels(gain: Array) -> Array:
    with np.errstate(divide="ignore"):
        return np.where(gain > 0.0, 20.0 * np.log10(gain), np.nan)


def _degrees(response: ComplexArray) -> Array:
    return np.degrees(np.unwrap(np.angle(response)))
