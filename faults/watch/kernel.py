"""The compiled watch: samples to intervals, intervals to blocks, and the result of each block.

Samples are averaged over *intervals* of some milliseconds, from which `faults.watch.balances` learns. The squared
innovations of a *block* of intervals are its NIS, which feeds the CUSUM of `faults.watch.cusum`. In addition
`faults.watch.loss` judges the loss, by *spans* of blocks.
"""

import math
from functools import cache

import numpy as np

from faults.watch import balances, cusum, excitation, loss, memory, resolution
from faults.watch.balances import FEATURES, W1, count_gains, learn, regress, shift, solve
from faults.watch.cusum import PEAK, SQUARES, SUM, THRESHOLD, accumulate, threshold, white_threshold
from faults.watch.excitation import MEAN, OCTAVES, SPEED_CLASSES, excitation_octave, speed_class, standardise
from faults.watch.loss import (
    BLOCKS,
    DELAYS,
    LEAST_LEARNT,
    SPAN,
    SPAN_RESISTANCE,
    SPAN_RESULTS,
    SPANS,
    WANTED,
    count_lag,
    count_work,
    drive_is_alike,
    judge_loss,
    learn_loss_again,
    measure_lag,
    measure_work,
    oil_allowance,
)
from faults.watch.memory import (
    ALL,
    CHANGED,
    FAST_SUM,
    LEARNT_FROM,
    MOVED,
    OCTAVE,
    POSITION,
    PRESSURE_SUM,
    RESTARTED,
    RESTED,
    SAMPLES,
    SCORED,
    SOUND,
    SPEED_SUM,
    USABLE,
    WHOLE,
    Memory,
    WatchSetting,
    WatchSizes,
)
from faults.watch.resolution import PLACE, PRESSURE, SPEED, find_step, least_deviation, unresolved
from plant.arrays import Array
from plant.compiled.native.load import NativeKernel, load_native
from plant.compiled.native.signature import signature_of
from plant.compiled.paste import functions_text, kernel_text

ALLOWANCE = 1.0
"""Score of a block above which the CUSUM rises [standard deviations]: drift of the oil moves it by less."""

LEVEL = 0.02
"""Spacing of the levels at which peaks are counted [standard deviations]."""

MOVING = 0.05
"""Share of rated speed below which the actuator is at rest, and nothing is learnt or judged [fraction]."""

INTERVALS = 10
"""Intervals in a block."""

NOTHING, READY, LOSS = -1, 100, 101
"""Possible results of a block, besides the balance that raises an alarm: nothing, the thresholds have been learnt, and
the loss has grown."""

RELEARN = 4.0
"""Least motion between two pauses that restart learning, over the motion in which scores do not count then
[dimensionless]: at most a quarter of the motion is not judged, however often the actuator pauses."""

REFRESHED = 200
"""Number of blocks between two updates of the thresholds."""


def advance(rows: Array, first: int, setting: WatchSetting, sizes: WatchSizes, memory: Memory) -> tuple[int, int]:
    """Take samples from `first` on, until they end or a block has news; return the position reached, and the news.

    Parameters
    ----------
    rows : ndarray, shape (samples, 3)
        Motor speed [rad/s], position [m], differential pressure [Pa].
    first : int
        Index of the first sample to take.

    Returns
    -------
    tuple of int
        The sample after the last one taken, and the result of the block.
    """
    partial, lags, score = memory.partial, memory.lags, memory.score
    features, target, factor = np.empty((2, FEATURES)), np.empty(score.shape[0]), np.empty((FEATURES, FEATURES))
    for k in range(first, rows.shape[0]):
        find_step(rows[k, 0], setting.rated_speed, SPEED, memory.steps)
        find_step(rows[k, 1], setting.rated_step * sizes.samples, PLACE, memory.steps)
        find_step(rows[k, 2], setting.relief, PRESSURE, memory.steps)
        partial[SAMPLES] += 1.0
        partial[SPEED_SUM] += rows[k, 0]
        partial[PRESSURE_SUM] += rows[k, 2]
        if partial[SAMPLES] < sizes.samples:
            continue
        w = partial[SPEED_SUM] / (sizes.samples * setting.rated_speed)
        p = partial[PRESSURE_SUM] / (sizes.samples * setting.relief)
        v = (rows[k, 1] - partial[POSITION]) / (sizes.samples * setting.rated_step)
        partial[SAMPLES] = partial[SPEED_SUM] = partial[PRESSURE_SUM] = 0.0
        partial[POSITION] = rows[k, 1]
        sound = math.isfinite(w) and math.isfinite(v) and math.isfinite(p)
        partial[SOUND] = partial[SOUND] + 1.0 if sound else 0.0
        if sound:
            regress(w, v, p, lags, features, target)
            if partial[SOUND] > 3.0 and abs(w) + abs(lags[W1]) + abs(v) > MOVING:
                partial[MOVED] += 1.0
                partial[CHANGED] += (w - lags[W1]) ** 2
                partial[FAST_SUM] += abs(w)
                for c in range(score.shape[0]):
                    error = learn(c, features, target, setting.fade, memory.information, memory.moment, memory.found)
                    score[c, SQUARES] += error * error
                count_gains(w, v, p, int(memory.clock[ALL]) % memory.gains.shape[0], memory.gains)
                if score.shape[0] == 2:
                    count_work(w, v, p, memory.work)
            if score.shape[0] == 1:
                follows = partial[SOUND] > DELAYS + 1.0 and abs(w) > MOVING
                count_lag(w, v, follows, memory.speeds, memory.lag, memory.lost)
            shift(w, v, p, lags)
        partial[WHOLE] += 1.0
        if partial[WHOLE] < INTERVALS:
            continue
        news = end_block(setting, sizes, memory, factor)
        if news != NOTHING:
            return k + 1, news
    return rows.shape[0], NOTHING


