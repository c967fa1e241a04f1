"""Possible courses of the piston within the play of its encoder.

While the encoder moves, it shows at which end of its play it is. While it is at rest, the piston may be anywhere in
between: it reverses and crosses, or springs back on its seals and returns. So there are a few courses, and the log
selects one (`crossings`).
"""

from typing import NamedTuple

import numpy as np

from estimation.arrays import Array, BoolArray, IntArray
from estimation.log_checks.bridging import bridged
from estimation.log_checks.measurement_noise import position_variance

CELLS = 8.0
"""Width of the cells in which a reading is followed, in standard deviations of its noise [dimensionless]."""

FINEST = 1e-9
"""Their least width [m]."""

SMOOTHING_TIME = 2e-2
"""Length over which pressure is averaged, by a Hann window [s]; judged. The fastest crossings take as long, and
pressure noise moves no piston then."""

SPRING_BACK_TIME = 0.02
"""Time at rest from which the piston is assumed to spring back [s]; judged: an encoder may creep in steps."""


def crossings(position: Array, pressure: Array, sample_time: float) -> Array:
    """Return courses of the piston in its encoder's play.

    Between the last movement one way and the first one back the piston reverses, and crosses the play with the square
    of time, as under a constant force. Two steps the same way, from cell to cell, are a movement; one is noise.

    Parameters
    ----------
    position : ndarray, shape (n,)
        The reading, without gaps [m].
    pressure : ndarray, shape (n,)
        Differential pressure [Pa]; NaN is missing.
    sample_time : float
        Seconds between samples [s].

    Returns
    -------
    ndarray, shape (n, 4)
        In the order of `estimation.models.wide_flow.COURSES`. First the end of the play at which the encoder is: 1
        after it moved up, -1 after it moved down, 0 before anything is known, and from one to the other at the end of a
        rest. Then what to add if the piston follows pressure in place of time, held by the stretch of its seals; if it
        crosses at the beginning of a rest; and if it springs back and returns, by the share of the pressure that is
        lost in between [dimensionless].

    Examples
    --------
    >>> out_and_back = 30.0 - np.abs(30.0 - np.arange(61.0))
    >>> late = crossings(out_and_back, np.zeros(61), 1e-3)[:, 0]
    >>> late[[0, 20, 30, 34, 60]].round(1).tolist()
    [0.0, 1.0, 0.9, -1.0, -1.0]
    """
    stands = standings(position)
    across, share = stands.next_side - stands.side, stands.share
    late, early = stands.side + across * share**2, stands.side + across * (share * (2 - share))
    force = smoothed(bridged(pressure), round(SMOOTHING_TIME / sample_time))
    before, after = force[stands.first], force[stands.last]
    turned = np.divide(force - before, after - before, out=np.ones_like(force), where=after != before)
    followed = turned.clip(0.0, 1.0)
    by_pressure = stands.side + (stands.next_side - stands.side) * followed
    held = before + (after - before) * stands.share
    most = np.abs(held)
    below = np.maximum(stands.side * (force - held), -2.0 * most).clip(max=0.0)
    lost = np.divide(below, most, out=below, where=below < 0.0)
    sprung = np.where(stands.turns | (stands.length * sample_time < SPRING_BACK_TIME), 0.0, stands.side * lost)
    return np.column_stack([late, by_pressure - late, early - late, sprung])


class Standings(NamedTuple):
    """For each sample: the movements before and after, the sides on which they left the play, and its place between.

    Parameters
    ----------
    first, last : ndarray of int, shape (n,)
        Samples of the movement before and after.
    side, next_side : ndarray, shape (n,)
        End of the play at which the encoder is from each movement on: 1 after it moved up, -1 after it moved down, 0
        before anything is known.
    """

    first: IntArray
    last: IntArray
    side: Array
    next_side: Array

    @property
    def turns(self) -> BoolArray:
        """Whether the piston reverses in between."""
        return self.side != self.next_side

    @property
    def length(self) -> IntArray:
        """Time for which the encoder is at rest [samples]."""
        return self.last - self.first

    @property
    def away(self) -> IntArray:
        """Distance to the nearer movement [samples]."""
        samples = np.arange(len(self.first))
        return np.minimum(samples - self.first, self.last - samples)

    @property
    def share(self) -> Array:
        """Elapsed share of the time between the movements [fraction]."""
        samples = np.arange(len(self.first))
        return (samples - self.first) / np.maximum(self.length, 1)


def standings(position: Array) -> Standings:
    """Return the movements between which an encoder is at rest.

    Parameters
    ----------
    position : ndarray, shape (n,)
        The reading, without gaps [m].

    Returns
    -------
    Standings
        For each sample.
    """
    at = np.round(position / cell_width(position))
    steps = np.flatnonzero(np.diff(at)) + 1
    ways = np.sign(at[steps] - at[steps - 1])
    sure = np.flatnonzero(ways[1:] == ways[:-1]) + 1
    # the rest after the last movement ends with the log, on the side where it began
    places = np.concatenate([[0], steps[sure], [len(position) - 1]])
    sides = np.concatenate([[0.0], ways[sure], ways[sure][-1:] if len(sure) else [0.0]])
    before = np.searchsorted(places[:-1], np.arange(len(position)), side="right") - 1
    return Standings(places[before], places[before + 1], sides[before], sides[before + 1])


def cell_width(position: Array) -> float:
    """Return the width of the cells in which a reading is followed.

    Parameters
    ----------
    position : ndarray, shape (n,)
        The reading, without gaps [m].

    Returns
    -------
    float
        Width [m].
    """
    return max(CELLS * position_variance(position) ** 0.5, FINEST)


def smoothed(values: Array, samples: int) -> Array:
    """Return means of a signal under a Hann window.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Any signal without gaps.
    samples : int
        Length of the window.

    Returns
    -------
    ndarray, shape (n,)
        Means in the same unit; the ends are extended by their last values.
    """
    if samples < 2:
        return values
    window = np.hanning(samples + 2 + samples % 2 - 1)[1:-1]
    reach = len(window) // 2
    padded = np.pad(values, (reach, len(window) - 1 - reach), mode="edge")
    return np.convolve(padded, window / np.sum(window), mode="valid")
