"""`straightened(speed)`: motor speed whose straight lines deliver the volume that the motor does; `curved(speed)`."""

import numpy as np

from plant.arrays import Array

ALIKE = 0.5
"""Range of three second differences, over the middle one, up to which a bend is steady [fraction]; judged."""


def straightened(speed: Array, *, slow: bool = False) -> Array:
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

    >>> course = straightened(np.arange(8.0) ** 2)
    >>> float(np.trapezoid(course[2:6])), (5.0**3 - 2.0**3) / 3.0
    (39.0, 39.0)
    >>> straightened(np.array([0.0, 0.0, 0.0, 1.0, 2.0, 3.0, 4.0])).tolist()
    [0.0, 0.0, 0.0, 1.0, 2.0, 3.0, 4.0]
    """
    before, here, after = _bends(speed)
    median = np.maximum(np.minimum(before, here), np.minimum(np.maximum(before, here), after))
    return speed - (steady_bend(speed) if slow else median) / 12.0


FINE = 16
"""Parts of a sample time in which a curved course is told."""


EVEN = 0.2
"""Range of three second differences, over the rise of two samples, up to which a course that hardly bends has no corner
[fraction]; judged: it is 0.15 for 61 Hz at 1 kHz, and 0.6 where a motor with 1 to 3 ms of lag sets off."""


def curved(speed: Array) -> Array:
    """Return motor speed between samples as well, on cubics whose slopes at the samples are shared.

    Parts that share their slopes deliver, from rest to rest, what the trapezoidal rule says (Euler and Maclaurin), and
    bend where the motor does. Where bends are alike the slope is that of a polynomial through the five samples about.
    Elsewhere a lagging motor has set off at a corner, and its slope shows in the two samples that follow, not in those
    before; no part overshoots its samples then (Fritsch and Carlson, SIAM Journal on Numerical Analysis 17, 1980).

    Parameters
    ----------
    speed : ndarray, shape (n,)
        Motor speed at the samples [rad/s], none missing.

    Returns
    -------
    ndarray, shape (`FINE` * (n - 1) + 1,)
        Motor speed [rad/s].

    Examples
    --------
    A motor that sets off at a corner:

    >>> curved(np.array([0.0, 0.0, 0.0, 4.0, 6.0]))[:: FINE // 2].tolist()
    [0.0, 0.0, 0.0, 0.0, 0.0, 1.625, 4.0, 5.375, 6.0]
    """
    rise = np.pad(np.diff(speed), 2)
    earlier, before, after, following = rise[:-3], rise[1:-2], rise[2:-1], rise[3:]
    bends = before - earlier, after - before, following - after
    apart = np.maximum(np.maximum(*bends[:2]), bends[2]) - np.minimum(np.minimum(*bends[:2]), bends[2])
    smooth = apart <= ALIKE * np.abs(bends[1]) + EVEN * np.abs(before + after)
    most = np.where(before * after > 0.0, 3.0 * np.minimum(np.abs(before), np.abs(after)), 0.0)
    way = np.sign(after)
    cornered = way * np.clip(way * (1.5 * after - 0.5 * following), 0.0, most)
    slope = np.where(smooth, (7.0 * (before + after) - earlier - following) / 12.0, cornered)
    share = np.arange(FINE) / FINE
    left = (1.0 - share) ** 2
    begins, ends = (1.0 + 2.0 * share) * left, share**2 * (3.0 - 2.0 * share)
    parts = np.outer(speed[:-1], begins) + np.outer(speed[1:], ends)
    parts += np.outer(slope[:-1], share * left) - np.outer(slope[1:], share**2 * (1.0 - share))
    return np.append(parts.ravel(), speed[-1])


def _bends(speed: Array) -> tuple[Array, Array, Array]:
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
    before, here, after = _bends(speed)
    apart = np.maximum(np.maximum(before, here), after) - np.minimum(np.minimum(before, here), after)
    return np.where(apart <= ALIKE * np.abs(here), here, 0.0)
