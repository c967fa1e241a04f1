"""The loop of filters side by side over their logs; a single filter is one lane.

All addresses are in bytes: the values that filters carry and use are in one flat buffer, the values of one symbol in a
line, line after line. Several lanes are stepped at a time, in place.
"""

import math
from collections.abc import Callable
from typing import Protocol, TypeAlias

from estimation.arrays import Array, IntArray
from plant.compiled.source import ROWS

AHEAD = 512
"""Bytes of each log that are prefetched: the memory answers within a few samples of all lanes."""

FLUSH = 8
"""Samples between checks of the running product of innovation variances, which cannot overflow that fast."""

LARGE = 1e60
"""If the product exceeds this, its logarithm is added to the sum, and the product restarts at 1."""


Results: TypeAlias = tuple[Array, Array, Array, Array, Array]
"""Output arrays: track and its variance, logarithms of flushed products, residuals and their variances."""


Step: TypeAlias = Callable[[int, float, int, int, int], None]
"""``step(address, j, before, after, sample)``, see `LanesKernel`."""


class LanesKernel(Protocol):
    """Interface of a filter's compiled kernel, for one log or for logs side by side.

    Attributes
    ----------
    LANES, LINE, LINES, WIDTH : int
        Filters side by side, bytes in a line, number of lines, and number of filters in a step.
    STATES, DRIVES, CHANNELS : int
        Numbers of the model's states and drives, and of measured channels.
    LAST : int
        Offset of the drives at the last sample of the previous rows [bytes].
    COUNT, PRODUCT, SEEN : int
        Offsets of the sample counts and products of innovation variances, and of a single filter's innovations and
        variances [numbers].
    prepare_at, predict_at, update_at, both_at : callable
        ``predict_at(address, j, before, after, sample)``: advance filters, starting at their first symbol, through
        sub-step j between the drives at two addresses; the others likewise. ``both_at`` takes the only step between two
        samples, and updates by the second one, in which no filter misses a channel; ``update_at`` subtracts missing
        channels from the counts.
    complete_at : callable
        ``complete_at(sample)``: whether no filter misses a channel.
    move : callable
        ``move(source, target)``: copy the numbers that a step takes.
    transpose : callable
        ``transpose(places, offset, ahead, target, stride)``, see `plant.compiled.native.operations.transpose`.
    """

    LANES: int
    LINE: int
    LINES: int
    WIDTH: int
    STATES: int
    DRIVES: int
    CHANNELS: int
    LAST: int
    COUNT: int
    PRODUCT: int
    SEEN: int
    prepare_at: Step
    predict_at: Step
    update_at: Step
    both_at: Step
    complete_at: Callable[[int], bool]
    move: Callable[[int, int], None]
    transpose: Callable[[int, int, int, int, int], None]


def steps(
    kernel: LanesKernel,
    work: Array,
    drives: int,
    measured: int,
    begin: int,
    first: int,
    end: int,
    substeps: int,
    every: int,
    results: Results,
) -> None:
    """Filter samples ``first`` to ``end`` of logs that lie side by side, sample 0 of which is sample ``begin``."""
    track, track_variance, logs, residuals, variances = results
    means, spreads, slots, line = track.ctypes.data, track_variance.ctypes.data, work.ctypes.data, kernel.LINE
    row = (begin + first + every - 1) // every
    for i in range(first, end):
        k = begin + i
        kept = k == row * every
        for lane in range(0, line, 8 * kernel.WIDTH):
            here = slots + lane
            after = drives + line * kernel.DRIVES * i + lane
            before = after - line * kernel.DRIVES if i > first else here + kernel.LAST
            sample = measured + line * kernel.CHANNELS * i + lane
            whole = k > 0 and substeps == 1 and kernel.complete_at(sample)
            if k == 0:
                kernel.prepare_at(here, 0.0, before, after, sample)
            for j in range(0 if k == 0 or whole else substeps):
                kernel.predict_at(here, float(j), before, after, sample)
            if whole:
                kernel.both_at(here, 0.0, before, after, sample)
            else:
                kernel.update_at(here, 0.0, before, after, sample)
            if kept:
                place = line * kernel.STATES * row + lane
                keep(kernel, here, means + place, spreads + place)
        if kept:
            row += 1
        if k < residuals.shape[0]:  # only a single filter stores its innovations
            for c in range(kernel.CHANNELS):
                residuals[k, c], variances[k, c] = work[kernel.SEEN + 2 * c], work[kernel.SEEN + 2 * c + 1]
        if k % FLUSH == FLUSH - 1:
            flush(kernel, work, logs)
    tally(kernel, work, end - first)
    if end > first:
        for lane in range(0, line, 8 * kernel.WIDTH):
            hold(kernel, drives + line * kernel.DRIVES * (end - 1) + lane, slots + lane)


def hold(kernel: LanesKernel, drives: int, here: int) -> None:
    """Store the last drives, at which the first sample of the next rows begins."""
    for c in range(kernel.DRIVES):
        kernel.move(drives + kernel.LINE * c, here + kernel.LAST + kernel.LINE * c)


def keep(kernel: LanesKernel, here: int, mean: int, variance: int) -> None:
    """Store a belief's mean and variances in the track; variances are first in an upper triangle's rows."""
    place, line = kernel.STATES, kernel.LINE
    for a in range(kernel.STATES):
        kernel.move(here + line * a, mean + line * a)
        kernel.move(here + line * place, variance + line * a)
        place += kernel.STATES - a


def flush(kernel: LanesKernel, work: Array, logs: Array) -> None:
    """Take the logarithm of large products of innovation variances, and reset these."""
    above = 0
    for place in range(kernel.PRODUCT, kernel.PRODUCT + kernel.LANES * kernel.CHANNELS):
        above += work[place] > LARGE
    if above == 0:
        return
    for lane in range(kernel.LANES):
        for c in range(kernel.CHANNELS):
            place = kernel.PRODUCT + kernel.LANES * c + lane
            if work[place] > LARGE:
                logs[c, lane] += math.log(work[place])
                work[place] = 1.0


def tally(kernel: LanesKernel, work: Array, samples: int) -> None:
    """Add the number of samples to the counts; updates have already subtracted the missing ones."""
    for place in range(kernel.COUNT, kernel.COUNT + kernel.LANES * kernel.CHANNELS):
        work[place] += float(samples)


def run(
    kernel: LanesKernel,
    work: Array,
    drives: IntArray,
    measured: IntArray,
    rows: Array,
    samples: int,
    substeps: int,
    every: int,
    results: Results,
) -> None:
    """Filter separate logs, `ROWS` samples of each at a time; the last block may overlap the one before."""
    drive, sample = rows.ctypes.data, rows.ctypes.data + kernel.LINE * ROWS * kernel.DRIVES
    for begin in range(0, samples, ROWS):
        at = min(begin, samples - ROWS)
        new = begin - at
        lay_side_by_side(kernel, drives, at, kernel.DRIVES, drive)
        lay_side_by_side(kernel, measured, at, kernel.CHANNELS, sample)
        steps(kernel, work, drive, sample, at, new, ROWS, substeps, every, results)


def lay_side_by_side(kernel: LanesKernel, places: IntArray, begin: int, width: int, rows: int) -> None:
    """Copy `ROWS` samples of each log into lines of all lanes."""
    line = kernel.LINE
    for lane in range(0, line, 8 * ROWS):
        for i in range(0, ROWS * width, ROWS):
            kernel.transpose(places.ctypes.data + lane, 8 * (begin * width + i), AHEAD, rows + line * i + lane, line)
