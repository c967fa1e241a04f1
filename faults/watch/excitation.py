"""Excitation of a block by the drive: scores are compared with those of similarly excited blocks.

A balance's residual depends on the drive: it is larger after a reversal than in steady motion, and the balance fits one
amplitude better than another. Blocks fall into classes, by the octaves of the change of speed in the block and in the
block before, or that the actuator stood still before, and by mean speed. Each class has its own usual log NIS, so the
drive's pattern raises no score, and a new kind of drive is learnt before it is judged.
"""

import math

from plant.arrays import Array

OCTAVES = 13
"""Number of octaves of excitation; the first and last are open."""

STILL = 1e-3
"""Excitation below which a block counts as steady: a change of speed by 3 % of rated speed, squared [dimensionless]."""

SPEED_CLASSES, SPEED_RATIO, SLOWEST_SPEED = 17, 1.25, 0.05
"""Number of classes by mean speed, the factor from one to the next, and the end of the first, relative to the rated
speed [fraction]."""

MEAN, VARIANCE, COUNT, LAST_BLOCK = range(4)
"""Indices in the usual values of a class: mean and variance of its log NIS, its number of blocks, up to the memory, and
its last block."""

STALE = 8.0
"""Memories after which a class that did not occur is learnt again: the balances have forgotten its drive."""

LARGEST_SCORE = 8.0
"""Cap of a block's score [standard deviations]."""

WIDENED = 2.0
"""Widening of the deviation of a class that is known from few blocks, over the root of one over their number
[dimensionless]: as for a span of the loss."""

LEAST_BLOCKS = 20.0
"""Number of blocks of a class before its scores count [count]."""


def excitation_octave(change: float) -> int:
    """Return the octave of a block's sum of squared speed changes, which are relative to rated speed."""
    return min(max(int(math.log(change / STILL + 1.0) / math.log(2.0)), 0), OCTAVES - 1)


def speed_class(fast: float) -> int:
    """Return the class of a block's mean speed, which is relative to the rated speed."""
    if fast <= SLOWEST_SPEED:
        return 0
    return min(1 + int(math.log(fast / SLOWEST_SPEED) / math.log(SPEED_RATIO)), SPEED_CLASSES - 1)


def standardise(value: float, memory: float, judged: bool, least: float, now: float, usual: Array) -> float:
    """Return how far a log NIS exceeds the usual value of its class, and update the usual value.

    Parameters
    ----------
    value : float
        Logarithm of a block's NIS [dimensionless].
    memory : float
        Number of blocks of a class that are remembered [count].
    judged : bool
        Whether the block counts; 0 is returned otherwise, and while too few blocks of the class are known.
    least : float
        Least standard deviation of the class [dimensionless].
    now : float
        Blocks in motion so far [count].
    usual : ndarray, shape (4,)
        Mean, variance, count and last block of the class; a class that did not occur for long is learnt again.

    Returns
    -------
    float
        The score [standard deviations].
    """
    if now - usual[LAST_BLOCK] > STALE * memory:
        usual[COUNT] = 0.0
    usual[LAST_BLOCK] = now
    away, score = value - usual[MEAN], 0.0
    if judged and usual[COUNT] >= LEAST_BLOCKS:
        few = 1.0 + WIDENED * (1.0 / math.sqrt(usual[COUNT]) - 1.0 / math.sqrt(memory))
        score = min(away / (few * max(math.sqrt(usual[VARIANCE] + 1e-12), least)), LARGEST_SCORE)
    usual[COUNT] = min(usual[COUNT] + 1.0, memory)
    share = 1.0 / usual[COUNT]
    usual[MEAN] += share * away
    usual[VARIANCE] += share * (away * away * (1.0 - share) - usual[VARIANCE])
    return score
