"""The compiled watch: samples to intervals, intervals to blocks, and what each block says.

Samples are averaged over *intervals* of some milliseconds, from which `faults.watch.balances` learns. The squared
innovations of a *block* of intervals are its NIS, which feeds the CUSUM of `faults.watch.cusum`. Beside them
`faults.watch.loss` judges what is lost, by *spans* of blocks.
"""

import math
from functools import cache

import numpy as np

from faults.watch import balances, cusum, excitation, loss
from faults.watch.balances import FEATURES, count_gains, learn, regress, shift, solve
from faults.watch.cusum import PEAK, SQUARES, SUM, THRESHOLD, accumulate, threshold
from faults.watch.excitation import OCTAVES, excitation_octave, standardise
from faults.watch.loss import (
    BLOCKS,
    DELAYS,
    LEAST_LEARNT,
    SPAN,
    SPANS,
    WANTED,
    count_lag,
    count_work,
    drive_is_alike,
    judge_loss,
    learn_loss_again,
    measure_lag,
    measure_work,
)
from faults.watch.memory import Memory, WatchSetting, WatchSizes
from plant.arrays import Array
from plant.compiled.native.load import NativeKernel, load_native
from plant.compiled.native.signature import signature_of
from plant.compiled.paste import kernel_text, pasted

ALLOWANCE = 1.0
"""What a block's score must exceed for the CUSUM to rise [standard deviations]: more than oil's drift moves it by."""

LEVEL = 0.02
"""Distance of the levels at which peaks are counted [standard deviations]."""

MOVING = 0.05
"""Share of rated speed below which the actuator is at rest, and nothing is learnt or judged [fraction]."""

INTERVALS = 10
"""Intervals a block."""

NOTHING, READY, LOSS = -1, 100, 101
"""What a block may say, beside which balance raises an alarm: nothing, that the thresholds have been learnt, and that
more is lost."""

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
    partial, clock, lags, information, moment, found, score, _, _, gains, _, work, speeds, lag, lost, _, _ = memory
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
                partial[7] += (w - lags[2]) ** 2
                for c in range(score.shape[0]):
                    error = learn(c, features, target, fade, information, moment, found)
                    score[c, SQUARES] += error * error
                count_gains(w, v, p, int(clock[0]) % gains.shape[0], gains)
                if score.shape[0] == 2:
                    count_work(w, v, p, work)
            if score.shape[0] == 1:
                count_lag(w, v, partial[4] > DELAYS + 1.0 and abs(w) > MOVING, speeds, lag, lost)
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
    partial, clock, _, information, moment, found, score, peaks, scores, gains, usual, _, _, _, _, known, _ = memory
    _, settle, learning, resume = sizes
    _, score_memory, false_alarms, _, _, _ = setting
    usable, recent, octave = partial[5], scores.shape[1], excitation_octave(partial[7])
    excited = octave * OCTAVES + int(partial[8])
    partial[5] = partial[6] = partial[7] = 0.0
    partial[8] = octave
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
        if since > settle:
            u = standardise(value, score_memory, since > 2.0 * settle, usual[c, excited])
            scores[c, place] = u
            if since > resume:
                accumulate(score[c], peaks[c], u, ALLOWANCE, LEVEL)
        else:
            scores[c, place] = 0.0
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
            known[WANTED] = max(known[SPANS], LEAST_LEARNT)
            return READY
    if news >= 0:
        peaks[news, peaks.shape[1] - 1] += 1.0
        return news
    known[BLOCKS] += 1.0
    return LOSS if known[BLOCKS] >= SPAN and end_span(memory) else NOTHING


def end_span(memory: Memory) -> bool:
    """Judge what was lost in a whole span; return whether it is more than warming oil explains."""
    _, clock, _, _, _, _, score, _, _, _, _, work, _, lag, lost, known, levels = memory
    told = np.empty(6)
    if score.shape[0] == 2:
        measure_work(work, told)
    else:
        measure_lag(lag, lost, told)
    drop_span(memory)
    return told[3] > 0.0 and drive_is_alike(told, known) and judge_loss(told, clock[0], known, levels)


def drop_span(memory: Memory) -> None:
    """Begin a span anew."""
    _, _, _, _, _, _, _, _, _, _, _, work, _, lag, lost, known, _ = memory
    known[BLOCKS] = 0.0
    work[:] = 0.0
    lag[:] = 0.0
    lost[:] = 0.0


def begin_again(memory: Memory) -> None:
    """Forget most of what the balances were, after an alarm: they are learnt again, what the peaks said is kept."""
    _, clock, _, information, moment, _, score, _, _, _, usual, _, _, _, _, _, _ = memory
    clock[2] = clock[1]
    information *= 0.01
    moment *= 0.01
    score[:, SUM : PEAK + 1] = 0.0
    score[:, SQUARES] = 0.0
    usual[:] = 0.0
    drop_span(memory)


@cache
def watch_kernel() -> NativeKernel:
    """Return the compiled kernel: `advance`, `begin_again` and `threshold`."""
    constants = {
        name: value
        for module in (balances, cusum, excitation, loss)
        for name, value in vars(module).items()
        if name.isupper() and isinstance(value, int | float)
    }
    constants |= {"NOTHING": NOTHING, "READY": READY, "LOSS": LOSS, "REFRESHED": REFRESHED, "INTERVALS": INTERVALS}
    constants |= {"ALLOWANCE": ALLOWANCE, "LEVEL": LEVEL, "MOVING": MOVING}
    of_balances = (regress, shift, learn, count_gains, solve, accumulate, excitation_octave, standardise)
    of_loss = (count_work, count_lag, measure_work, measure_lag, learn_loss_again, drive_is_alike, judge_loss)
    small = pasted(*of_balances, *of_loss, drop_span, end_span, end_block, constants=constants, inlined=True)
    entries = threshold, advance, begin_again
    large = pasted(*entries)
    text = kernel_text("the watch over flow and force balances", small, large)
    return load_native("watch", text, {one.__name__: signature_of(one) for one in entries})
