"""A level without growth that jumps once or never, followed over a series of logs: compiled."""

import math
from typing import NamedTuple

from plant.arrays import Array
from plant.compiled.native.loops import natively_compiled


class RestLimits(NamedTuple):
    """Numbers that all logs share.

    Parameters
    ----------
    gross : float
        Limit at which an innovation is clipped, in standard deviations [dimensionless].
    first_variance : float
        Variance of the level before the first log, and of the new level after a jump [dimensionless].
    log_rest : float
        Logarithm of the prior probability of rest [dimensionless].
    """

    gross: float
    first_variance: float
    log_rest: float


@natively_compiled()
def fill_rest(
    values: Array,
    stds: Array,
    steps: Array,
    log_jumps: Array,
    limits: RestLimits,
    wander: Array,
    scatter: Array,
    log_prior: Array,
    mean: Array,
    variance: Array,
    evidence: Array,
    total: Array,
    found: Array,
) -> None:
    """Fill in the logarithm of the probability of all logs so far, summed over the logs at which the level jumps.

    Row 0 is a level that never jumps. Each log begins another row, in place of the least probable if all are taken.

    Parameters
    ----------
    values, stds : ndarray, shape (n,)
        Value of each log, and its own standard deviation [dimensionless].
    steps : ndarray, shape (n,)
        Time before each log [count].
    log_jumps : ndarray, shape (n,)
        Logarithm of the prior probability of a jump before each log [dimensionless].
    wander, scatter, log_prior : ndarray, shape (g,)
        The settings without a slope, and the logarithm of their prior weights [dimensionless].
    mean, variance, evidence : ndarray, shape (rows, g)
        Room for the level under each setting, its variance, and the logarithm of the probability of the logs.
    total : ndarray, shape (rows,)
        Room for the logarithm of the probability of each row.
    found : ndarray, shape (n,)
        Output [dimensionless].
    """
    used = 0
    before = 0.0
    for k in range(values.shape[0]):
        place = used
        if used < mean.shape[0]:
            used += 1
        else:
            place = 1
            for row in range(2, used):
                if total[row] < total[place]:
                    place = row
        for row in range(used):
            best = -math.inf
            for i in range(wander.shape[0]):
                if row == place:
                    mean[row, i] = 0.0
                    variance[row, i] = limits.first_variance
                    evidence[row, i] = log_prior[i]
                    if k > 0:
                        evidence[row, i] += before + log_jumps[k]
                else:
                    variance[row, i] += wander[i] * wander[i] * steps[k]
                innovation = values[k] - mean[row, i]
                usual = variance[row, i] + stds[k] * stds[k] + scatter[i] * scatter[i]
                expected = max(usual, (innovation / limits.gross) * (innovation / limits.gross))
                evidence[row, i] -= 0.5 * (math.log(2.0 * math.pi * expected) + innovation * innovation / expected)
                gain = variance[row, i] / expected
                mean[row, i] += gain * innovation
                variance[row, i] -= gain * variance[row, i]
                best = max(best, evidence[row, i])
            share = 0.0
            for i in range(wander.shape[0]):
                share += math.exp(evidence[row, i] - best)
            total[row] = best + math.log(share)
        best = total[0]
        for row in range(1, used):
            best = max(best, total[row])
        share = 0.0
        for row in range(used):
            share += math.exp(total[row] - best)
        found[k] = best + math.log(share)
        before = total[0] - limits.log_rest
