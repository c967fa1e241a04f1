"""A channel whose unit changed within the log: its noise and its signal are larger by one factor from there on."""

import numpy as np

from estimation.log_checks.channel_names import MEASURED
from estimation.notes import ChannelCode
from plant.arrays import Array
from plant.log.record import Record
from plant.notes import Note

BLOCKS, FEWEST, LEAST_ROWS = 60, 5, 100
"""Blocks of a log, least blocks on either side of a change, and least rows in a block [count]."""

LEAST = 5.0
"""Factor from which noise is checked: no unit is nearer to another, except psi [dimensionless]."""

ALIKE, LARGE, ALIKE_IF_LARGE, OTHERS = 0.1, 50.0, 0.4, 3.0
"""Share by which the noise may miss a slip's factor, the factor above which noise never grows by itself and the wider
share allowed there (an encoder has few steps), and factor by which the noise of other channels may change."""

LOW, ROUNDED = 0.3, 1e-12
"""Quantile of a channel's fourth differences that is noise, whatever moves in other rows; and the share of the largest
value that is rounding [fraction]."""

SLIPS = (10.0, 100.0, 1e3, 1e5, 1e6, 60.0 / (2.0 * np.pi), 6894.76, 14.5038)
"""Factors between units of one quantity: mm, cm and m; bar, kPa, MPa, psi and Pa; rpm and rad/s [dimensionless]."""


def unit_changes(record: Record) -> tuple[Note, ...]:
    """Return a note for each channel whose unit changed within the log.

    Returns
    -------
    tuple of Note
        Empty for a log that is written in one unit throughout.
    """
    asked = [name for name in MEASURED if name in record]
    size = max(LEAST_ROWS, len(record) // BLOCKS)
    count = len(record) // size
    if count < 2 * FEWEST or len(asked) < 2:
        return ()
    noise = {name: _noise(record[name], size, count) for name in asked}
    found: list[Note] = []
    for name in asked:
        split = _noise_change(noise[name])
        if split is None:
            continue
        k, factor = split
        slip = min(SLIPS, key=lambda one: abs(np.log(max(factor, 1.0 / factor) / one)))
        if abs(np.log(max(factor, 1.0 / factor) / slip)) > (ALIKE if slip < LARGE else ALIKE_IF_LARGE):
            continue
        others = [_ratio(noise[other], k) for other in asked if other != name]
        if any(max(one, 1.0 / one) > OTHERS for one in others):
            continue
        begin = float(record.time[_change_row(record[name], k * size, size, factor)])
        times = slip if factor > 1.0 else 1.0 / slip
        found.append(ChannelCode.UNIT_CHANGES.note(channel=name, begin_s=begin, factor=times))
    return tuple(found)


def _noise(values: Array, size: int, count: int) -> Array:
    """Return the size of a channel's noise in each block, from fourth differences [its unit]; NaN if there is none."""
    bends = np.abs(np.diff(values[: size * count], 4, append=4 * [np.nan])).reshape(count, size)
    bends[bends <= ROUNDED * np.nanmax(np.abs(values), initial=0.0)] = np.nan
    there = np.count_nonzero(np.isfinite(bends), axis=1)
    small = np.sort(bends, axis=1)[np.arange(count), (LOW * there).astype(np.int64)]  # NaN is sorted to the end
    return np.where(there < size // 4, np.nan, small)


def _ratio(noise: Array, k: int) -> float:
    """Return the ratio of noise from a block on to that before it; 1 if unknown."""
    before, behind = noise[:k][np.isfinite(noise[:k])], noise[k:][np.isfinite(noise[k:])]
    return float(np.median(behind) / np.median(before)) if len(before) and len(behind) else 1.0


def _noise_change(noise: Array) -> tuple[int, float] | None:
    """Return the block from which noise is different, and its factor, if no block is in between."""
    known = np.flatnonzero(np.isfinite(noise))
    if len(known) < 2 * FEWEST:
        return None
    sizes = np.log(noise[known])
    before, behind = np.maximum.accumulate(sizes), np.minimum.accumulate(sizes[::-1])[::-1]
    low_before, low_behind = np.minimum.accumulate(sizes), np.maximum.accumulate(sizes[::-1])[::-1]
    rise, fall = behind[1:] - before[:-1], low_before[:-1] - low_behind[1:]
    gap = np.maximum(rise, fall)[FEWEST - 1 : -FEWEST + 1 or None]
    k = int(np.argmax(gap)) + FEWEST
    if gap[k - FEWEST] < np.log(LEAST) / 2.0:
        return None
    at = int(known[k])
    factor = _ratio(noise, at)
    return (at, factor) if max(factor, 1.0 / factor) > LEAST else None


def _change_row(values: Array, near: int, size: int, factor: float) -> int:
    """Return the row from which a channel is larger by a factor, within two blocks."""
    first = max(1, near - size)
    steps = np.abs(np.diff(values[first - 1 : near + size]))
    large = np.nanmax(steps)
    over = np.flatnonzero(steps > large / max(factor, 1.0 / factor) ** 0.5)
    return first + int(over[0] if factor > 1.0 else over[-1])
