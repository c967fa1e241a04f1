"""Gross outliers: samples that no motion explains, removed before anything is fitted or filtered."""

import math
from collections.abc import Sequence
from functools import cache

import numpy as np

from estimation.log_checks.bridging import bridged
from estimation.log_checks.channel_names import POSITION, PRESSURES, VELOCITY
from estimation.log_checks.measurement_noise import measurement_variances, rounded_variance
from estimation.log_checks.order import percentile
from estimation.notes import SensorCode
from plant.arrays import Array
from plant.log.record import Record
from plant.notes import Note
from plant.sensors.sensors import differentiated

WINDOWS = ((7, 1), (11, 2))
"""Lengths of the running medians from which an outlier is measured, and how many ranks beside the median show how the
signal bends [samples, count]. A monotonic signal is its own median, so a step of the drive is no outlier. Three
outliers within seven samples look like a step, but not within eleven."""

GROSS = 10.0
"""Distance of a gross outlier from its running median, over the channel's usual one [dimensionless]."""

BENDS = 3.0
"""Spreads of the window's middle samples by which it must be farther away still: a peak is no outlier
[dimensionless]."""

USUAL_PERCENT = 95.0
"""Share of the samples that are assumed to be no outliers [percent]."""

ENDS = 3
"""Samples at either end of a log that have no other side: only what exceeds the channel's range is an outlier there."""

PART = 4096
"""Windows that are sorted at a time [samples]: they fit into a processor's cache; the fastest of 1024 to 16,384."""

REACH, BESIDE = 10, 3.0
"""Samples beside a gross outlier in which the burst that it belongs to may still ring, and the limit for outliers
there, in the measure of `GROSS` [count, dimensionless]; judged."""

FEWEST_ALIKE, MOST_ALIKE = 3, 0.8
"""Gross outliers of one value from which a logger writes it in place of a lost sample, and their share of all gross
outliers of the channel [count, fraction]; judged."""

CONFIRMING_SPAN = 5e-3
"""Span over which motion of the encoder confirms a velocity [s]."""


