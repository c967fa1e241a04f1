"""Filtered pressure: noise that a filter or an averaging logger has correlated from sample to sample.

A fit assumes independent noise in each sample. If it is correlated, only every so many samples are kept: a fit then
sees a slow sensor, and finds the filter's lag as any other.
"""

import numpy as np

from estimation.log_checks.channel_names import PRESSURE, PRESSURES
from estimation.log_checks.measurement_noise import SMALLEST_VARIANCE
from estimation.notes import SensorCode
from plant.arrays import Array
from plant.log.record import Record
from plant.notes import Note

WINDOW = 64
"""Samples of a window of the spectrum [count]."""

FEWEST_WINDOWS = 8
"""Least number of windows without a missing sample for a spectrum [count]."""

BANDS = (0.2, 0.3, 0.4, 0.5)
"""Edges of the bands that are compared [cycles/sample]: in a log that is fast enough, the actuator is slower."""

FASTEST_RING = 0.1
"""Natural frequency up to which the bands contain noise alone [cycles/sample]: half of their lower edge, as a resonance
has a width, and a rig file may be wrong by a third."""

CHANCE, FLATTEST = 3.2, 0.9
"""Noise is white if the least power of a band over the largest exceeds 1 less the first over the root of the number of
windows, or the second if there are many [dimensionless]. White noise of 1 to 20 s at 1 kHz fails in 1 log of 1000; a
correlation of 0.15 between neighbours shows in 20 s."""

SLOWEST = 150.0
"""Rate below which no sensor is thinned out further [Hz]."""

QUIET = 0.25
"""Share of the windows that count as quiet, those of least power in the bands [fraction]. Under steps, a third of the
top speed is not exceeded in so many, so 15 teeth at 1500 rpm pass 125 times a second there."""

NEARER = 0.5
"""Largest distance from white noise in quiet windows, over that in all [dimensionless]; judged. Selection by power
favours white noise: of 60 logs with averages of 2 or 4 rows at most one passes, of 60 with a correlation of 0.15 or a
filter at 0.3 cycles/sample at most 10."""

SMOOTH, LAST = 5e-3, 4
"""Power of the last bins of the spectrum over that from 0.3 cycles/sample on, below which a filter has left no noise
[fraction], and those bins [count]; judged. White noise has 1, its mean over two rows 0.04, over more rows more; a
filter of second order, forward and backward, has 2e-3 or less up to 0.4 cycles/sample."""

MOST_ROWS = 40
"""Rows over which noise may be correlated [count]."""


def without_correlated_noise(record: Record, rings_at: float = 0.0) -> tuple[Record, tuple[Note, ...]]:
    """Return a log whose pressures have noise that is independent from sample to sample.

    Parameters
    ----------
    rings_at : float
        Natural frequency of the piston on its oil [Hz]. A log in which it is near the bands is unchanged.

    Returns
    -------
    tuple of (Record, tuple of Note)
        The log, and a note for each channel that keeps one sample in several.
    """
    changed, notes = dict[str, Array](), list[Note]()
    if rings_at * record.sample_time > FASTEST_RING:
        return record, ()
    for name in PRESSURES:
        if name not in record or (rows := independent_rows(record[name], record.sample_time)) == 1:
            continue
        if (independent_variance(record[name]) or 0.0) <= SMALLEST_VARIANCE[PRESSURE]:
            continue  # a simulation without noise: the spectrum is the actuator's
        if is_white_when_quiet(record[name]):
            continue  # pump teeth at high speed, or a chirp; a filter would act at all times
        values = np.full(len(record), np.nan)
        values[::rows] = record[name][::rows]
        changed[name] = values
        notes.append(SensorCode.FILTERED.note(channel=name, rows=rows))
    return (record.replace(**changed), tuple(notes)) if notes else (record, ())


def independent_rows(values: Array, sample_time: float) -> int:
    """Return the spacing in rows at which the noise of a channel is independent.

    Parameters
    ----------
    values : ndarray, shape (n,)
        The channel [any unit]; NaN where missing.
    sample_time : float
        Between rows [s].

    Returns
    -------
    int
        1 if it is independent in every row, or at no spacing: then it is not correlated noise.

    Examples
    --------
    >>> noise = np.random.default_rng(1).normal(0.0, 1.0, 20_003)
    >>> averaged = np.convolve(noise, np.ones(4) / 4.0, "valid")
    >>> independent_rows(noise, 1e-3), independent_rows(averaged, 1e-3)
    (1, 5)
    """
    if is_white(values):
        return 1
    most = min(MOST_ROWS, int(1.0 / (SLOWEST * sample_time)))
    rows = next((rows for rows in range(2, most) if is_white(values[::rows])), 0)
    return rows + 1  # a spectrum of few windows misses some correlation between samples


def is_white(values: Array) -> bool:
    """Return whether the noise of a channel is white, as far as its samples show.

    Parameters
    ----------
    values : ndarray, shape (n,)
        The channel [any unit]; NaN where missing.
    """
    windows = windows_of(values)
    return len(windows) < FEWEST_WINDOWS or flatness(windows) > _least_white_flatness(len(windows))


