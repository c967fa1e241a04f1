"""`straight_line_speed(speed)`: motor speed whose straight lines deliver the volume that the motor delivers."""

import numpy as np

from plant.arrays import Array

MOST_UNSTEADY = 0.5
"""Range of three second differences, over the middle one, up to which a bend is steady [fraction]; judged."""


def straight_line_speed(speed: Array, *, slow: bool = False) -> Array:
    """Return motor speed corrected so that straight lines between samples give the right pumped volume.

    A motor that approaches its new speed follows a curve between samples, and the error of the trapezoidal rule is a
    twelfth of the second difference (Euler and Maclaurin). Where a motor starts, at its largest acceleration, the
    course has a corner, without a bend that neighbours share. So the median of three second differences is used: it
    keeps a steady bend and ignores a corner at a sample.

    Parameters
    ----------
    speed : ndarray, shape (n,)
        Motor speed at the samples [rad/s], none missing.
    slow : bool
        Whether the log is slower than its motor: then only a `steady_bend` is known.

    Returns
    -------
    ndarray, shape (n,)
        Motor speed [rad/s].

    Examples
    --------
    A parabola, and a corner:

    >>> course = straight_line_speed(np.arange(8.0) ** 2)
    >>> float(np.trapezoid(course[2:6])), (5.0**3 - 2.0**3) / 3.0
    (39.0, 39.0)
    >>> straight_line_speed(np.array([0.0, 0.0, 0.0, 1.0, 2.0, 3.0, 4.0])).tolist()
    [0.0, 0.0, 0.0, 1.0, 2.0, 3.0, 4.0]
    """
    before, here, after = _neighbouring_bends(speed)
    median = np.maximum(np.minimum(before, here), np.minimum(np.maximum(before, here), after))
    return speed - (steady_bend(speed) if slow else median) / 12.0


def _neighbouring_bends(speed: Array) -> tuple[Array, Array, Array]:
    """Return the second differences at the sample before, at each sample, and at the one after [rad/s]."""
    bends = np.pad(np.diff(speed, n=2), 2) if len(speed) > 2 else np.zeros(len(speed) + 2)
    return bends[:-2], bends[1:-1], bends[2:]


def steady_bend(speed: Array) -> Array:
    """Return the second differences of speed where three neighbours are alike, zero elsewhere.

    In a log slower than its motor no other bend is known: a step is over within two samples.

    Parameters
    ----------
    speed : ndarray, shape (n,)
        Motor speed at the samples [rad/s], none missing.

    Returns
    -------
    ndarray, shape (n,)
        [rad/s]

    Examples
    --------
    >>> steady_bend(np.array([0.0, 1.0, 4.0, 9.0, 16.0, 17.0])).tolist()
    [0.0, 0.0, 2.0, 0.0, 0.0, 0.0]
    """
    before, here, after = _neighbouring_bends(speed)
    apart = np.maximum(np.maximum(before, here), after) - np.minimum(np.minimum(before, here), after)
    return np.where(apart <= MOST_UNSTEADY * np.abs(here), here, 0.0)
