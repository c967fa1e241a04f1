"""Output error of a linear model whose output has limits: saturation of a sensor or converter, or a stop.

Behind saturation the signal goes on. At a stop it does not: the output leaves the stop as soon as it is driven away, so
it is the sum of the linear model's changes, held between the limits. Both have exact derivatives: zero by everything
before the last time at a stop, and zero at a limit.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from estimation.arrays import Array, BoolArray, IntArray
from estimation.identification.free_run.data import Channels, Scaling
from estimation.identification.free_run.linear_kernel import settles
from estimation.identification.free_run.linear_problem import Form, LinearFit, Problem
from estimation.identification.search.jit import compiled
from estimation.identification.search.levenberg import levenberg

TOLERANCE, MOST_STEPS = 1e-9, 60
"""Relative gain of the cost below which a descent ends, and most evaluations."""

STATE_STEPS = 12
"""Most evaluations of a run whose initial state alone is fitted."""

BEGINNINGS, MOST_STARTS = (0.02, 0.1), 4
"""Shares of a log whose outputs give its first initial state, and most starts of it."""

NOISE_BAND = 6.0
"""Deviations of the noise over which outputs at a limit spread, three on each side [dimensionless]."""

ROUNDING = 1e-9
"""Share of the output's range over which outputs at a limit without noise spread [dimensionless]."""

LEAST_SHARE, LONGEST, LEAST_PILE_RATIO = 0.005, 4, 2.0
"""Least share of all samples at a limit, least length of the longest stay, and least ratio to the number in the next
band of the same width. They only start a comparison, which decides [dimensionless]."""

SPARSE_SHARES = (1.0, 0.5, 0.25, 0.125)
"""Shares of that band that are tried if most rows are empty: changes from one sample to the next are then not noise
alone [fraction]."""

WHITE_NOISE_MEDIAN = np.sqrt(6.0) * 0.6745
"""Median of the magnitude of second differences of white noise, over its deviation [dimensionless]."""


@dataclass(frozen=True)
class Limits:
    """Limits of an output.

    Parameters
    ----------
    low, high : float
        Infinite if there is no limit; scaled [dimensionless].
    near : float
        Largest distance of outputs at a limit from it; scaled [dimensionless].
    stops : bool
        Whether the plant itself stops there; otherwise only the measurement saturates.
    """

    low: float
    high: float
    near: float
    stops: bool = False

    @property
    def count(self) -> int:
        """Number of limits."""
        return int(np.isfinite(self.low)) + int(np.isfinite(self.high))

    def nonlinearity(self, by: Scaling) -> dict[str, Any]:
        """Return the kind, and limits without intervals [output unit].

        Parameters
        ----------
        by : Scaling
            Of the channels.
        """
        ends = {"low": self.low, "high": self.high}
        told = {name: by.y_mean + by.y_std * end for name, end in ends.items() if np.isfinite(end)}
        kind = "stops" if self.stops else "cut-off"
        return {"kind": kind, **{name: {"value": end, "std": None, "ci95": None} for name, end in told.items()}}

    def to_dict(self) -> dict[str, Any]:
        """Return JSON values; no limit is None."""
        low, high = (one if np.isfinite(one) else None for one in (self.low, self.high))
        return {"low": low, "high": high, "near": self.near, "stops": self.stops}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> "Limits":
        """Return the limits that `to_dict` wrote."""
        low = -np.inf if values["low"] is None else float(values["low"])
        high = np.inf if values["high"] is None else float(values["high"])
        return cls(low, high, float(values["near"]), bool(values["stops"]))


def limits_of(data: Channels) -> Limits | None:
    """Return the ends at which an output stays for a while, or None if there are none.

    Parameters
    ----------
    data : Channels
        Scaled.
    """
    # only the outputs that are present: most rows of a slow sensor are empty
    known = [y[np.isfinite(y)] for y in data.y]
    known = [y for y in known if y.size]
    bends = np.concatenate([np.abs(np.diff(y, 2)) for y in known])
    if not bends.size:
        return None
    noise, exact = float(np.median(bends)) / WHITE_NOISE_MEDIAN, ROUNDING * float(np.ptp(np.concatenate(known)))
    # a limit that acts after the sensor's noise is sharp, one that acts before it is not
    shares = SPARSE_SHARES if 2 * sum(y.size for y in known) < sum(y.size for y in data.y) else (1.0,)
    for band in (exact, *(max(share * NOISE_BAND * noise, exact) for share in shares)):
        high, low = _upper_limit(known, band), -_upper_limit([-y for y in known], band)
        if np.isfinite([low, high]).any():
            return Limits(low, high, band / 2.0)
    return None


def _upper_limit(logs: Sequence[Array], band: float) -> float:
    """Return the upper end at which valid outputs stay, infinite if there is none."""
    y = np.concatenate(logs)
    top = float(y.max())
    there, below = y >= top - band, (y < top - band) & (y >= top - 2.0 * band)
    share = np.count_nonzero(there) / y.size
    many = share >= LEAST_SHARE and np.count_nonzero(there) > LEAST_PILE_RATIO * np.count_nonzero(below)
    longest = max(_longest_run(one >= top - band) for one in logs)
    return float(np.median(y[there])) if many and longest >= LONGEST else float("inf")


