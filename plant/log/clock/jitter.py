"""Stamps with jitter or rounding: the uniform clock behind them, and the samples on that clock."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from plant.arrays import Array

GAP = 1.5
"""Steps longer than this many sample times, and than stamps jitter, leave samples out [dimensionless]."""

BEYOND_JITTER = 3.5
"""Standard deviations of the steps, beyond one sample time, that jitter alone does not reach [dimensionless]."""

SLOPE_SAMPLES = 5
"""Samples of which a slope is taken [count]."""

FEWEST_QUANTA = 5
"""Steps of a rounded clock, at least [count]; fewer are gaps."""

LEAST_ROUNDING_SCATTER = 0.15
"""Least standard deviation of stamps about a uniform clock, over their quantum, that rounding to it leaves; it is 0.29
where all remainders are alike [dimensionless]."""

MOST_ROUNDING_RANGE = 1.25
"""Most that rounding leaves of stamps about a uniform clock, end to end, over their quantum [dimensionless]."""


class Grid(NamedTuple):
    """A uniform clock for stamps with jitter: its times, its gaps, and the scatter of the steps.

    Parameters
    ----------
    times : ndarray, shape (n,)
        Uniform times [s].
    sample_time : float
        Time between them [s].
    widest : float
        Longest step that leaves no sample out [s].
    scatter, most : float
        Root mean square and largest deviation of a step from the sample time, over it [fraction].
    """

    times: Array
    sample_time: float
    widest: float
    scatter: float
    most: float

    def lacking(self, time: Array) -> NDArray[np.bool_]:
        """Return the times of the clock at which a gap leaves no sample nearby.

        Parameters
        ----------
        time : ndarray, shape (m,)
            When the samples were taken [s].

        Returns
        -------
        ndarray of bool, shape (n,)
            True where nothing is known.
        """
        after = np.clip(np.searchsorted(time, self.times), 1, len(time) - 1)
        before, behind = self.times - time[after - 1], time[after] - self.times
        far = np.minimum(np.abs(before), np.abs(behind)) > 0.5 * self.sample_time
        return far & (before + behind > self.widest) | (np.minimum(before, behind) < -0.5 * self.sample_time)


def usual_step(step: Array) -> float:
    """Return the mean of the steps near their median, since the median of rounded steps is rounded.

    Parameters
    ----------
    step : ndarray, shape (n,)
        Steps between stamps [s].

    Returns
    -------
    float
        Their usual size [s].
    """
    middle = float(np.partition(step, len(step) // 2)[len(step) // 2])
    return float(np.mean(step[np.abs(step - middle) <= 0.5 * middle]))


def grid_of(time: Array) -> Grid:
    """Return the uniform clock for increasing stamps.

    Parameters
    ----------
    time : ndarray, shape (n,)
        The stamps [s].

    Returns
    -------
    Grid
        From the first stamp to the last.
    """
    step = np.diff(time)
    near = step[step < GAP * usual_step(step)]
    usual = float(np.mean(near))
    widest = max(GAP, 1.0 + BEYOND_JITTER * float(np.std(near)) / usual) * usual
    single = step[step <= widest]
    count = max(1, round(float(time[-1] - time[0]) / float(np.mean(single))))
    sample_time = float(time[-1] - time[0]) / count
    off = single / sample_time - 1.0
    times = time[0] + sample_time * np.arange(count + 1)
    return Grid(times, sample_time, widest, float(np.sqrt(np.mean(off**2))), float(np.max(np.abs(off))))


def resampled(grid: Grid, time: Array, values: Array) -> Array:
    """Return a channel on a uniform clock: each time takes its nearest sample, moved along the local slope.

    The slope is that of a cubic through five samples. A sample that moves by a tenth of the sample time keeps white
    noise, with 1 % more variance. Interpolation would average the noise of neighbours, and a noise estimate from the
    result would be too small. A channel on a sensor's quanta stays on them.

    Parameters
    ----------
    grid : Grid
        The clock.
    time : ndarray, shape (m,)
        When the samples were taken [s], increasing.
    values : ndarray, shape (m,)
        The samples [any unit]; NaN where missing.

    Returns
    -------
    ndarray, shape (n,)
        Array on the clock; NaN in gaps.
    """
    there = np.isfinite(values)
    t, y = time[there], values[there]
    if len(t) < 2:
        return np.full(len(grid.times), np.nan)
    out = np.interp(grid.times, t, y)
    if len(t) >= SLOPE_SAMPLES:
        after = np.clip(np.searchsorted(t, grid.times), 1, len(t) - 1)
        nearest = after - (grid.times - t[after - 1] < t[after] - grid.times)
        slopes, whole = _slopes(t, y)
        moved = y[nearest] + slopes[nearest] * (grid.times - t[nearest])
        out = np.where(whole[nearest], moved, out)
    out = _round_to_quantum(out, y)
    out[grid.lacking(t)] = np.nan
    return out


SAME_STAMP = 0.01
"""Step up to which two stamps count as one, over the usual step [fraction]; judged."""


def _slopes(t: Array, y: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Return the slope of a cubic through five samples at each sample, and whether no gap lies between them."""
    half, usual = SLOPE_SAMPLES // 2, float(np.median(np.diff(t)))
    first = np.clip(np.arange(len(t)) - half, 0, len(t) - SLOPE_SAMPLES)
    rows = first[:, None] + np.arange(SLOPE_SAMPLES)
    apart = (t[rows] - t[:, None]) / usual
    powers = apart[:, :, None] ** np.arange(4)
    normal = np.swapaxes(powers, 1, 2) @ powers
    right = np.swapaxes(powers, 1, 2) @ (y[rows] - y[:, None])[:, :, None]
    whole = np.ptp(t[rows], axis=1) <= GAP * (SLOPE_SAMPLES - 1) * usual
    whole &= np.count_nonzero(np.diff(t[rows], axis=1) > SAME_STAMP * usual, axis=1) >= 3  # a cubic needs four stamps
    normal[~whole] = np.eye(4)
    slopes: Array = np.linalg.solve(normal, right)[:, 1, 0].astype(np.float64) / usual
    return slopes, whole


