"""Charts of an identified model: the log beside its free run, what is left, the step response, the Bode diagram."""

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
"""Longest log whose response is measured line by line [count]; of a longer one it is smoothed, which takes less."""

LEAST_STEPS = 50
"""Samples of a step response at least [count]."""

TIME_CONSTANTS = 6.0
"""Of the slowest pole, so many are shown [dimensionless]."""

A_DECADE, MOST_DECADES = 60, 5.0
"""Frequencies a decade at which a response is drawn, and decades below half the sample rate, at most."""

PER_DECADE = 10
"""Stretches of a decade in which the measured response is judged [count]."""

KNOWN = 0.5
"""Radius of the 95 % circle over the gain, up to which a stretch counts as known [fraction], judged."""

COLOURS = ("blue", "vermilion", "green", "purple", "orange", "grey")
"""Of the inputs, in their order."""


@dataclass(frozen=True, eq=False)
class MeasuredCurve:
    """The frequency response that the log itself tells.

    Parameters
    ----------
    frequency : ndarray, shape (k,)
        Rising [Hz].
    response : ndarray of complex, shape (k,)
        In units of the log.
    radius : ndarray, shape (k,)
        Of the 95 % circle around each [units of the log].
    """

    frequency: Array
    response: ComplexArray
    radius: Array

    @cached_property
    def begins(self) -> IntArray:
        """Start of each stretch, `PER_DECADE` per decade, shape (s,)."""
        cells = np.floor(PER_DECADE * np.log10(self.frequency))
        return np.flatnonzero(np.diff(cells, prepend=-np.inf))

    @cached_property
    def known(self) -> BoolArray:
        """Whether the log tells the response in each stretch, by its median, shape (s,).

        A line alone is not asked: among lines of noise some are large by chance.
        """
        with np.errstate(divide="ignore", invalid="ignore"):
            relative = self.radius / np.abs(self.response)
        return np.array([np.median(one) <= KNOWN for one in np.split(relative, self.begins[1:])], dtype=np.bool_)


def measured_curve(view: IdentifiedView) -> MeasuredCurve | None:
    """Return the response that a log with one input tells; None of several inputs, or of a log that tells none."""
    if len(view.inputs) > 1:
        return None
    u, y, known = view.u[:, 0], view.y, np.isfinite(view.y)
    if known.all() and y.size <= MOST_LOCAL:
        try:
            one = measured_response(u, y, view.sample_time).response
            return MeasuredCurve(one.frequency, one.response, one.radius())
        except HydrostateError:
            pass  # the input leaves bands out, which smoothing can do without
    try:
        filled = y if known.all() else np.interp(np.arange(y.size), np.flatnonzero(known), y[known])
        found = automatic_response(u, filled, view.sample_time)
    except HydrostateError:
        return None
    there = found.frequency_hz > 0.0
    return MeasuredCurve(found.frequency_hz[there], found.response[there], NORMAL_95 * found.gain_std[there])


def run_charts(view: IdentifiedView, stem: str) -> Charts:
    """Return inputs, output beside its free run, and what is left.

    Parameters
    ----------
    stem : str
        What a download is named after.
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
    """Return the correlations of the residual with itself and with each input, between limits of chance."""
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
    """Return ends of an axis that shows all values, and this range at least."""
    there = values[np.isfinite(values)]
    least, most = min([low, *there.tolist()]), max([high, *there.tolist()])
    return least - 0.05 * (most - least), most + 0.05 * (most - least)


def step_charts(view: IdentifiedView, stem: str) -> Charts:
    """Return charts of the step response to each input, with a 95 % interval if a covariance is known.

    A step is as high as half the input's range, in round numbers.
    """
    count = _count(view)
    time = view.sample_time * np.arange(count, dtype=np.float64)
    curves: list[Curve] = []
    bands: list[tuple[int, int]] = []
    for k, one in enumerate(view.inputs):
        height = step_of(view.u[:, k])
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
        curves.append(Curve(label, scale * _stepped(view, k, height, count), COLOURS[k % len(COLOURS)]))
    ends = _ends(np.concatenate([one.values for one in curves]), 0.0, 0.0)
    panel = Panel(f"change of {view.output.name}", view.output.unit, curves, bands=bands, ends=ends)
    return Charts(time, "time after the step [s]", [panel], f"{stem}-step", "step")


def step_of(values: Array) -> float:
    """Return half the range of an input in one digit.

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
    >>> step_of(np.array([-209.4, 209.4])), step_of(np.array([0.0, 5.0]))
    (200.0, 2.0)
    """
    half = 0.5 * float(np.ptp(values))
    return float(f"{half:.0e}")


def _count(view: IdentifiedView) -> int:
    """Return the number of samples of a step response to show."""
    moduli = [float(np.max(np.abs(np.roots(f)), initial=0.0)) for _, f in view.transfers]
    slowest = max(moduli, default=1.0)
    lasting = TIME_CONSTANTS / -np.log(slowest) if 0.0 < slowest < 1.0 else np.inf
    delays = max((int(np.argmax(b != 0.0)) for b, _ in view.transfers), default=0)
    return int(min(max(lasting + 2 * delays, LEAST_STEPS), max(view.y.size // 2, LEAST_STEPS)))


def _stepped(view: IdentifiedView, which: int, height: float, count: int) -> Array:
    """Return the change by a step from the inputs' means, after as long a rest before it."""
    inputs = np.tile(view.u.mean(axis=0), (2 * count, 1))
    inputs[count:, which] += height
    output = view.run(inputs)
    return output[count:] - output[count - 1]


def bode_charts(view: IdentifiedView, measured: MeasuredCurve | None, stem: str) -> Charts | None:
    """Return gain and phase of the model with its 95 % band, beside the response that the log itself tells.

    Parameters
    ----------
    measured : MeasuredCurve or None
        From `measured_curve`.

    Returns
    -------
    Charts or None
        None of a model that is not linear, on a log that tells no response.
    """
    if not view.is_linear and measured is None:
        return None
    shown = None if measured is None else _thinned(measured)
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
        least = 1e-2 * np.abs(band.response)  # a gain of nothing has no decibels: 40 dB below are enough
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


def _thinned(measured: MeasuredCurve) -> MeasuredCurve:
    """Return the lines of stretches in which the response is known, `A_DECADE` a decade at most."""
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