def without_outliers(values: Array, noise: float = 0.0) -> Array:
    """Return a channel without its gross outliers, which become missing samples (Hampel 1974).

    Parameters
    ----------
    values : ndarray, shape (n,)
        A channel [any unit]; NaN where missing.
    noise : float
        Standard deviation of its noise [the channel's unit].

    Returns
    -------
    ndarray, shape (n,)
        The channel, with NaN for outliers.

    Examples
    --------
    >>> step = np.repeat([0.0, 1.0], 10)
    >>> step[4] = 30.0
    >>> np.flatnonzero(np.isnan(without_outliers(step))).tolist()
    [4]
    """
    kept = values.copy()
    for window, ranks in WINDOWS:
        seen = kept[np.isfinite(kept)]
        if len(seen) <= 2 * ENDS:
            break
        below, distance, spread = _running_ranks(seen, window, [window // 2 + k for k in (-ranks, 0, ranks)])
        spread -= below  # in place, since the channel of a long log is large
        distance -= seen
        np.abs(distance, out=distance)
        spread *= BENDS
        spread += GROSS * (percentile(distance, USUAL_PERCENT) + noise)
        seen[distance > spread] = np.nan
        kept[np.isfinite(kept)] = _without_end_outliers(seen, noise)
    return kept


def without_bursts(values: Array, sound: Array, noise: float) -> Array:
    """Return a channel without the ringing beside its gross outliers, as a cable picks it up.

    Parameters
    ----------
    values, sound : ndarray, shape (n,)
        A channel, and the same without its gross outliers [any unit]; NaN where missing.
    noise : float
        Standard deviation of its noise [the channel's unit].

    Returns
    -------
    ndarray, shape (n,)
        The channel without both.

    Examples
    --------
    >>> burst = np.zeros(100)
    >>> burst[20:23] = 30.0, 5.0, -4.0
    >>> np.flatnonzero(np.isnan(without_bursts(burst, without_outliers(burst, 1.0), 1.0))).tolist()
    [20, 21, 22]
    """
    lost = np.isnan(sound) & np.isfinite(values)
    there = np.isfinite(sound)
    if not np.any(lost) or np.count_nonzero(there) < REACH:
        return sound
    stands, distance = there.copy(), _distance_from_course(sound[there])
    stands[there] = distance > BESIDE * (percentile(distance, USUAL_PERCENT) + noise)
    near = np.convolve(lost, np.ones(2 * REACH + 1), "same") > 0.5
    return np.where(stands & near, np.nan, sound)


def without_written_for_lost(values: Array, sound: Array, noise: float) -> Array:
    """Return a channel without the value that its logger writes in place of a lost sample, such as zero.

    Such a sample is a gross outlier only if the channel is far from that value. Nearer to it, it is recognised too.

    Parameters
    ----------
    values, sound : ndarray, shape (n,)
        A channel, and the same without its gross outliers [any unit]; NaN where missing.
    noise : float
        Standard deviation of its noise [the channel's unit].

    Returns
    -------
    ndarray, shape (n,)
        The channel without both.

    Examples
    --------
    >>> course = np.concatenate([np.full(20, 0.2), np.full(60, 50.0)])
    >>> course[[10, 30, 45, 60]] = 0.0
    >>> sound = without_outliers(course, 1e-2)
    >>> np.flatnonzero(np.isnan(without_written_for_lost(course, sound, 1e-2))).tolist()
    [10, 30, 45, 60]
    """
    stood_out = values[np.isnan(sound) & np.isfinite(values)]
    if len(stood_out) < FEWEST_ALIKE:
        return sound
    written, counts = np.unique(stood_out, return_counts=True)
    often = int(np.argmax(counts))
    if counts[often] < max(FEWEST_ALIKE, MOST_ALIKE * len(stood_out)):
        return sound
    there = np.isfinite(sound)
    distance = np.zeros(len(values))
    distance[there] = _distance_from_course(sound[there])
    return np.where((values == written[often]) & (distance > BESIDE * noise), np.nan, sound)


def _distance_from_course(values: Array) -> Array:
    """Return the distance of each sample from the median of the longest window around it."""
    window = WINDOWS[-1][0]
    return np.abs(values - _running_ranks(values, window, [window // 2])[0])


def _running_ranks(values: Array, window: int, ranks: Sequence[int]) -> Array:
    """Return order statistics of the window around each sample, one row each; the ends are extended."""
    around, out = np.pad(values, window // 2, mode="edge"), np.empty((len(ranks), len(values)))
    for begin in range(0, len(values), PART):
        part = around[begin : begin + PART + window - 1]
        rows = [part[k : len(part) - window + 1 + k].copy() for k in range(window)]
        spare = np.empty_like(rows[0])
        for low, high in sorting_exchanges(window):
            lower = np.minimum(rows[low], rows[high], out=spare)
            np.maximum(rows[low], rows[high], out=rows[high])
            spare, rows[low] = rows[low], lower
        out[:, begin : begin + PART] = [rows[rank] for rank in ranks]
    return out


@cache
def sorting_exchanges(count: int) -> tuple[tuple[int, int], ...]:
    """Return the pairs to compare, and to exchange if necessary, that sort some numbers (Batcher's odd-even merges).

    All windows of a log are sorted together in this way, in a tenth of the time of sorting one after another.

    Parameters
    ----------
    count : int
        Number of values.

    Returns
    -------
    tuple of pairs of int
        The lower index and the higher one, in order (Knuth 1998, The Art of Computer Programming 3, algorithm 5.2.2M).

    Examples
    --------
    >>> sorting_exchanges(3)
    ((0, 2), (0, 1), (1, 2))
    """
    found: list[tuple[int, int]] = []
    top = 1 << max(count - 1, 1).bit_length() - 1
    span = top
    while span:
        far, kept, apart = top, 0, span
        while True:
            found += [(place, place + apart) for place in range(count - apart) if place & span == kept]
            if far == span:
                break
            apart, far, kept = far - span, far >> 1, span
        span >>= 1
    return tuple(found)


def _without_end_outliers(seen: Array, noise: float) -> Array:
    """Return a channel without those of its first and last samples that are a full range beyond all others.

    A sample that its neighbours lead up to is kept: a log may begin at rest, and show how the motor speeds up.
    """
    inner = seen[ENDS:-ENDS]
    low, high = float(np.nanmin(inner)), float(np.nanmax(inner))
    reach = high - low + GROSS * noise
    for end in (seen[: ENDS + 2][::-1], seen[-ENDS - 2 :]):
        values = end.tolist()  # a few numbers, which Python compares faster than NumPy
        for at in range(2, ENDS + 2):
            before, step = values[at - 1] - values[at - 2], values[at] - values[at - 1]
            led = before * step > 0.0 and abs(step) <= BENDS * abs(before)
            if not led and not low - reach <= values[at] <= high + reach:
                end[at] = values[at] = math.nan
    return seen


def without_gross_outliers(record: Record, channels: Sequence[str]) -> tuple[Record, tuple[Note, ...]]:
    """Return a log without the gross outliers of its channels.

    A piston that slips shows a velocity for a few samples only; it is an outlier only if the encoder does not confirm
    it.

    Parameters
    ----------
    channels : sequence of str
        Channels to check; those that the log lacks are ignored.

    Returns
    -------
    tuple of (Record, tuple of Note)
        The log with its outliers missing, and a note for each channel that lost samples.
    """
    said: list[Note] = []
    for name in [name for name in channels if name in record]:
        values = record[name]
        shown = record
        if name in PRESSURES:  # a clipped pressure shows its noise only while it changes
            shown = record.replace(**{name: np.where(np.diff(values, prepend=np.nan) == 0.0, np.nan, values)})
        variance = measurement_variances(shown, (name,))[name]
        noise = max(variance, rounded_variance(values)) ** 0.5
        sound = without_outliers(values, noise)
        if name == VELOCITY and POSITION in record and _missing_count(sound) > _missing_count(values):
            span = max(CONFIRMING_SPAN, 2.0 * record.sample_time)
            moved = differentiated(bridged(record[POSITION]), record.sample_time, span)
            sound = np.where(np.isnan(without_outliers(values - moved, noise)), sound, values)
        # pressure is only compared with the model: unlike a driving channel, it can spare samples
        if name in PRESSURES:
            sound = without_bursts(values, sound, noise)
        sound = without_written_for_lost(values, sound, noise)
        lost = _missing_count(sound) - _missing_count(values)
        if lost:
            said.append(SensorCode.OUTLIERS_LEFT_OUT.note(channel=name, count=lost, total=len(record)))
            record = record.replace(**{name: sound})
    return record, tuple(said)


def _missing_count(values: Array) -> int:
    return int(np.count_nonzero(np.isnan(values)))
