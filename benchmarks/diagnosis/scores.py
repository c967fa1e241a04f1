"""Scores of a watch and of a diagnosis, each with an interval: false alarms, delays, shares, calibration."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from plant.errors import HydrostateError


def alarm_rate(alarms: int, hours: float, confidence: float = 0.95) -> tuple[float, tuple[float, float]]:
    """Return the rate of false alarms with its exact Poisson interval (Garwood, Biometrika 28, 1936, page 437).

    Parameters
    ----------
    alarms : int
        Alarms counted.
    hours : float
        Duration of healthy running [h].
    confidence : float
        Confidence level of the interval [fraction].

    Returns
    -------
    rate : float
        Alarms an hour [1/h].
    interval : tuple of float
        Its interval [1/h].

    Raises
    ------
    HydrostateError
        If the count is negative or the time is not positive.

    Examples
    --------
    >>> rate, (low, high) = alarm_rate(30, 30.0)
    >>> rate, round(low, 2), round(high, 2)
    (1.0, 0.67, 1.43)
    """
    if alarms < 0 or not hours > 0.0:
        raise HydrostateError(
            f"an alarm rate needs a count of 0 or more and positive hours, got {alarms} in {hours:g} h"
        )
    tail = 0.5 * (1.0 - confidence)
    low = 0.5 * float(stats.chi2.ppf(tail, 2 * alarms)) if alarms else 0.0
    high = 0.5 * float(stats.chi2.isf(tail, 2 * alarms + 2))
    return alarms / hours, (low / hours, high / hours)


def median_delay(delays: Sequence[float], confidence: float = 0.95) -> tuple[float, tuple[float, float]]:
    """Return the median detection delay with its distribution-free interval, between two order statistics.

    Parameters
    ----------
    delays : sequence of float
        Delay from fault to alarm [s], infinite if there was no alarm.
    confidence : float
        Minimum confidence of the interval, if there are enough delays [fraction].

    Returns
    -------
    median : float
        [s].
    interval : tuple of float
        Its interval [s].

    Raises
    ------
    HydrostateError
        If there is no delay.

    Examples
    --------
    >>> median_delay([0.1, 0.3, 0.2, 0.5, 0.4, 0.15, 0.25])
    (0.25, (0.1, 0.5))
    """
    if not delays:
        raise HydrostateError("a median delay needs at least one delay, got none")
    ordered = np.sort(np.asarray(delays, dtype=np.float64))
    count = len(ordered)
    rank = max(int(stats.binom.ppf(0.5 * (1.0 - confidence), count, 0.5)), 1)
    return float(np.median(ordered)), (float(ordered[rank - 1]), float(ordered[count - rank]))


def calibration_error(confidence: NDArray[np.float64], right: NDArray[np.bool_], bins: int = 15) -> float:
    """Return the expected calibration error over bins of equal count.

    Source: Naeini, Cooper and Hauskrecht, AAAI 2015, equation 3, with equal counts in place of equal widths.

    Parameters
    ----------
    confidence : ndarray, shape (n,)
        Probability assigned to each answer [probability].
    right : ndarray, shape (n,)
        Whether each answer was right.
    bins : int
        Number of bins.

    Returns
    -------
    float
        Mean gap between confidence and share of right answers [probability].

    Examples
    --------
    >>> round(calibration_error(np.array([0.9, 0.9]), np.array([True, False]), 1), 3)
    0.4
    """
    order = np.argsort(confidence, kind="stable")
    parts = [part for part in np.array_split(order, bins) if len(part)]
    gaps = [len(part) * abs(float(np.mean(confidence[part])) - float(np.mean(right[part]))) for part in parts]
    return float(sum(gaps) / len(order))


def share_interval(hits: int, count: int, level: float = 0.95) -> tuple[float, float]:
    """Return the exact interval of a share (Clopper and Pearson, Biometrika 26, 1934).

    Parameters
    ----------
    hits, count : int
        Number of hits, and total number.
    level : float
        Confidence level [probability].

    Returns
    -------
    tuple of float
        Lower and upper end of the interval [fraction].

    Examples
    --------
    >>> [round(end, 3) for end in share_interval(18, 18)]
    [0.815, 1.0]
    """
    tail = 0.5 * (1.0 - level)
    low = float(stats.beta.ppf(tail, hits, count - hits + 1)) if hits else 0.0
    high = float(stats.beta.ppf(1.0 - tail, hits + 1, count - hits)) if hits < count else 1.0
    return low, high
