"""Slow growth of leakage: the lost share of the pumped flow, span by span, compared with the effect of warming oil.

The balances of `faults.watch.balances` forget within half a minute, so they learn slower growth and do not detect it. A
*span* of some seconds measures the loss. With pressure it is a share of the pump's work, in which compressed oil
returns the work it took. Without pressure it is the part of the speed that the piston never follows, from a regression
in which the piston's lag has its own coefficients.

Thinner oil leaks more, but at most in inverse proportion to its viscosity (`OIL`); a larger loss is a leak. A change of
load or speed is not a leak. Relative to pumped flow, lost flow rises with load; relative to pressure it does not.
Relative to pumped flow it rises at lower speed; relative to time it does not. So the smaller of the two shares counts.
Without pressure that is not enough, since the lag depends on the drive: only spans with a drive like the learnt one
count.
"""

import math

import numpy as np

from faults.watch.balances import BENT, solve
from plant.arrays import Array

DELAYS = 16
"""Intervals in the regression of the piston's lag behind the motor."""

WORK = 5
"""Sums of a span with pressure."""

WORK_QP, WORK_WP, WORK_PP, WORK_PV, WORK_VV = range(WORK)
"""Indices of these: q p, the magnitude of w p, p p, p v and v v."""

SPAN_RESULTS = 6
"""Results of a span."""

SPAN_SHARE, SPAN_OTHER_SHARE, SPAN_RATIO, SPAN_RESISTANCE, SPAN_FAST, SPAN_LIVELY = range(SPAN_RESULTS)
"""Indices of these: two lost shares, the ratio that makes them comparable, pressure at a velocity (0 for a span without
a result), and how fast and how lively the drive is."""

OIL = 2.0
"""Largest rise of the loss by thinner oil [fraction]: the viscosity of VG 46 halves in 23 K (judged)."""

LEAST_LOSS = 0.05
"""Least loss for comparison [fraction]: a rig's entries may be wrong by that much (judged)."""

LEAST_UNEXPLAINED = 0.02
"""Least share of the speed that its previous changes must leave unexplained [fraction], so that lost speed and lag can
be separated."""

ALIKE = 1.25
"""Factor by which a span's drive may differ from the one learnt, without pressure [fraction] (judged)."""

SPAN = 200
"""Blocks of motion in a span."""

LEARNT = 12.0
"""Spans from which the usual loss is learnt again after an alarm [count]."""

LEAST_LEARNT = 3.0
"""Least number of spans [count]."""

ALLOWED = 0.5
"""Score of a span above which the CUSUM rises [standard deviations]."""

LARGEST = 4.0
"""Limit of a span's score [standard deviations]: two spans cannot decide."""

NARROWEST = 0.1
"""Least standard deviation of a span, over the largest effect of oil [fraction] (judged)."""

SPREAD_MEMORY = 360.0
"""Spans from which the standard deviation is determined [count]."""

OVERSHOOT = 1.166
"""Twice the overshoot of a CUSUM (Siegmund, Sequential Analysis, 1985, chapter X.2) [standard deviations]."""

BLOCKS, SPANS, WANTED, SHARE, RATIO, RESISTANCE, FAST, LIVELY, OTHERS = range(9)
"""Indices in the memory of the loss: blocks in the span; spans in the usual loss, and how many it needs; the usual
share, ratio of the two shares, pressure at a velocity, and how fast and lively the drive is; successive spans of
another drive."""

SPREAD, KNOWN, LAST, LAST_RESISTANCE, RISEN, LIMIT, SEEN = range(9, 16)
"""Further indices: variance of a span, and the number of spans behind it; the last level, and the last pressure at a
velocity; the CUSUM and its threshold [standard deviations]; spans so far."""


def count_work(w: float, v: float, p: float, work: Array) -> None:
    """Add an interval to the span's sums."""
    work[WORK_QP] += (w - v) * p
    work[WORK_WP] += abs(w * p)
    work[WORK_PP] += p * p
    work[WORK_PV] += p * v
    work[WORK_VV] += v * v