def _longest_run(mask: BoolArray) -> int:
    """Return the length of the longest run of a mask."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return int((edges[1::2] - edges[::2]).max(initial=0))


def at_limits(y: Array, limits: Limits) -> BoolArray:
    """Return where an output is at a limit; False where it is missing.

    Parameters
    ----------
    y : ndarray, shape (n,)
        Output, scaled.
    limits : Limits
        Of the output.

    Returns
    -------
    ndarray of bool, shape (n,)
        Mask.
    """
    return np.asarray((y >= limits.high - limits.near) | (y <= limits.low + limits.near))


def between_limits(data: Channels, limits: Limits) -> Channels:
    """Return channels without the outputs at a limit."""
    return data.without([at_limits(y, limits) for y in data.y])


class LimitedProblem:
    """Sensitivities of one form on given data, its output between limits."""

    def __init__(self, form: Form, data: Channels, limits: Limits) -> None:
        self.inner, self.form, self.limits = Problem(form, data), form, limits

    def jacobian(self, theta: Array) -> tuple[Array, Array]:
        """Return the output and its derivative by every value.

        Parameters
        ----------
        theta : ndarray, shape (p,)
            As the linear model has them.

        Returns
        -------
        tuple of ndarray, shapes (n,) and (n, p)
            Output and derivatives, scaled.
        """
        free, slopes = self.inner.jacobian(theta)
        if not self.limits.stops:
            output = np.clip(free, self.limits.low, self.limits.high)
            slopes[output != free] = 0.0
            return output, slopes
        output, left = np.empty_like(free), np.full(free.size, -1)
        for first, last in zip(self.inner.bounds[:-1], self.inner.bounds[1:], strict=True):
            part = slice(int(first), int(last))
            hold_between_stops(free[part], self.limits.low, self.limits.high, output[part], left[part])
            left[part][left[part] >= 0] += int(first)
        behind = left >= 0
        slopes[behind] -= slopes[left[behind]]
        return output, slopes

    def descend(self, theta: Array, *, least_gain: float = 0.0) -> LinearFit:
        """Return the minimum from one start.

        Parameters
        ----------
        theta : ndarray, shape (p,)
            As the linear model has them.
        least_gain : float
            As `levenberg` takes it [dimensionless].
        """
        poles = slice(self.form.n_b, self.form.n_b + self.form.order)
        cost, best = levenberg(
            self._at,
            theta,
            lambda values: settles(values[poles]),
            tolerance=TOLERANCE,
            most_steps=MOST_STEPS,
            least_gain=least_gain,
        )
        return LinearFit(self.form, best, self.inner.share * cost)

    def with_initial_states(self, values: Array) -> Array:
        """Return values with the initial states that fit the outputs best, from several parts of them.

        Parameters
        ----------
        values : ndarray, shape (p,)
            Values of the model, without initial states.

        Returns
        -------
        ndarray, shape (p,)
            With initial states.
        """
        y, free = self.inner.y, self.form.n_values
        theta = np.concatenate([values[:free], np.zeros(self.inner.n_parameters - free)])
        driven, slopes = self.inner.jacobian(theta)
        slopes = slopes[:, free:].copy()
        starts = [theta]
        for part in self._beginnings():
            if np.count_nonzero(part) > self.form.order:
                states: Array = np.asarray(np.linalg.lstsq(slopes[part], (y - driven)[part], rcond=None)[0], np.float64)
                starts.append(np.concatenate([theta[:free], states]))

        def at(states: Array) -> tuple[float, Array, Array]:
            cost, gram, slope = self._at(np.concatenate([theta[:free], states]))
            return cost, gram[free:, free:], slope[free:]

        steps: Any = {"tolerance": TOLERANCE, "most_steps": STATE_STEPS}
        ended = [levenberg(at, start[free:], lambda _: True, **steps) for start in starts[-MOST_STARTS:]]
        return np.concatenate([theta[:free], min(ended, key=lambda one: one[0])[1]])

    def _beginnings(self) -> list[BoolArray]:
        """Return masks of outputs that determine the initial states, the same for each log."""
        known, free = self.inner.used, self.inner.used & ~at_limits(self.inner.y, self.limits)
        if not self.limits.stops:
            return [free]
        masks = [np.zeros_like(known) for _ in range(len(BEGINNINGS) + 1)]
        for first, last in zip(self.inner.bounds[:-1].tolist(), self.inner.bounds[1:].tolist(), strict=True):
            for mask, share in zip(masks, BEGINNINGS, strict=False):
                mask[first : first + max(int(share * (last - first)), 4 * self.form.order)] = True
                mask[last:] = False
            # a stop erases the effect of everything before it
            stays = np.flatnonzero(known[first:last] & ~free[first:last])
            masks[-1][first : first + int(stays[0]) if stays.size else last] = True
        return [known & mask for mask in masks]

    def _at(self, values: Array) -> tuple[float, Array, Array]:
        output, slopes = self.jacobian(values)
        left = output - self.inner.y
        return self.inner.counted.square(left), *self.inner.counted.normal_equations(slopes, left)


@compiled
def hold_between_stops(free: Array, low: float, high: float, output: Array, left: IntArray) -> None:
    """Hold a series between stops: it moves as a free one does, except beyond them.

    Parameters
    ----------
    free : ndarray, shape (n,)
        The free series.
    low, high : float
        Stops, scaled [dimensionless].
    output : ndarray, shape (n,)
        The series between them; overwritten.
    left : ndarray of int, shape (n,)
        The latest sample at a stop, or -1 before any; overwritten.
    """
    above, last = 0.0, -1
    for t in range(free.size):
        value = free[t] + above
        if value > high:
            value, last = high, t
        elif value < low:
            value, last = low, t
        above = value - free[t]
        output[t] = value
        left[t] = last