def end_block(setting: WatchSetting, sizes: WatchSizes, memory: Memory, factor: Array) -> int:
    """Judge a whole block; return its result."""
    partial, clock, score, peaks, known = memory.partial, memory.clock, memory.score, memory.peaks, memory.known
    moved, recent, octave = partial[MOVED], memory.scores.shape[1], excitation_octave(partial[CHANGED])
    fast = speed_class(partial[FAST_SUM] / max(moved, 1.0))
    excited = (octave * (OCTAVES + 1) + int(partial[OCTAVE])) * SPEED_CLASSES + fast
    partial[MOVED] = partial[WHOLE] = partial[CHANGED] = partial[FAST_SUM] = 0.0
    partial[OCTAVE] = octave
    place = int(clock[ALL]) % recent
    clock[ALL] += 1.0
    memory.gains[int(clock[ALL]) % recent, :] = 0.0
    if 2.0 * moved < INTERVALS:
        partial[OCTAVE] = OCTAVES
        memory.scores[:, place] = np.nan
        score[:, SQUARES] = 0.0
        clock[RESTED] += 1.0
        return NOTHING
    rested, clock[RESTED] = clock[RESTED], 0.0
    if rested >= sizes.pause and clock[USABLE] - clock[RESTARTED] >= RELEARN * sizes.resume:
        begin_again(memory)
        clock[RESTARTED] = clock[USABLE]
    clock[USABLE] += 1.0
    since = clock[USABLE] - clock[LEARNT_FROM]
    news = score_balances(setting, sizes, memory, factor, moved, since, excited, place)
    if since > sizes.resume:
        clock[SCORED] += 1.0
    if clock[USABLE] >= sizes.learning and (int(clock[USABLE]) % REFRESHED == 0 or clock[USABLE] == sizes.learning):
        renew_thresholds(setting, memory)
        if clock[USABLE] == sizes.learning:
            score[:, SUM : PEAK + 1] = 0.0
            known[WANTED] = max(known[SPANS], LEAST_LEARNT)
            return READY
    if news >= 0:
        peaks[news, peaks.shape[1] - 1] += 1.0
        return news
    known[BLOCKS] += 1.0
    return LOSS if known[BLOCKS] >= SPAN and end_span(memory) else NOTHING


