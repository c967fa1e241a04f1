"""The compiled watch: samples to intervals, intervals to blocks, and what each block says.

Samples are averaged over *intervals* of some milliseconds, from which `faults.watch.balances` learns. The squared
innovations of a *block* of intervals are its NIS, which feeds the CUSUM of `faults.watch.cusum`.
"""

import math
from functools import cache
from typing import NamedTuple

import numpy as np

from faults.watch import balances, cusum
from faults.watch.balances import FEATURES, count_gains, learn, regress, shift, solve
from faults.watch.cusum import MEAN, PEAK, SQUARES, SUM, THRESHOLD, VARIANCE, accumulate, standardise, threshold
from plant.arrays import Array
from plant.compiled.native.load import NativeKernel, load_native
from plant.compiled.native.signature import signature_of
from plant.compiled.paste import kernel_text, pasted


class Memory(NamedTuple):
    """What a watch remembers, a row a balance; scores are dimensionless, gains in shares of the ratings.

    Parameters
    ----------
    partial : ndarray, shape (7,)
        The interval under way.
    clock : ndarray, shape (4,)
        Blocks so far: all, usable, where learning began anew, and those whose scores counted.
    lags : ndarray, shape (8,)
        The last intervals.
    information : ndarray, shape (balances, features, features)
        Of the balances' normal equations.
    moment, found : ndarray, shape (balances, features)
        Their right-hand sides, and the coefficients that follow.
    score : ndarray, shape (balances, 7)
        As `faults.watch.cusum` has it.
    peaks : ndarray, shape (balances, levels)
        How often excursions of the CUSUM peaked at a level, and alarms.
    scores : ndarray, shape (balances, recent)
        Of the last blocks.
    gains : ndarray, shape (recent, gains)
        Of the last blocks.
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


class WatchSetting(NamedTuple):
    """What a watch goes by.

    Parameters
    ----------
    fade : float
        By what a balance fades in an interval [fraction].
    score_memory : float
        Over how many blocks scores are remembered [count].
    false_alarms : float
        Alarms in a block of a healthy stream [count].
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


ALLOWANCE = 0.5
"""What a block's score must exceed for the CUSUM to rise [standard deviations]."""

LARGEST_SCORE = 8.0
"""Cap of a block's score [standard deviations]: no single block decides."""

LEVEL = 0.02
"""Distance of the levels at which peaks are counted [standard deviations]."""

MOVING = 0.05
"""Share of rated speed below which the actuator is at rest, and nothing is learnt or judged [fraction]."""

INTERVALS = 10
"""Intervals a block."""

RECENT = 512
"""Blocks whose scores and gains are remembered for the change estimate."""

LEVELS = 4096
"""Levels at which the peaks of the CUSUM are counted."""

PARTIAL, CLOCK, SCORE = 7, 4, 7
"""Lengths of the kernel's arrays: the interval under way, the clock, and a balance's score."""

NOTHING, READY = -1, 100
"""What a block may say, beside which balance raises an alarm: nothing, and that the thresholds have been learnt."""

REFRESHED = 200
"""Blocks from one look at the thresholds to the next."""


def advance(rows: Array, first: int, setting: WatchSetting, sizes: WatchSizes, memory: Memory) -> tuple[int, int]:
    """Take samples from `first` on, up to the end of them or of a block with news; return where, and the news.

    Parameters
    ----------
    rows : ndarray, shape (samples, 3)
        Motor speed [rad/s], position [m], differential pressure [Pa].
    first : int
        Which of them is the first.

    Returns
    -------
    tuple of int
        The sample after the last one taken, and what a block has said.
    """
    partial, clock, lags, information, moment, found, score, _, _, gains = memory
    fade, _, _, rated_speed, rated_step, relief = setting
    samples, _, _, _ = sizes
    features, target, factor = np.empty((2, FEATURES)), np.empty(score.shape[0]), np.empty((FEATURES, FEATURES))
    for k in range(first, rows.shape[0]):
        partial[0] += 1.0
        partial[1] += rows[k, 0]
        partial[2] += rows[k, 2]
        if partial[0] < samples:
            continue
        w = partial[1] / (samples * rated_speed)
        p = partial[2] / (samples * relief)
        v = (rows[k, 1] - partial[3]) / (samples * rated_step)
        partial[0] = partial[1] = partial[2] = 0.0
        partial[3] = rows[k, 1]
        sound = math.isfinite(w) and math.isfinite(v) and math.isfinite(p)
        partial[4] = partial[4] + 1.0 if sound else 0.0
        if sound:
            regress(w, v, p, lags, features, target)
            if partial[4] > 3.0 and abs(w) + abs(lags[2]) + abs(v) > MOVING:
                partial[5] += 1.0
                for c in range(score.shape[0]):
                    error = learn(c, features, target, fade, information, moment, found)
                    score[c, SQUARES] += error * error
                count_gains(w, v, p, int(clock[0]) % gains.shape[0], gains)
            shift(w, v, p, lags)
        partial[6] += 1.0
        if partial[6] < INTERVALS:
            continue
        news = end_block(setting, sizes, memory, factor)
        if news != NOTHING:
            return k + 1, news
    return rows.shape[0], NOTHING