def count_lag(w: float, v: float, full: bool, speeds: Array, lag: Array, lost: Array) -> None:
    """Add an interval to the normal equations of lost speed, once the previous speeds are known.

    Parameters
    ----------
    w, v : float
        Speed and velocity, relative to the rated ones [dimensionless].
    full : bool
        Whether the previous speeds are consecutive.
    speeds : ndarray, shape (2, delays + 2)
        The last speeds, and the regressors: speed, its last changes, its direction.
    lag : ndarray, shape (delays + 2, delays + 2)
        Information of the regressors.
    lost : ndarray, shape (delays + 2,)
        Their moment with lost speed.
    """
    later = w
    for i in range(DELAYS + 1):
        earlier = speeds[0, i]
        speeds[0, i] = later
        later = earlier
    if not full:
        return
    speeds[1, 0] = w
    speeds[1, DELAYS + 1] = w / (abs(w) + BENT)
    for i in range(DELAYS):
        speeds[1, i + 1] = speeds[0, i] - speeds[0, i + 1]
    for i in range(DELAYS + 2):
        lost[i] += speeds[1, i] * (w - v)
        for j in range(i + 1):
            lag[i, j] += speeds[1, i] * speeds[1, j]


def measure_work(work: Array, told: Array) -> None:
    """Set the results of a span with pressure: lost shares of the pump's work and of pressure; none at rest.

    Parameters
    ----------
    work : ndarray, shape (5,)
        Sums of the span.
    told : ndarray, shape (6,)
        Results, by index, see `SPAN_SHARE`; how fast and how lively the drive is does not matter here [dimensionless].
    """
    told[SPAN_RESISTANCE], told[SPAN_FAST], told[SPAN_LIVELY] = 0.0, 1.0, 1.0
    if min(work[WORK_WP], work[WORK_PP], work[WORK_VV]) > 0.0:
        told[SPAN_SHARE], told[SPAN_OTHER_SHARE] = work[WORK_QP] / work[WORK_WP], work[WORK_QP] / work[WORK_PP]
        told[SPAN_RATIO], told[SPAN_RESISTANCE] = work[WORK_PP] / work[WORK_WP], work[WORK_PV] / work[WORK_VV]


def measure_lag(lag: Array, lost: Array, told: Array) -> None:
    """Set the results of a span without pressure: lost shares of speed and of its direction, as in `measure_work`.

    There is no result if the drive's changes determine its speed, as for a sine: the lag is then arbitrary.
    """
    last = DELAYS + 1
    told[SPAN_RESISTANCE] = 0.0
    if min(lag[0, 0], lag[last, last]) <= 0.0:
        return
    found, factor, first = np.empty(last), np.empty((last, last)), np.zeros(last)
    first[0] = 1.0
    solve(lag[:last, :last], first, found, factor)
    told[SPAN_RESISTANCE] = 1.0 if found[0] * lag[0, 0] * LEAST_UNEXPLAINED < 1.0 else 0.0
    solve(lag[:last, :last], lost[:last], found, factor)
    told[SPAN_SHARE] = found[0]
    told[SPAN_FAST], told[SPAN_LIVELY] = lag[0, 0] / lag[last, last], lag[1, 1] / lag[0, 0]
    solve(lag[1:, 1:], lost[1:], found, factor)
    told[SPAN_OTHER_SHARE], told[SPAN_RATIO] = found[last - 1], lag[last, 0] / lag[0, 0]


def drive_is_alike(told: Array, loss: Array) -> bool:
    """Return whether a span's drive is like the one learnt; a lasting change of drive is learnt instead."""
    if loss[SPANS] < loss[WANTED]:
        return True
    fast, lively = told[SPAN_FAST] / loss[FAST], told[SPAN_LIVELY] / loss[LIVELY]
    if max(fast, lively) <= ALIKE and min(fast, lively) >= 1.0 / ALIKE:
        loss[OTHERS] = 0.0
        return True
    loss[OTHERS] += 1.0
    if loss[OTHERS] >= LEARNT:
        learn_loss_again(loss)
    return False


