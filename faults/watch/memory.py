"""The memory of a watch, its settings, and the sizes of its arrays."""

from typing import NamedTuple

import numpy as np

from faults.watch.balances import FEATURES, GAINS
from faults.watch.cusum import THRESHOLD
from faults.watch.excitation import OCTAVES
from faults.watch.loss import DELAYS, LIMIT, SEEN, WANTED, WORK
from plant.arrays import Array

RECENT = 512
"""Blocks whose scores and gains are remembered for the change estimate."""

LEVELS = 4096
"""Levels at which the peaks of the CUSUM are counted."""

KEPT_SPANS = 512
"""Spans of which it is remembered what was lost."""

PARTIAL, CLOCK, LAGS, SCORE = 9, 4, 8, 4
"""Lengths of arrays: the interval and block under way, the clock, the last intervals, and a balance's score."""

SAMPLES, SPEED_SUM, PRESSURE_SUM, POSITION, SOUND, MOVED, WHOLE, CHANGED, OCTAVE = range(PARTIAL)
"""Places in the interval and the block under way: its samples, the sums of speed [rad/s] and pressure [Pa] over them,
and position at its beginning [m]; sound intervals in a row; those of the block in which the actuator moved, and all of
it; the summed squared changes of speed in it, and the octave of the last block's."""

ALL, USABLE, LEARNT_FROM, SCORED = range(CLOCK)
"""Places in the clock: blocks so far, those that moved, how many of them had when learning began anew, and those whose
scores counted."""


class Memory(NamedTuple):
    """Memory of a watch, one row per balance; scores are dimensionless, gains in shares of the ratings.

    Parameters
    ----------
    partial : ndarray, shape (9,)
        The interval and the block under way, by place: see `SAMPLES`.
    clock : ndarray, shape (4,)
        Blocks so far [count], by place: see `ALL`.
    lags : ndarray, shape (8,)
        The last intervals, by place: see `faults.watch.balances.V1`.
    information : ndarray, shape (balances, features, features)
        Of the balances' normal equations.
    moment, found : ndarray, shape (balances, features)
        Their right-hand sides, and the coefficients that follow.
    score : ndarray, shape (balances, 4)
        As `faults.watch.cusum` has it.
    peaks : ndarray, shape (balances, levels)
        How often excursions of the CUSUM peaked at a level, and alarms.
    scores : ndarray, shape (balances, recent)
        Of the last blocks.
    gains : ndarray, shape (recent, gains)
        Of the last blocks.
    usual : ndarray, shape (balances, classes, 3)
        As `faults.watch.excitation` has it.
    work : ndarray, shape (5,)
        Of the span under way, with pressure.
    speeds : ndarray, shape (2, lagged)
        The last speeds, and what is regressed on.
    lag : ndarray, shape (lagged, lagged)
        Information of the span under way, without pressure.
    lost : ndarray, shape (lagged,)
        Its moment.
    known : ndarray, shape (16,)
        Of what is lost, as `faults.watch.loss` has it.
    levels : ndarray, shape (spans, 2)
        Of the last spans.
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


class WatchSetting(NamedTuple):
    """Settings of a watch.

    Parameters
    ----------
    fade : float
        By what a balance fades in an interval [fraction].
    score_memory : float
        Over how many blocks of a class scores are remembered [count].
    false_alarms : float
        Alarms of the balances in a block of a healthy stream [count].
    rated_speed, rated_step, relief : float
        What speed, the piston's way in a sample and pressure are relative to [rad/s, m, Pa].
    """

    fade: float
    score_memory: float
    false_alarms: float
    rated_speed: float
    rated_step: float
    relief: float


class WatchSizes(NamedTuple):
    """Samples an interval; blocks to settle, to learn, and until scores count again [count]."""

    samples: int
    settle: int
    learning: int
    resume: int


def empty_memory(balances: int, loss_threshold: float) -> Memory:
    """Return the memory of a watch that has seen nothing.

    Parameters
    ----------
    balances : int
        Count of the balances.
    loss_threshold : float
        That of what is lost, in standard deviations [dimensionless].
    """
    lagged = DELAYS + 2
    balance = (FEATURES, FEATURES), (FEATURES,), (FEATURES,), (SCORE,), (LEVELS + 1,), (RECENT,)
    slow = (WORK,), (2, lagged), (lagged, lagged), (lagged,), (SEEN + 1,), (KEPT_SPANS, 2)
    shapes = (
        *((PARTIAL,), (CLOCK,), (LAGS,)),
        *((balances, *shape) for shape in balance),
        *((RECENT, GAINS), (balances, OCTAVES**2, 3), *slow),
    )
    memory = Memory._make(np.zeros(shape) for shape in shapes)
    memory.partial[POSITION] = np.nan
    memory.score[:, THRESHOLD] = np.inf
    memory.known[WANTED], memory.known[LIMIT] = np.inf, loss_threshold
    return memory