def end_block(setting: WatchSetting, sizes: WatchSizes, memory: Memory, factor: Array) -> int:
    """Judge a whole block; return what it says."""
    partial, clock, _, information, moment, found, score, peaks, scores, gains = memory
    _, settle, learning, resume = sizes
    _, score_memory, false_alarms, _, _, _ = setting
    usable, recent = partial[5], scores.shape[1]
    partial[5] = partial[6] = 0.0
    place = int(clock[0]) % recent
    clock[0] += 1.0
    gains[int(clock[0]) % recent, :] = 0.0
    if 2.0 * usable < INTERVALS:
        scores[:, place] = np.nan
        score[:, SQUARES] = 0.0
        return NOTHING
    clock[1] += 1.0
    since = clock[1] - clock[2]
    news = NOTHING
    for c in range(score.shape[0]):
        value = math.log(score[c, SQUARES] / usable + 1e-30)
        score[c, SQUARES] = 0.0
        solve(information[c], moment[c], found[c], factor)
        scores[c, place] = judge(value, since, score_memory, settle, resume, score[c], peaks[c])
        if (
            score[c, SUM] > score[c, THRESHOLD]
            and clock[1] > learning
            and (news < 0 or score[c, SUM] / score[c, THRESHOLD] > score[news, SUM] / score[news, THRESHOLD])
        ):
            news = c
    if since > resume:
        clock[3] += 1.0
    if clock[1] >= learning and (int(clock[1]) % REFRESHED == 0 or clock[1] == learning):
        for c in range(score.shape[0]):
            expected = false_alarms * clock[3] / score.shape[0]
            score[c, THRESHOLD] = threshold(peaks[c, :-1], peaks[c, peaks.shape[1] - 1], LEVEL, expected)
        if clock[1] == learning:
            score[:, SUM : PEAK + 1] = 0.0
            return READY
    if news >= 0:
        peaks[news, peaks.shape[1] - 1] += 1.0
    return news


def judge(
    value: float, since: float, score_memory: float, settle: int, resume: int, score: Array, peaks: Array
) -> float:
    """Return a block's standardised score, 0 while it is learnt what is usual; add it to the CUSUM."""
    if since <= settle:
        return 0.0
    away, u = value - score[MEAN], 0.0
    if since > 2.0 * settle:
        u = min(away / math.sqrt(score[VARIANCE] + 1e-12), LARGEST_SCORE)
        if since > resume:
            accumulate(score, peaks, u, ALLOWANCE, LEVEL)
    standardise(score, away, score_memory)
    return u


def begin_again(memory: Memory) -> None:
    """Forget most of what the balances were, after an alarm: they are learnt again, what the peaks said is kept."""
    _, clock, _, information, moment, _, score, _, _, _ = memory
    clock[2] = clock[1]
    information *= 0.01
    moment *= 0.01
    score[:, : PEAK + 1] = 0.0
    score[:, SQUARES] = 0.0


@cache
def watch_kernel() -> NativeKernel:
    """Return the compiled kernel: `advance`, `begin_again` and `threshold`."""
    named = ("MEAN", "VARIANCE", "COUNT", "SUM", "PEAK", "THRESHOLD", "SQUARES")
    constants = {name: getattr(cusum, name) for name in named}
    constants |= {"FEATURES": FEATURES, "BENT": balances.BENT}
    constants |= {"NOTHING": NOTHING, "READY": READY, "REFRESHED": REFRESHED, "INTERVALS": INTERVALS}
    constants |= {"ALLOWANCE": ALLOWANCE, "LARGEST_SCORE": LARGEST_SCORE, "LEVEL": LEVEL, "MOVING": MOVING}
    parts = (regress, shift, learn, count_gains, solve, accumulate, standardise, judge, end_block)
    small = pasted(*parts, constants=constants, inlined=True)
    large = pasted(threshold, advance, begin_again)
    text = kernel_text("the watch over flow and force balances", small, large)
    return load_native("watch", text, {one.__name__: signature_of(one) for one in (advance, begin_again, threshold)})
