"""`driven_samples(...)`: length of the beginning of a log that suffices to compare starts of a search."""

import numpy as np

from plant.arrays import Array

LEAST_DRIVEN = 0.5
"""Least energy of the drive in the beginning, over that of an average part of the log [fraction]; judged. At rest all
starts have equal residuals: logs that begin with 8 s of rest led to oil without stiffness, and a search of 20 s."""


def driven_samples(drive: Array, samples: int) -> int:
    """Return the length of the shortest beginning that is driven at least half as much as an average part of the log.

    Parameters
    ----------
    drive : ndarray, shape (n,)
        A drive of the model, such as motor speed; missing samples do not count [SI].
    samples : int
        Least length of the beginning [samples].

    Returns
    -------
    int
        Its length; ``samples`` if that is enough, or the log is no longer.

    Examples
    --------
    >>> driven_samples(np.repeat([0.0, 1.0], 50), 20)
    55
    """
    energy = np.cumsum(np.nan_to_num(drive) ** 2)
    wanted = LEAST_DRIVEN * samples * energy[-1] / len(energy)
    return max(samples, int(np.searchsorted(energy, wanted)) + 1)