FINEST_QUANTUM = 1e-12
"""Quantum of a sensor over its range below which there is none: numbers end in fewer digits [fraction]."""


def _round_to_quantum(found: Array, measured: Array) -> Array:
    """Round to a sensor's quantum if every measured value is a multiple of it."""
    steps = np.abs(np.diff(measured))
    quantum = float(np.min(steps[steps > 0.0], initial=np.inf))
    from_first = measured - measured[0]
    if not np.isfinite(quantum) or np.max(np.abs(from_first)) * FINEST_QUANTUM > quantum:
        return found
    counts = from_first / quantum
    if np.max(np.abs(counts - np.rint(counts))) > 1e-3:
        return found
    return measured[0] + quantum * np.rint((found - measured[0]) / quantum)


def rounded_clock(time: Array, slots: Array) -> tuple[float, float, float] | None:
    """Return the uniform clock whose rounded times are a log's stamps; None if rounding does not explain them.

    Parameters
    ----------
    time : ndarray, shape (n,)
        The stamps [s].
    slots : ndarray, shape (n,)
        Which tick of the clock each is [count].

    Returns
    -------
    tuple of float, or None
        Start, sample time and quantum [s].

    Examples
    --------
    >>> ticks = np.arange(100.0)
    >>> start, sample_time, quantum = rounded_clock(np.round(3e-4 * ticks, 3), ticks)
    >>> round(sample_time, 6), round(quantum, 6)
    (0.0003, 0.001)
    """
    step = np.diff(time)
    fine = max(1e-9 * abs(float(np.mean(step))), 8.0 * float(np.spacing(np.abs(time[[0, -1]]).max())))
    apart = np.diff(np.unique(np.rint(step / fine))) * fine
    if not len(apart) or float(np.min(step)) < 0.0:
        return None
    quantum = float(np.min(apart))
    quanta = np.rint(step / quantum)
    if np.max(np.abs(step / quantum - quanta)) > 0.01 or np.count_nonzero(quanta) < FEWEST_QUANTA:
        return None
    centred = slots - slots.mean()
    spread = float(centred @ centred)  # zero for steps so small that their squares vanish
    sample_time = float(centred @ time) / spread if spread else 0.0
    if not sample_time > 0.0:
        return None
    turns = slots[1:][quanta > 0]  # slots at which the stamp changes; few of them give a poor slope
    between = float(quanta[quanta > 0][1:].sum())
    ticks = [one for one in ((turns[-1] - turns[0]) / max(between, 1.0), quantum / sample_time) if np.isfinite(one)]
    whole = [quantum / max(1.0, np.rint(one)) for one in ticks]
    for tried in (*whole, sample_time):  # a whole number of samples per quantum, if the stamps allow it
        left = time - tried * slots
        most = 1.0 + 1e-6 if tried is not sample_time else MOST_ROUNDING_RANGE
        if np.ptp(left) <= most * quantum and np.std(left) >= LEAST_ROUNDING_SCATTER * quantum:
            return float(left.mean()), float(tried), quantum
    return None
