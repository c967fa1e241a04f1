"""The memory of a watch, its settings, and the sizes of its arrays."""

from typing import NamedTuple

import numpy as np

from faults.watch.balances import FEATURES, GAINS
from faults.watch.cusum import THRESHOLD
from faults.watch.excitation import OCTAVES, SPEED_CLASSES
from faults.watch.loss import DELAYS, LIMIT, SEEN, WANTED, WORK
from faults.watch.resolution import BEFORE, LEAST_STEP
from plant.arrays import Array

RECENT = 512
"""Blocks whose scores and gains are remembered for the change estimate."""

LEVELS = 4096
"""Number of levels at which the peaks of the CUSUM are counted."""

KEPT_SPANS = 512
"""Number of spans whose loss is remembered."""

PARTIAL, CLOCK, LAGS, SCORE = 10, 6, 8, 4
"""Lengths of arrays: the current interval and block, the clock, the last intervals, and a balance's score."""

SAMPLES, SPEED_SUM, PRESSURE_SUM, POSITION, SOUND, MOVED, WHOLE, CHANGED, OCTAVE, FAST_SUM = range(PARTIAL)
"""Indices in the current interval and block: samples of the interval, their sums of speed [rad/s] and pressure [Pa],
and position at its beginning [m]; consecutive sound intervals; intervals of the block in which the actuator moved, and
all its intervals; its sum of squared speed changes, the octave of the last block, and the sum of speeds."""

ALL, USABLE, LEARNT_FROM, SCORED, RESTED, RESTARTED = range(CLOCK)
"""Indices in the clock: blocks so far, those in motion, the number of these when learning last restarted, those whose
scores counted; those at rest since the last one in motion, and those in motion when a pause last restarted learning."""


class Memory(NamedTuple):
    """Memory of a watch, one row per balance; scores are dimensionless, gains in shares of the ratings.

    Parameters
    ----------
    partial : ndarray, shape (10,)
        The current interval and block, by index: see `SAMPLES`.
    clock : ndarray, shape (6,)
        Counters of blocks [count], by index: see `ALL`.
    lags : ndarray, shape (8,)
        The last intervals, by index: see `faults.watch.balances.V1`.
    information : ndarray, shape (balances, features, features)
        Matrices of the balances' normal equations.
    moment, found : ndarray, shape (balances, features)
        Right-hand sides of the normal equations, and their solutions.
    score : ndarray, shape (balances, 4)
        Scores, as in `faults.watch.cusum`.
    peaks : ndarray, shape (balances, levels)
        Number of CUSUM excursions that peaked at each level, and of alarms.
    scores : ndarray, shape (balances, recent)
        Scores of the last blocks.
    gains : ndarray, shape (recent, gains)
        Gain sums of the last blocks.
    usual : ndarray, shape (balances, classes, 4)
        Usual values of each class, as in `faults.watch.excitation`.
    work : ndarray, shape (5,)
        Sums of the current span, with pressure.
    speeds : ndarray, shape (2, lagged)
        The last speeds, and the regressors.
    lag : ndarray, shape (lagged, lagged)
        Information matrix of the current span, without pressure.
    lost : ndarray, shape (lagged,)
        Right-hand side of the current span, without pressure.
    known : ndarray, shape (16,)
        State of the loss, as in `faults.watch.loss`.
    levels : ndarray, shape (spans, 2)
        Levels of the last spans.
    steps : ndarray, shape (2, 3)
        Last sample and smallest step of each channel, as in `faults.watch.resolution`.
    """

    partial: Array
    clock: Array
    lags: Array
    information: Array
    moment: Array
    found: Array
    score: Array
    peaks: Array
    scores: Array
    gains: Array
    usual: Array
    work: Array
    speeds: Array
    lag: Array
    lost: Array
    known: Array
    levels: Array
    steps: Array


class WatchSetting(NamedTuple):
    """Settings of a watch.

    Parameters
    ----------
    fade : float
        Fading of a balance per interval [fraction].
    score_memory : float
        Number of blocks of a class over which scores are remembered [count].
    false_alarms : float
        Expected false alarms of the balances per block of a healthy stream [count].
    rated_speed, rated_step, relief : float
        References for speed, for the piston's travel in a sample, and for pressure [rad/s, m, Pa].
    """

    fade: float
    score_memory: float
    false_alarms: float
    rated_speed: float
    rated_step: float
    relief: float


class WatchSizes(NamedTuple):
    """Samples in an interval; blocks to settle, to learn, until scores count again, and of a long pause [count]."""

    samples: int
    settle: int
    learning: int
    resume: int
    pause: int


def empty_memory(balances: int, loss_threshold: float) -> Memory:
    """Return the memory of a watch that has seen no sample.

    Parameters
    ----------
    balances : int
        Number of balances.
    loss_threshold : float
        Threshold of the loss, in standard deviations [dimensionless].
    """
    lagged = DELAYS + 2
    balance = (FEATURES, FEATURES), (FEATURES,), (FEATURES,), (SCORE,), (LEVELS + 1,), (RECENT,)
    slow = (WORK,), (2, lagged), (lagged, lagged), (lagged,), (SEEN + 1,), (KEPT_SPANS, 2), (2, 3)
    shapes = (
        *((PARTIAL,), (CLOCK,), (LAGS,)),
        *((balances, *shape) for shape in balance),
        *((RECENT, GAINS), (balances, OCTAVES * (OCTAVES + 1) * SPEED_CLASSES, 4), *slow),
    )
    memory = Memory._make(np.zeros(shape) for shape in shapes)
    memory.partial[POSITION] = np.nan
    memory.score[:, THRESHOLD] = memory.steps[LEAST_STEP] = np.inf
    memory.steps[BEFORE] = np.nan
    memory.known[WANTED], memory.known[LIMIT] = np.inf, loss_threshold
    return memory
