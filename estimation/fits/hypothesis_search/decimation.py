"""`decimated(log, every)`: a decimated log, for searches that only rank hypotheses."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from estimation.fits.greybox.log import GreyBoxLog
from estimation.log_checks.channel_names import SPEED
from estimation.models.wide_flow import WIDE_FLOW_FORM
from plant.arrays import Array

LONG_STEP, SHORT_STEP = 4e-3, 2e-3
"""Step of the model while hypotheses are compared that have much to explain, or less [s]."""

FEW = 8_000
"""Length of a log of which all samples count [samples]: it takes a second or two, and its valleys are narrow."""

LOUD, FAINT = 10.0, 2.0
"""Half the sum of squares that the plain form leaves, or the first of two, over what noise alone makes of it, from
which steps are long, and below which all samples count [dimensionless]."""


MOST_LONGER = 1.5
"""How many times its usual length a step may take, to come from one pressure to the next [dimensionless]; judged."""

MOST_KEPT = 0.8
"""Share of the pressures that a step comes to, below which all samples count [fraction]; judged."""


class Decimation(NamedTuple):
    """How far a log is decimated while hypotheses are compared.

    Parameters
    ----------
    every : int
        How many samples are one [count].
    left : float
        What the plain form leaves, or the first of two, over the noise [dimensionless].
    starts : sequence of Mapping[str, float]
        Where searches begin [SI].
    """

    every: int
    left: float
    starts: Sequence[Mapping[str, float]]


NO_DECIMATION = Decimation(1, 1.0, ())


def decimated(log: GreyBoxLog, every: int) -> GreyBoxLog:
    """Return a decimated log, with one model step from each sample to the next.

    What is pumped and what is swept between two of them stay: motor speed is averaged as far as a straight line between
    means needs, position is as it was read. A pressure is the mean over a block; one that came slower than the rest is
    as it was read, and the samples that count are those that have one. Each sample left stands for as many residuals as
    the log has, so that costs stay what they were, but for what white noise makes of them. What a gap in the speed
    leaves open stays, too.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened; one with pressures at no even distance is left as it is.
    every : int
        How many samples are one [count].
    """
    if every < 2:
        return log.coarsened()
    block = min(max(1, round(log.block / log.sample_time)), every)
    there = np.flatnonzero(np.isfinite(log.measured[:, 0]))
    first, apart = 0, float(np.median(np.diff(there))) if len(there) > 1 else 1.0
    if apart > 1.0:  # else a block that lacks one, or a step beside them, leaves none
        block, every = 1, max(n for n in range(1, int(MOST_LONGER * every) + 1) if apart % n == 0)
        first = int(there[0]) % every
    rows = slice(first, None, every)
    measured = _block_means(log.measured, block)[rows]
    left, wanted = np.count_nonzero(np.isfinite(measured[:, 0])), len(there) * min(apart / every, 1.0)
    if every < 2 or left < MOST_KEPT * wanted:
        return log.coarsened()
    drives = log.drives[rows].copy()
    speed = WIDE_FLOW_FORM.drives.index(SPEED)
    drives[:, speed] = _smoothed(log.drives[:, speed], every)[rows]
    return replace(
        log,
        drives=drives,
        measured=measured,
        sample_time=every * log.sample_time,
        steps=np.ones(len(drives), log.steps.dtype),
        noise=tuple(one.scaled(1.0 / block) for one in log.noise),
        gaps=_gaps_at(log.gaps, first, every),
        stands_for=max(every / apart, 1.0) / block,
    )


def _smoothed(speed: Array, every: int) -> Array:
    """Return a speed averaged by a triangle as wide as two steps: straight lines between means then hold its sum."""
    rising = np.arange(1.0, every + 1.0)
    window = np.concatenate([rising, rising[-2::-1]]) / every**2
    return np.convolve(np.pad(speed, every - 1, mode="edge"), window, "valid")


def _gaps_at(gaps: Array, row: int, every: int) -> Array:
    """Return gaps by the samples that are left from a row on; each opens what those opened that it stands for."""
    first, last, variance = gaps.T
    begun, ended = (np.maximum(end - row, 0.0) // every for end in (first, last))
    return np.column_stack([begun, ended, variance * (last - first + 1.0) / (ended - begun + 1.0)])


def _block_means(measured: Array, block: int) -> Array:
    """Return the moving block means of the measurements; missing where a sample of the block is."""
    if block < 2:
        return measured
    before = block // 2
    padded = np.pad(measured, ((before, block - 1 - before), (0, 0)), mode="edge")
    sums = np.lib.stride_tricks.sliding_window_view(padded, block, axis=0)
    return np.mean(sums, axis=-1)


def cost_over_noise(log: GreyBoxLog, cost: float) -> float:
    """Return a cost as a multiple of the cost of noise alone.

    Parameters
    ----------
    log : GreyBoxLog
        The log.
    cost : float
        Half the sum of squares [dimensionless].

    Returns
    -------
    float
        About 1 where the log is explained [dimensionless].
    """
    seen = np.count_nonzero(np.isfinite(log.measured[:, 0])) / max(1, round(log.block / log.sample_time))
    return 2.0 * cost / max(seen, 1.0)


def decimation_for(log: GreyBoxLog, left: float) -> int:
    """Return how many samples are merged into one while hypotheses are compared.

    Parameters
    ----------
    log : GreyBoxLog
        The log.
    left : float
        What the plain form leaves, or the first of two, see `cost_over_noise` [dimensionless].

    Returns
    -------
    int
        One where little is left, since small gains are then what matters, and in short logs [count].
    """
    if left < FAINT or len(log.drives) < FEW:
        return 1
    step = LONG_STEP if left > LOUD else SHORT_STEP
    return max(1, round(step / log.sample_time))
