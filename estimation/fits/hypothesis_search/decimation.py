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
"""Model step for the comparison of hypotheses if the plain form leaves much, or little, unexplained [s]."""

SHORT_LOG = 8_000
"""Length of a log that is not decimated [samples]: it takes a second or two, and its minima are narrow."""

LOUD, FAINT = 10.0, 2.0
"""Cost of the plain form, or of the first of two hypotheses, over that of noise alone, from which steps are long, and
below which all samples are used [dimensionless]."""


MOST_LONGER = 1.5
"""Longest distance from one pressure sample to the next, over the usual step [dimensionless]; judged."""

MOST_KEPT = 0.8
"""Share of the pressure samples that steps must reach, else all samples are used [fraction]; judged."""


class Decimation(NamedTuple):
    """How far a log is decimated while hypotheses are compared.

    Parameters
    ----------
    every : int
        How many samples are merged into one [count].
    left : float
        Cost of the plain form, or of the first of two hypotheses, over that of noise [dimensionless].
    starts : sequence of Mapping[str, float]
        Where searches begin [SI].
    """

    every: int
    left: float
    starts: Sequence[Mapping[str, float]]


NO_DECIMATION = Decimation(1, 1.0, ())


def decimated(log: GreyBoxLog, every: int) -> GreyBoxLog:
    """Return a decimated log, with one model step from each sample to the next.

    Pumped and swept volumes between samples are kept: motor speed is averaged as far as straight lines between means
    need, and position is not averaged. A pressure is the mean over a block. A pressure at a lower rate is used as it
    was read, and the samples that remain are those that have one. Each remaining sample represents as many residuals as
    the log has, so that costs stay the same except for white noise. The uncertainty of gaps in speed is kept, too.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened; unchanged if its pressures are unevenly spaced.
    every : int
        How many samples are merged into one [count].
    """
    if every < 2 or log.mean_rows > 1:
        return log.coarsened()
    block = min(max(1, round(log.block / log.sample_time)), every)
    there = np.flatnonzero(np.isfinite(log.measured[:, 0]))
    first, apart = 0, float(np.median(np.diff(there))) if len(there) > 1 else 1.0
    if apart > 1.0:  # otherwise blocks with missing pressures, or steps that miss their rows, would leave none
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
        gaps=_decimated_gaps(log.gaps, first, every),
        stands_for=max(every / apart, 1.0) / block,
    )


def _smoothed(speed: Array, every: int) -> Array:
    """Return a speed averaged by a triangle two steps wide: straight lines between the means then keep its integral."""
    rising = np.arange(1.0, every + 1.0)
    window = np.concatenate([rising, rising[-2::-1]]) / every**2
    return np.convolve(np.pad(speed, every - 1, mode="edge"), window, "valid")


def _decimated_gaps(gaps: Array, row: int, every: int) -> Array:
    """Return gaps for the samples that remain from a row on; each has the uncertainty of those it replaces."""
    first, last, variance = gaps.T
    begun, ended = (np.maximum(end - row, 0.0) // every for end in (first, last))
    return np.column_stack([begun, ended, variance * (last - first + 1.0) / (ended - begun + 1.0)])


def _block_means(measured: Array, block: int) -> Array:
    """Return the moving block means of the measurements; missing if a sample of the block is missing."""
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
    cost : float
        Half the sum of squares [dimensionless].

    Returns
    -------
    float
        About 1 if the log is explained [dimensionless].
    """
    seen = np.count_nonzero(np.isfinite(log.measured[:, 0])) / max(1, round(log.block / log.sample_time))
    return 2.0 * cost / max(seen, 1.0)


def decimation_for(log: GreyBoxLog, left: float) -> int:
    """Return how many samples are merged into one while hypotheses are compared.

    Parameters
    ----------
    left : float
        Cost of the plain form, or of the first of two hypotheses, see `cost_over_noise` [dimensionless].

    Returns
    -------
    int
        One if little is left, since small gains then matter, and in short logs [count].
    """
    if left < FAINT or len(log.drives) < SHORT_LOG:
        return 1
    step = LONG_STEP if left > LOUD else SHORT_STEP
    return max(1, round(step / log.sample_time))
