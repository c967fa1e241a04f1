"""Events of a watch: ready, an alarm with the time of the change, and what has changed."""

from dataclasses import dataclass

import numpy as np

from plant.arrays import Array

LOSS_BALANCE = "loss"
"""Name in an alarm for a loss of flow that has grown slowly; the other names are those of balances."""

INTERVAL_DROP = 1.92
"""Drop of the log-likelihood at the ends of a 95 % interval: half the quantile of chi-square with one degree."""


@dataclass(frozen=True)
class Ready:
    """Enough has been learnt: alarms can be raised from here on.

    Parameters
    ----------
    time : float
        When learning was complete [s].
    thresholds : tuple of float
        Thresholds of the balances and of the loss; a CUSUM has the unit of a score [dimensionless].
    """

    time: float
    thresholds: tuple[float, ...]


@dataclass(frozen=True)
class Alarm:
    """A balance no longer holds, or the loss exceeds what warming oil explains.

    Parameters
    ----------
    time : float
        When it was raised [s].
    balance : str
        ``flow``, ``force``, ``motion`` or ``loss``.
    since : float
        Most likely time of the change [s].
    interval : tuple of float
        95 % interval of that time [s].
    score, threshold : float
        The CUSUM and the threshold that it passed [dimensionless].
    """

    time: float
    balance: str
    since: float
    interval: tuple[float, float]
    score: float
    threshold: float


@dataclass(frozen=True)
class Change:
    """Change behind an alarm, judged by samples after it.

    Parameters
    ----------
    time : float
        When the change was determined [s].
    lost : tuple of float, or None
        Flow lost before and after, as a share of the pump's delivery, weighted with pressure so that oil that is only
        compressed is returned [fraction]; None if pressure is not logged.
    pressure : float or None
        Change of differential pressure at the same velocity [fraction]; None if pressure is not logged.
    """

    time: float
    alarm: Alarm
    lost: tuple[float, float] | None
    pressure: float | None


Event = Ready | Alarm | Change


def change_time(scores: Array) -> tuple[int, tuple[int, int]]:
    """Return the number of blocks since the scores' mean rose, by the generalised likelihood ratio.

    Scores before the change have mean 0 and deviation 1; after it the mean is unknown (Willsky and Jones, IEEE
    Transactions on Automatic Control 21, 1976, page 108).

    Parameters
    ----------
    scores : ndarray, shape (n,)
        Standardised scores of the blocks, newest first; the newest are raised.

    Returns
    -------
    tuple
        Number of blocks since the change, and the ends of its 95 % interval.

    Examples
    --------
    >>> change_time(np.array([3.9, 4.2, 4.0, 0.2, -0.1, 0.3]))
    (3, (3, 3))
    """
    length = np.arange(1, len(scores) + 1)
    ratio = 0.5 * np.maximum(np.cumsum(scores), 0.0) ** 2 / length
    likely = np.flatnonzero(ratio >= ratio.max() - INTERVAL_DROP) + 1
    return int(ratio.argmax()) + 1, (int(likely[0]), int(likely[-1]))