def score_balances(
    setting: WatchSetting,
    sizes: WatchSizes,
    memory: Memory,
    factor: Array,
    moved: float,
    since: float,
    excited: int,
    place: int,
) -> int:
    """Score a block by each balance; return the balance that passes its threshold by most, or that none does.

    Parameters
    ----------
    factor : ndarray, shape (features, features)
        Workspace for a factor of the information.
    moved : float
        Intervals of the block in which the actuator moved [count].
    since : float
        Usable blocks since the balances last began to learn again [count].
    excited, place : int
        Octave of the block's excitation, and the index at which its score is kept.
    """
    clock, score, peaks = memory.clock, memory.score, memory.peaks
    news = NOTHING
    for c in range(score.shape[0]):
        rounding = unresolved(c, score.shape[0], memory.steps)
        value = math.log(score[c, SQUARES] / moved + rounding + 1e-30)
        score[c, SQUARES] = 0.0
        solve(memory.information[c], memory.moment[c], memory.found[c], factor)
        if since > sizes.settle:
            usual, judged = memory.usual[c, excited], since > 2.0 * sizes.settle
            least = least_deviation(rounding, usual[MEAN])
            u = standardise(value, setting.score_memory, judged, least, clock[USABLE], usual)
            memory.scores[c, place] = u
            if since > sizes.resume:
                accumulate(score[c], peaks[c], u, ALLOWANCE, LEVEL)
        else:
            memory.scores[c, place] = 0.0
        if (
            score[c, SUM] > score[c, THRESHOLD]
            and clock[USABLE] > sizes.learning
            and (news < 0 or score[c, SUM] / score[c, THRESHOLD] > score[news, SUM] / score[news, THRESHOLD])
        ):
            news = c
    return news


def renew_thresholds(setting: WatchSetting, memory: Memory) -> None:
    """Set each balance's threshold from the peaks so far, so that together they give the allowed false-alarm rate.

    White noise has the lowest, which is also that of a stream without peaks.
    """
    score, peaks = memory.score, memory.peaks
    rate = setting.false_alarms / score.shape[0]
    for c in range(score.shape[0]):
        expected = rate * memory.clock[SCORED]
        learnt, least = threshold(peaks[c, :-1], peaks[c, peaks.shape[1] - 1], LEVEL, expected), white_threshold(rate)
        score[c, THRESHOLD] = learnt if least < learnt < math.inf else least


def end_span(memory: Memory) -> bool:
    """Judge the loss in a whole span; return whether it exceeds what warming oil explains."""
    told, known = np.empty(SPAN_RESULTS), memory.known
    if memory.score.shape[0] == 2:
        measure_work(memory.work, told)
    else:
        measure_lag(memory.lag, memory.lost, told)
    drop_span(memory)
    tells = told[SPAN_RESISTANCE] > 0.0 and drive_is_alike(told, known)
    return tells and judge_loss(told, memory.clock[ALL], known, memory.levels)


def drop_span(memory: Memory) -> None:
    """Discard the current span and begin a new one."""
    memory.known[BLOCKS] = 0.0
    memory.work[:] = 0.0
    memory.lag[:] = 0.0
    memory.lost[:] = 0.0


def begin_again(memory: Memory) -> None:
    """Forget most of the balances' state after an alarm or a pause, so that they are learnt again; peaks are kept."""
    information, moment, score = memory.information, memory.moment, memory.score
    memory.clock[LEARNT_FROM] = memory.clock[USABLE]
    information *= 0.01
    moment *= 0.01
    score[:, SUM : PEAK + 1] = 0.0
    score[:, SQUARES] = 0.0
    memory.usual[:] = 0.0
    drop_span(memory)


@cache
def watch_kernel() -> NativeKernel:
    """Return the compiled kernel: `advance`, `begin_again` and `threshold`."""
    constants = {
        name: value
        for module in (balances, cusum, excitation, loss, memory, resolution)
        for name, value in vars(module).items()
        if name.isupper() and isinstance(value, int | float)
    }
    constants |= {"NOTHING": NOTHING, "READY": READY, "LOSS": LOSS, "REFRESHED": REFRESHED, "INTERVALS": INTERVALS}
    constants |= {"RELEARN": RELEARN, "ALLOWANCE": ALLOWANCE, "LEVEL": LEVEL, "MOVING": MOVING}
    of_balances = (
        regress,
        shift,
        learn,
        count_gains,
        solve,
        accumulate,
        excitation_octave,
        speed_class,
        standardise,
        white_threshold,
    )
    of_steps = find_step, unresolved, least_deviation
    of_loss = (
        count_work,
        count_lag,
        measure_work,
        measure_lag,
        oil_allowance,
        learn_loss_again,
        drive_is_alike,
        judge_loss,
    )
    of_blocks = (drop_span, end_span, renew_thresholds, score_balances, end_block)
    small = functions_text(*of_balances, *of_steps, *of_loss, *of_blocks, constants=constants, inlined=True)
    entries = threshold, advance, begin_again
    large = functions_text(*entries)
    text = kernel_text("the watch over flow and force balances", small, large)
    return load_native("watch", text, {one.__name__: signature_of(one) for one in entries})