def is_smoothed(values: Array) -> bool:
    """Return whether a channel has no noise at the highest frequencies, as behind a filter, or simulated without any.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Differential pressure [Pa]; NaN where missing.

    Examples
    --------
    >>> noise = np.random.default_rng(1).normal(0.0, 1e3, 20_000)
    >>> smooth = np.convolve(noise, np.hanning(32) / 16.0, "valid")
    >>> is_smoothed(noise), is_smoothed(smooth)
    (False, True)
    """
    windows = windows_of(values)
    if len(windows) < FEWEST_WINDOWS:
        return False
    power = np.sort(spectra(windows), axis=0)[len(windows) // 2]
    last, upper = float(np.mean(power[-LAST:])), float(np.mean(power[round(BANDS[1] * WINDOW) :]))
    return last < SMOOTH * upper or (independent_variance(values) or np.inf) <= SMALLEST_VARIANCE[PRESSURE]


def is_white_when_quiet(values: Array) -> bool:
    """Return whether the noise of a channel is white where it is quietest, but not over the whole log.

    A filter or an average acts at all times. The actuator does not: the teeth of a pump are below the bands while it
    turns slowly, a loop rests between moves, a chirp is slow for a while. A few windows show a filter less surely than
    all do, so they must also be nearer to white by `NEARER`.

    Parameters
    ----------
    values : ndarray, shape (n,)
        The channel [any unit]; NaN where missing.
    """
    windows = windows_of(values)
    if len(windows) * QUIET < FEWEST_WINDOWS:
        return False
    loud = np.sum(spectra(windows)[:, np.arange(WINDOW // 2 + 1) >= BANDS[0] * WINDOW], axis=1)
    quiet = windows[loud <= np.sort(loud)[int(QUIET * (len(loud) - 1))]]  # np.quantile imports numpy.ma
    found = flatness(quiet)
    return found > _least_white_flatness(len(quiet)) and 1.0 - found < NEARER * (1.0 - flatness(windows))


def _least_white_flatness(windows: int) -> float:
    """Return the flatness above which noise in so many windows is white [dimensionless]."""
    return min(FLATTEST, 1.0 - CHANCE / windows**0.5)


def windows_of(values: Array, length: int = WINDOW) -> Array:
    """Return windows without missing samples that overlap by half.

    Parameters
    ----------
    values : ndarray, shape (n,)
        A channel [any unit]; NaN where missing.
    length : int
        Samples of a window [count].

    Returns
    -------
    ndarray, shape (windows, length)
        The windows.
    """
    if len(values) < length:
        return np.empty((0, length))
    windows = np.lib.stride_tricks.sliding_window_view(values, length)[:: length // 2]
    return windows[np.isfinite(windows).all(axis=1)]


def flatness(windows: Array) -> float:
    """Return the least power of a band of high frequency over the largest.

    The power at a frequency is the median over windows, so that single windows with an impact do not count.

    Parameters
    ----------
    windows : ndarray, shape (windows, `WINDOW`)
        Parts of a channel [any unit].

    Returns
    -------
    float
        The ratio [dimensionless], 1 if there is no power.
    """
    bands = _powers(windows)
    return min(bands) / max(bands) if max(bands) > 0.0 else 1.0


def independent_variance(values: Array) -> float | None:
    """Return the variance of a channel's independent noise from its highest band, None if it has too few samples.

    Second differences of samples that are far apart would include the actuator's motion.

    Parameters
    ----------
    values : ndarray, shape (n,)
        The channel [any unit]; NaN where it has no sample.

    Returns
    -------
    float or None
        The variance [unit squared].

    Examples
    --------
    >>> round(independent_variance(np.random.default_rng(1).normal(0.0, 3.0, 20_000)) or 0.0)
    9
    """
    windows = windows_of(values[np.isfinite(values)])
    if len(windows) < FEWEST_WINDOWS:
        return None
    # a spectrum's power is exponentially distributed, so its median is its mean times log 2
    return _powers(windows)[-1] / float(np.log(2.0) * np.sum(taper_of(WINDOW) ** 2))


def taper_of(length: int) -> Array:
    """Return the taper of a window (Hann).

    Parameters
    ----------
    length : int
        Samples of a window [count].

    Returns
    -------
    ndarray, shape (length,)
        Weights [dimensionless].
    """
    return 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(length) / length)


def spectra(windows: Array) -> Array:
    """Return the power of windows without their straight lines.

    Parameters
    ----------
    windows : ndarray, shape (windows, length)
        Parts of a channel [any unit].

    Returns
    -------
    ndarray, shape (windows, length / 2 + 1)
        Tapered by `taper_of` [unit squared].
    """
    line = np.linspace(-1.0, 1.0, windows.shape[1])
    level = windows - np.mean(windows, axis=1, keepdims=True)
    level -= np.outer(level @ line / (line @ line), line)
    return np.abs(np.fft.rfft(level * taper_of(windows.shape[1]), axis=1)) ** 2


def _powers(windows: Array) -> list[float]:
    """Return the usual power of windows in each of the bands [unit squared]."""
    ordered = np.sort(spectra(windows), axis=0)
    power = 0.5 * (ordered[(len(windows) - 1) // 2] + ordered[len(windows) // 2])  # np.median imports numpy.ma
    place = np.searchsorted(BANDS, np.arange(len(power)) / WINDOW, side="right")
    return [float(np.mean(power[place == band])) for band in range(1, len(BANDS))]
