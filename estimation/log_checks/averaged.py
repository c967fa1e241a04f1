"""Averaged pressure: each value is the mean of so many rows, as of `movmean` in MATLAB or of a logger's own average.

The spectrum of such a channel has zeros at all multiples of the sample rate over the rows, whatever drives the
actuator.
"""

from collections.abc import Mapping
from functools import cache

import numpy as np

from estimation.log_checks.channel_names import POSITION, PRESSURE, PRESSURES, SPEED
from estimation.log_checks.filtered import BANDS, spectra, taper_of, windows_of
from estimation.log_checks.measurement_noise import SMALLEST_VARIANCE
from estimation.log_checks.notes import LoggerCode
from plant.arrays import Array
from plant.log.record import Record
from plant.notes import Note

WINDOWS, FEWEST_WINDOWS = (256, 128, 64), 40
"""Samples of a window of the spectrum, the longest of which there are so many [count]."""

BINS_A_ZERO = 6
"""Least distance of two zeros of a mean over rows [bins]: a taper blurs three."""

FAST, LONGEST_BLOCK = 2.9e-4, 6e-4
"""Sample time below which a fit averages all channels over blocks of a few rows, and the longest means that may take
their place [s]. Those of an even count have no middle row, and a longer mean in such a log counts as a filter."""

MOST_LEFT, CHANCE = 0.1, 2.2
"""Largest deviation of the logarithm of a spectrum from that of averaged white noise: the first in any case, and the
second over the root of the number of windows more [dimensionless]. The right count left 0.08 to 0.19 (decision 454)."""

DISTINCT = 2.5
"""How much more any other count must leave [dimensionless]. The next best left at least 1.4 where the right one left
0.19 at most (decision 454)."""


def without_overlapping_means(record: Record) -> tuple[Record, tuple[Note, ...], Mapping[str, float]]:
    """Return a log whose averaged pressures are means of rows that do not overlap.

    Returns
    -------
    tuple of (Record, tuple of Note, Mapping[str, float])
        The log with one mean in so many rows, the first one in row ``rows - 1``; a note for each channel, and the
        variance of a mean's noise [unit squared]. The same log if its pressure was not averaged, or if position or
        speed was averaged as well.
    """
    rows, variance = averaged_rows(record[PRESSURE]) if PRESSURE in record else (1, 0.0)
    if rows == 1 or variance <= SMALLEST_VARIANCE[PRESSURE]:
        return record, (), {}
    if record.sample_time < FAST and (rows % 2 == 0 or rows * record.sample_time > LONGEST_BLOCK):
        return record, (), {}
    if any(averaged_rows(record[name])[0] > 1 for name in (POSITION, SPEED) if name in record):
        return record, (), {}
    pressures = [name for name in PRESSURES if name in record]
    found = {name: (rows, variance) if name == PRESSURE else averaged_rows(record[name]) for name in pressures}
    variances = {name: before / rows for name, (own, before) in found.items() if own == rows}
    changed, notes = dict[str, Array](), list[Note]()
    for name in variances:
        changed[name] = np.full(len(record), np.nan)
        changed[name][rows - 1 :: rows] = record[name][rows - 1 :: rows]
        notes.append(LoggerCode.AVERAGED.note(channel=name, rows=rows, span_ms=1e3 * rows * record.sample_time))
    return record.replace(**changed), tuple(notes), variances


def averaged_rows(values: Array) -> tuple[int, float]:
    """Return over how many rows a channel was averaged, and the variance of its noise before.

    Parameters
    ----------
    values : ndarray, shape (n,)
        The channel [any unit]; NaN where missing.

    Returns
    -------
    tuple of (int, float)
        Rows, 1 if it was not averaged, or if its spectrum is not that of a mean; variance [unit squared].

    Examples
    --------
    >>> noise = np.random.default_rng(1).normal(0.0, 2.0, 20_003)
    >>> rows, variance = averaged_rows(np.convolve(noise, np.ones(4) / 4.0, "valid"))
    >>> rows, round(variance)
    (4, 4)
    """
    length = next((one for one in WINDOWS if len(values) >= one // 2 * FEWEST_WINDOWS), 0)
    windows = windows_of(values, length) if length else np.empty((0, 1))
    if 2 * len(windows) < FEWEST_WINDOWS:
        return 1, 0.0
    # a spectrum's power is exponentially distributed, so its median is its mean times log 2
    power = np.median(spectra(windows), axis=0)[round(BANDS[0] * length) :] / np.log(2.0)
    if np.min(power) <= 0.0:
        return 1, 0.0
    counts = range(1, length // BINS_A_ZERO + 1)
    logs = [np.log(power / _mean_spectrum(rows, length)[-len(power) :]) for rows in counts]
    left = [float(np.std(one)) for one in logs]
    best, other = np.argsort(left)[:2]
    allowed = MOST_LEFT + CHANCE / len(windows) ** 0.5
    variance = float(np.exp(np.mean(logs[best])))
    if best == 0 or left[best] > min(allowed, left[other] / DISTINCT):
        return 1, 0.0
    return counts[best], variance


@cache
def _mean_spectrum(rows: int, length: int) -> Array:
    """Return the power that windows have of white noise of unit variance, averaged over rows."""
    taper = taper_of(length)
    alike = np.correlate(taper, taper, "full")[length - 1 : length - 1 + rows]
    alike *= (1.0 - np.arange(rows) / rows) / rows
    waves = np.cos(2.0 * np.pi * np.outer(np.arange(length // 2 + 1) / length, np.arange(1, rows)))
    return alike[0] + 2.0 * waves @ alike[1:]
