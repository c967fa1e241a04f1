"""Events of a watch: ready, an alarm with the time of the change, and what has changed."""

from dataclasses import dataclass

import numpy as np

from plant.arrays import Array

SLOW = "loss"
"""What an alarm calls a loss of flow that has grown, beside the balances."""

LIKELY = 1.92
"""Drop of the log-likelihood at the ends of a 95 % interval: half the quantile of chi-square with one degree."""


@dataclass(frozen=True)
class Ready:
    """Enough has been learnt: alarms can come from here on.

    Parameters
    ----------
    time : float
        When [s].
    thresholds : tuple of float
        Of the balances, and of what is lost; a CUSUM has the unit of a score [dimensionless].
    """

    time: float
    thresholds: tuple[float, ...]


@dataclass(frozen=True)
class Alarm:
    """A balance no longer holds, or more is lost than warming oil explains.

    Parameters
    ----------
    time : float
        When it was raised [s].
    balance : str
        ``flow``, ``force``, ``motion`` or ``loss``.
    since : float
        When the change most likely came [s].
    interval : tuple of float
        95 % interval of that [s].
    score, threshold : float
        The CUSUM and what it passed [dimensionless].
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
        When this was told [s].
    lost : tuple of float, or None
        Flow lost before and after, as a share of what the pump delivers, weighed with pressure, so that oil that is
        only squeezed comes back [fraction]; None where pressure is not logged.
    pressure : float or None
        Change of differential pressure at a velocity [fraction]; None where pressure is not logged.
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
        Standardised scores of the blocks, the newest first, the last of them raised.

    Returns
    -------
    tuple
        Blocks since the change, and the least and most of a 95 % interval.

    Examples
    --------
    >>> change_time(np.array([3.9, 4.2, 4.0, 0.2, -0.1, 0.3]))
    (3, (3, 3))
    """
    length = np.arange(1, len(scores) + 1)
    ratio = 0.5 * np.maximum(np.cumsum(scores), 0.0) ** 2 / length
    likely = np.flatnonzero(ratio >= ratio.max() - LIKELY) + 1
    return int(ratio.argmax()) + 1, (int(likely[0]), int(likely[-1]))
