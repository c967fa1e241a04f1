"""Scores of a watch: how often it raises a false alarm, how soon it sees a fault, each with its interval."""

from collections.abc import Sequence

import numpy as np
from scipy import stats

from plant.errors import HydrostateError


def alarm_rate(alarms: int, hours: float, confidence: float = 0.95) -> tuple[float, tuple[float, float]]:
    """Return the rate of false alarms with its exact Poisson interval (Garwood, Biometrika 28, 1936, page 437).

    Parameters
    ----------
    alarms : int
        Alarms counted.
    hours : float
        In so much healthy running [h].
    confidence : float
        Of the interval [fraction].

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
        From fault to alarm [s], infinite where there was none.
    confidence : float
        Least confidence of the interval, where there are enough delays for it [fraction].

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