def judge_loss(told: Array, now: float, loss: Array, levels: Array) -> bool:
    """Process the results of a span; return whether the loss exceeds the effect of warming oil.

    Parameters
    ----------
    told : ndarray, shape (6,)
        Results of the span, from `measure_work` or `measure_lag`.
    now : float
        Blocks so far [count].
    loss : ndarray, shape (16,)
        State of the loss.
    levels : ndarray, shape (spans, 2)
        Level and end [blocks] of the last spans.
    """
    if loss[SPANS] < loss[WANTED]:
        loss[SPANS] += 1.0
        loss[SHARE] += (told[SPAN_SHARE] - loss[SHARE]) / loss[SPANS]
        loss[RATIO] += (told[SPAN_RATIO] - loss[RATIO]) / loss[SPANS]
        loss[RESISTANCE] += (told[SPAN_RESISTANCE] - loss[RESISTANCE]) / loss[SPANS]
        loss[FAST] += (told[SPAN_FAST] - loss[FAST]) / loss[SPANS]
        loss[LIVELY] += (told[SPAN_LIVELY] - loss[LIVELY]) / loss[SPANS]
    level = min(told[SPAN_SHARE], loss[RATIO] * told[SPAN_OTHER_SHARE])
    if loss[SEEN] > 0.0:
        apart = 0.5 * (level - loss[LAST]) ** 2
        if loss[KNOWN] >= LEAST_LEARNT:
            apart = min(apart, 9.0 * loss[SPREAD])
        loss[KNOWN] = min(loss[KNOWN] + 1.0, SPREAD_MEMORY)
        loss[SPREAD] += (apart - loss[SPREAD]) / loss[KNOWN]
    place = int(loss[SEEN]) % levels.shape[0]
    levels[place, 0], levels[place, 1] = level, now
    loss[LAST], loss[LAST_RESISTANCE] = level, told[SPAN_RESISTANCE]
    loss[SEEN] += 1.0
    if loss[SPANS] < loss[WANTED]:
        return False
    allowed = oil_allowance(loss[SHARE])
    deviation = max(math.sqrt(loss[SPREAD]) * (1.0 + 2.0 / math.sqrt(loss[KNOWN] + 1.0)), NARROWEST * allowed)
    loss[RISEN] = max(0.0, loss[RISEN] + min((level - loss[SHARE] - allowed) / deviation, LARGEST) - ALLOWED)
    return loss[RISEN] > loss[LIMIT]


def oil_allowance(usual: float) -> float:
    """Return how much the loss may exceed the usual one before it is a leak [fraction]."""
    return (OIL - 1.0) * max(usual, LEAST_LOSS)


def learn_loss_again(loss: Array) -> None:
    """Forget the usual loss: the present one is usual from here on."""
    loss[SPANS] = loss[RISEN] = loss[OTHERS] = 0.0
    loss[WANTED] = LEARNT


def loss_threshold(expected: float) -> float:
    """Return the threshold that the CUSUM of white Gaussian scores exceeds at a given rate (Siegmund's approximation).

    Parameters
    ----------
    expected : float
        Expected alarms per span [count].

    Returns
    -------
    float
        The threshold [standard deviations], for the thinnest oil that `OIL` allows: cooler oil exceeds it less often.

    Examples
    --------
    >>> round(loss_threshold(1e-4), 2)
    7.35
    """
    reach = 1.0
    for _ in range(50):
        reach = math.log(2.0 * ALLOWED**2 / expected + 2.0 * ALLOWED * reach + 1.0) / (2.0 * ALLOWED)
    return max(reach - OVERSHOOT, 1.0)
