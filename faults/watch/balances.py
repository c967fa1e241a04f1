"""Balances of flow, force and motion that learn themselves, by recursive least squares with fading memory.

A balance predicts one quantity of an interval from the others and from the last intervals: for flow, the part of the
pump's delivery that the piston does not sweep (equation 5.8); for force, pressure (equation 5.9); without pressure, the
piston's motion. Quantities are relative to the actuator's ratings: speed ``w``, velocity ``v``, pressure ``p``, and ``q
= w - v``.
"""

import math

from plant.arrays import Array

FEATURES = 8
"""Regressors of a balance."""

GAINS = 5
"""Number of sums of a block from which the gains follow."""

GAIN_QP, GAIN_WP, GAIN_PV, GAIN_VV, GAIN_PP = range(GAINS)
"""Indices of these sums: q p, w p, p v, v v and p p."""

V1, V2, W1, P1, P2, Q1, Q2 = range(7)
"""Indices in the last intervals: velocity, pressure and lost speed of the last two, speed of the last one."""

BENT = 0.05
"""Speed or velocity at which the term that depends on the direction of motion is half of its full value [fraction]."""


def regress(w: float, v: float, p: float, lags: Array, features: Array, target: Array) -> None:
    """Set the regressors and the target of each balance, from an interval and the last two."""
    v1, v2, w1, p1, p2, q1, q2 = lags[V1], lags[V2], lags[W1], lags[P1], lags[P2], lags[Q1], lags[Q2]
    bent, bent1 = w / (abs(w) + BENT), w1 / (abs(w1) + BENT)
    rub, rub1 = v / (abs(v) + BENT), v1 / (abs(v1) + BENT)
    if target.shape[0] == 2:
        target[0], target[1] = w - v, p
        features[0, 0], features[0, 1], features[0, 2], features[0, 3], features[0, 4] = q1, q2, p, p1, p2
        features[0, 5], features[0, 6], features[0, 7] = w, w1, bent
        features[1, 0], features[1, 1], features[1, 2], features[1, 3] = p1, p2, v * abs(v), v
        features[1, 4], features[1, 5], features[1, 6], features[1, 7] = v1, v2, rub, rub1
    else:
        target[0] = v
        features[0, 0], features[0, 1], features[0, 2], features[0, 3] = v1, v2, w, w1
        features[0, 4], features[0, 5], features[0, 6], features[0, 7] = bent, bent1, w * abs(w), rub1


def shift(w: float, v: float, p: float, lags: Array) -> None:
    """Make the interval the last one."""
    lags[V2], lags[V1], lags[W1] = lags[V1], v, w
    lags[P2], lags[P1], lags[Q2], lags[Q1] = lags[P1], p, lags[Q1], w - v


def learn(
    c: int, features: Array, target: Array, fade: float, information: Array, moment: Array, found: Array
) -> float:
    """Add an interval to the faded normal equations of balance c; return its prediction error."""
    error = target[c]
    for i in range(FEATURES):
        error -= found[c, i] * features[c, i]
    for i in range(FEATURES):
        moment[c, i] = fade * moment[c, i] + features[c, i] * target[c]
        for j in range(i + 1):
            information[c, i, j] = fade * information[c, i, j] + features[c, i] * features[c, j]
    return error


def count_gains(w: float, v: float, p: float, place: int, gains: Array) -> None:
    """Add an interval to the sums of its block: lost flow against pressure, and the force of motion."""
    gains[place, GAIN_QP] += (w - v) * p
    gains[place, GAIN_WP] += w * p
    gains[place, GAIN_PV] += p * v
    gains[place, GAIN_VV] += v * v
    gains[place, GAIN_PP] += p * p


def solve(information: Array, moment: Array, found: Array, factor: Array) -> None:
    """Solve the normal equations by Cholesky factors; a ridge of 1e-8 keeps unexcited coefficients at zero."""
    n = len(moment)
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
