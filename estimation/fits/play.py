"""`side_of_play(position) -> Array`: at which end of its play an encoder was last pushed by the piston."""

import numpy as np

from estimation.log_checks.measurement_noise import position_variance
from plant.arrays import Array

CELLS = 8.0
"""Width of the cells in which a reading is followed, in standard deviations of its noise [dimensionless]."""

FINEST = 1e-9
"""Their least width [m]."""


def side_of_play(position: Array) -> Array:
    """Return at which end of its play an encoder is: 1 after it moved up, -1 after it moved down.

    Between the last movement one way and the first one back the piston turns, and crosses the play with the square of
    time, as under a constant force. Two steps the same way, from cell to cell, are a movement; one is noise.

    Parameters
    ----------
    position : ndarray, shape (n,)
        The reading, without gaps [m].

    Returns
    -------
    ndarray, shape (n,)
        From -1 to 1; 0 before the first movement [dimensionless].

    Examples
    --------
    >>> out_and_back = 30.0 - np.abs(30.0 - np.arange(61.0))
    >>> side_of_play(out_and_back)[[0, 20, 30, 34, 60]].round(1).tolist()
    [0.0, 1.0, 0.9, -1.0, -1.0]
    """
    cell = max(CELLS * position_variance(position) ** 0.5, FINEST)
    at = np.round(position / cell)
    steps = np.flatnonzero(np.diff(at)) + 1
    ways = np.sign(at[steps] - at[steps - 1])
    sure = np.flatnonzero(ways[1:] == ways[:-1]) + 1
    if not len(sure):
        return np.zeros(len(position))
    places, ways = steps[sure], ways[sure]
    turns = np.flatnonzero(np.diff(ways)) + 1  # the first movement each other way
    known = np.concatenate([[0], places[:1], np.column_stack([places[turns - 1], places[turns]]).ravel()])
    sides = np.concatenate([[0.0], ways[:1], np.column_stack([ways[turns - 1], ways[turns]]).ravel()])
    samples = np.arange(len(position))
    after = np.searchsorted(known, samples, side="right").clip(1, len(known) - 1)
    first, last = known[after - 1], known[after]
    crossed = ((samples - first) / np.maximum(last - first, 1)).clip(0.0, 1.0) ** 2
    return sides[after - 1] + (sides[after] - sides[after - 1]) * crossed
