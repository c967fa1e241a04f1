"""The compiled watch: balances of flow and force that learn themselves, and a CUSUM on what they leave.

Samples are averaged over *intervals* of some milliseconds. In each, a balance predicts one quantity from the others and
from the last intervals by recursive least squares with fading memory, so that slow drift of the oil is followed. The
squared innovations of a *block* of intervals are its NIS; their logarithm, standardised by its running mean and
deviation, feeds the CUSUM of Page (Biometrika 41, 1954, page 100).
"""

from functools import cache
from types import ModuleType

from plant.compiled.kernel_file import load_kernel

INTERVALS = 10
"""Intervals a block."""

RECENT = 512
"""Blocks whose scores and gains are remembered for the change estimate."""

LEVELS = 4096
"""Levels at which the peaks of the CUSUM are counted."""

PARTIAL, CLOCK, SCORE = 7, 4, 7
"""Lengths of the kernel's arrays: the interval under way, the clock, and a balance's score."""

FEATURES = 8
"""Regressors of a balance."""

GAINS = 4
"""Sums of a block from which gains follow: of (w - v) p, w p, p v and v v."""

_KERNEL = '''"""Generated: the watch over flow and force balances."""

import math

import numba
import numpy as np


@numba.njit(cache=True, nogil=True, error_model="numpy")
def solve(information, moment, found):
    """Solve the normal equations by Cholesky's factors; a ridge of 1e-8 keeps what was never excited at zero."""
    n = len(moment)
    factor = np.empty((n, n))
    for i in range(n):
        for j in range(i + 1):
            total = information[i, j]
            if i == j:
                total += 1e-8 * information[i, i] + 1e-12
            for k in range(j):
                total -= factor[i, k] * factor[j, k]
            factor[i, j] = math.sqrt(max(total, 1e-12)) if i == j else total / factor[j, j]
    for i in range(n):
        total = moment[i]
        for k in range(i):
            total -= factor[i, k] * found[k]
        found[i] = total / factor[i, i]
    for i in range(n - 1, -1, -1):
        total = found[i]
        for k in range(i + 1, n):
            total -= factor[k, i] * found[k]
        found[i] = total / factor[i, i]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def threshold(peaks, alarms, width, expected):
    """Return the level that peaks are expected to pass `expected` times in the time that they were gathered."""
    total = alarms
    for count in peaks:
        total += count
    wanted = max(20.0, total ** (2.0 / 3.0))
    above, place = alarms, len(peaks)
    while place > 0 and above < wanted:
        place -= 1
        above += peaks[place]
    below = alarms
    excess = 0.0
    for i in range(place, len(peaks)):
        excess += peaks[i] * (i - place + 0.5) * width
    gathered = above - below
    if gathered < 1.0:
        return math.inf
    if above <= expected:
        return place * width
    mean = excess / gathered
    if below > 0.0:
        # an alarm ends its excursion at the threshold: its peak is at least that (censored exponential)
        for _ in range(3):
            level = gathered * mean * ((above / expected) ** (1.0 / gathered) - 1.0)
            mean = (excess + below * level) / gathered
    return place * width + gathered * mean * ((above / expected) ** (1.0 / gathered) - 1.0)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def advance(
    rows, first, setting, sizes, partial, clock, lags, information, moment, found, score, peaks, scores, gains
):
    """Take samples from `first` on, up to the end of them or of a block with news; return where, and the balance."""
    samples, balances = int(sizes[0]), int(sizes[1])
    intervals, settle, learn, resume = int(sizes[2]), sizes[3], sizes[4], sizes[5]
    fade, memory, allowance, cap, width, moving = (
        setting[0], setting[1], setting[2], setting[3], setting[4], setting[5]
    )
    rate, speed_size, velocity_size, pressure_size = setting[6], setting[7], setting[8], setting[9]
    recent = scores.shape[1]
    f = np.empty((2, 8))
    target = np.empty(2)
    for k in range(first, rows.shape[0]):
        partial[0] += 1.0
        partial[1] += rows[k, 0]
        partial[2] += rows[k, 2]
        if partial[0] < samples:
            continue
        w = partial[1] / (samples * speed_size)
        p = partial[2] / (samples * pressure_size)
        v = (rows[k, 1] - partial[3]) / (samples * velocity_size)
        partial[0] = partial[1] = partial[2] = 0.0
        partial[3] = rows[k, 1]
        sound = math.isfinite(w) and math.isfinite(v) and math.isfinite(p)
        partial[4] = partial[4] + 1.0 if sound else 0.0
        if sound:
            v1, v2, w1, p1, p2, q1, q2 = lags[0], lags[1], lags[2], lags[3], lags[4], lags[5], lags[6]
            bent, bent1 = w / (abs(w) + 0.05), w1 / (abs(w1) + 0.05)
            if balances == 2:
                target[0], target[1] = w - v, p
                f[0, 0], f[0, 1], f[0, 2], f[0, 3], f[0, 4] = q1, q2, p, p1, p2
                f[0, 5], f[0, 6], f[0, 7] = w, w1, bent
                f[1, 0], f[1, 1], f[1, 2], f[1, 3], f[1, 4], f[1, 5] = p1, p2, v * abs(v), v, v1, v2
                f[1, 6], f[1, 7] = v / (abs(v) + 0.05), v1 / (abs(v1) + 0.05)
            else:
                target[0] = v
                f[0, 0], f[0, 1], f[0, 2], f[0, 3], f[0, 4], f[0, 5] = v1, v2, w, w1, bent, bent1
                f[0, 6], f[0, 7] = w * abs(w), v1 / (abs(v1) + 0.05)
            if partial[4] > 3.0 and abs(w) + abs(w1) + abs(v) > moving:
                partial[5] += 1.0
                for c in range(balances):
                    error = target[c]
                    for i in range(8):
                        error -= found[c, i] * f[c, i]
                    score[c, 6] += error * error
                    for i in range(8):
                        moment[c, i] = fade * moment[c, i] + f[c, i] * target[c]
                        for j in range(i + 1):
                            information[c, i, j] = fade * information[c, i, j] + f[c, i] * f[c, j]
                place = int(clock[0]) % recent
                gains[place, 0] += (w - v) * p
                gains[place, 1] += w * p
                gains[place, 2] += p * v
                gains[place, 3] += v * v
            lags[1], lags[0], lags[2] = v1, v, w
            lags[4], lags[3], lags[6], lags[5] = p1, p, q1, w - v
        partial[6] += 1.0
        if partial[6] < intervals:
            continue
        usable = partial[5]
        partial[5] = partial[6] = 0.0
        place = int(clock[0]) % recent
        clock[0] += 1.0
        gains[int(clock[0]) % recent, :] = 0.0
        news = -1
        if 2.0 * usable < intervals:
            scores[:, place] = np.nan
            score[:, 6] = 0.0
            continue
        clock[1] += 1.0
        since = clock[1] - clock[2]
        for c in range(balances):
            value = math.log(score[c, 6] / usable + 1e-30)
            score[c, 6] = 0.0
            solve(information[c], moment[c], found[c])
            scores[c, place] = 0.0
            if since <= settle:
                continue
            away = value - score[c, 0]
            if since > 2.0 * settle:
                u = min(away / math.sqrt(score[c, 1] + 1e-12), cap)
                scores[c, place] = u
                if since > resume:
                    score[c, 3] = max(0.0, score[c, 3] + u - allowance)
                    if score[c, 3] > 0.0:
                        score[c, 4] = max(score[c, 4], score[c, 3])
                    elif score[c, 4] > 0.0:
                        peaks[c, min(int(score[c, 4] / width), peaks.shape[1] - 1)] += 1.0
                        score[c, 4] = 0.0
            score[c, 2] += 1.0
            share = 1.0 / min(score[c, 2], memory)
            score[c, 0] += share * away
            score[c, 1] += share * (away * away * (1.0 - share) - score[c, 1])
            if score[c, 3] > score[c, 5] and clock[1] > learn and (
                news < 0 or score[c, 3] / score[c, 5] > score[news, 3] / score[news, 5]
            ):
                news = c
        if since > resume:
            clock[3] += 1.0
        if clock[1] >= learn and (int(clock[1]) % 200 == 0 or clock[1] == learn):
            for c in range(balances):
                alarms = peaks[c, peaks.shape[1] - 1]
                score[c, 5] = threshold(peaks[c, :-1], alarms, width, rate * clock[3] / balances)
            if clock[1] == learn:
                score[:, 3:5] = 0.0
                return k + 1, 100
        if news >= 0:
            peaks[news, peaks.shape[1] - 1] += 1.0
            return k + 1, news
    return rows.shape[0], -1


@numba.njit(cache=True, nogil=True, error_model="numpy")
def begin_again(clock, information, moment, score):
    """Forget most of what the balances were, after an alarm: they are learnt again, what the peaks said is kept."""
    clock[2] = clock[1]
    information *= 0.01
    moment *= 0.01
    score[:, :5] = 0.0
    score[:, 6] = 0.0
'''


@cache
def watch_kernel() -> ModuleType:
    """Return the compiled kernel: `advance`, `begin_again` and `threshold`.

    Returns
    -------
    ModuleType
        The kernel.
    """
    return load_kernel("watch", _KERNEL)
