"""Block averages of logs that are faster than a model needs."""

from dataclasses import replace

import numpy as np

from estimation.fits.greybox.log import GreyBoxLog
from estimation.log_checks.bridging import bridged_slow_channel
from plant.arrays import Array
from plant.runs import steps_a_sample

SHORTEST_SAMPLE = 5e-4
"""Logs with pressure at a shorter sample time are averaged to about this one [s]. Means of ten samples of 0.1 ms, in
place of five, put bulk modulus of leaky actuators 0.1 % high; means of five 0.04 %."""

MOST_LOST = 0.1
"""Largest share of the valid samples that may fall into incomplete blocks [fraction]."""


def samples_a_block(sample_time: float, length: float) -> int:
    """Return the number of samples in a block.

    Parameters
    ----------
    sample_time : float
        Seconds between samples [s].
    length : float
        About how long a block is [s].

    Returns
    -------
    int
        Samples a block; 1 where a log is slow enough.

    Examples
    --------
    >>> samples_a_block(1e-4, 1e-3), samples_a_block(2e-3, 1e-3)
    (10, 1)
    """
    return max(1, round(length / sample_time))


def odd_block(sample_time: float) -> int:
    """Return the number of samples in a block of about `SHORTEST_SAMPLE`, odd so that one is in its middle.

    Parameters
    ----------
    sample_time : float
        Seconds between samples [s].

    Returns
    -------
    int
        Samples a block.

    Examples
    --------
    >>> [odd_block(sample_time) for sample_time in (1e-4, 2e-4, 5e-4)]
    [5, 3, 1]
    """
    wanted = SHORTEST_SAMPLE / sample_time
    below = max(1, 2 * int((wanted + 1.0) / 2.0) - 1)
    return below if wanted * wanted < below * (below + 2) else below + 2


def block_means(values: Array, block: int) -> Array:
    """Return means over whole blocks; missing if any of the block's samples is.

    Parameters
    ----------
    values : ndarray, shape (n, ...)
        Numbers in any unit; NaN is missing.
    block : int
        Samples a block.

    Returns
    -------
    ndarray, shape (n // block, ...)
        The means; the remainder at the end is dropped.

    Examples
    --------
    >>> block_means(np.array([1.0, 3.0, np.nan, 5.0, 7.0]), 2).tolist()
    [2.0, nan]
    """
    whole = len(values) // block * block
    return values[:whole].reshape(-1, block, *values.shape[1:]).mean(axis=1)


def means_across(values: Array, block: int) -> tuple[Array, float]:
    """Return means over whole blocks of a channel, which may be read more slowly than the log's rows.

    Between the samples of a slow channel lie straight lines; else all its means would be missing.

    Parameters
    ----------
    values : ndarray, shape (n,)
        A channel [any unit]; NaN where missing.
    block : int
        Rows a block.

    Returns
    -------
    ndarray, shape (n // block,)
        The means; missing in the gaps of the channel.
    float
        Samples behind a mean, by which it has less variance than a sample [count]; 1 where a block has fewer.

    Examples
    --------
    >>> gone = np.nan
    >>> slow = np.array([1.0, gone, 3.0, gone, 5.0, gone, 7.0])
    >>> means_across(slow, 2)[0].tolist(), means_across(slow, 4)[1]
    ([1.5, 3.5, 5.5], 2.0)
    """
    if block == 1:
        return values, 1.0
    bridges, rows = bridged_slow_channel(values)
    return block_means(bridges, block), max(1.0, block / rows)


def averaged_log(log: GreyBoxLog, longest_step: float, block: int | None = None) -> GreyBoxLog:
    """Return a log whose drives and outputs are means over blocks.

    Inputs and outputs are filtered alike, which does not change a linear model. The first sample is not averaged, since
    a model starts there; its drives are those of a straight line through the first block. The log is returned unchanged
    if its drives have gaps, or if so many samples are missing that few blocks are whole.

    Parameters
    ----------
    longest_step : float
        Longest step of the model [s].
    block : int, optional
        Samples a block, odd; that of `odd_block` if not given [count].

    Returns
    -------
    GreyBoxLog
        The log, at the longer sample time.
    """
    block = odd_block(log.sample_time) if block is None else block
    begun = block // 2 + 1
    if block == 1 or log.gaps.size or len(log.drives) < begun + block:
        return log
    outputs = block_means(log.measured[begun:], block)
    if block * np.count_nonzero(np.isfinite(outputs)) < (1.0 - MOST_LOST) * np.count_nonzero(np.isfinite(log.measured)):
        return log
    line = np.linalg.lstsq(np.vander(np.arange(block), 2), log.drives[:block], rcond=None)[0]
    sample_time = block * log.sample_time
    return replace(
        log,
        drives=np.vstack([line[1], block_means(log.drives[begun:], block)]),
        measured=np.vstack([np.full(outputs.shape[1], np.nan), outputs]),
        sample_time=sample_time,
        steps=np.full(len(outputs) + 1, steps_a_sample(sample_time, longest_step)),
        noise=tuple(noise.scaled(1.0 / block) for noise in log.noise),
        drive_std=tuple(spread / block**0.5 for spread in log.drive_std),
        mean_rows=1 if block == log.mean_rows else log.mean_rows,
    )
