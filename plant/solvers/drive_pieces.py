"""Parabolas through a drive's samples, which one step may follow: pasted into a kernel with the loop."""

import numpy as np

from plant.arrays import Array

ROUNDEST = 100.0
"""A drive that bends by more than this many times what a step may smooth has a corner there."""


def smooth(drive: Array, parameters: Array, begin: int, bend: float, bulge: float) -> tuple[int, float, float, float]:
    """Return the last sample up to which the drive follows one parabola, and that parabola.

    Parameters
    ----------
    drive : ndarray, shape (n,)
        Drive at the samples [its SI unit].
    parameters : ndarray, shape (1 or n, lanes, parameters)
        Parameter rows; where they change, a piece ends.
    bend : float
        By how much it may leave the parabola [the drive's unit].
    bulge : float
        By how much straight lines between samples exceed the drive's mean over a sample time, over its second
        difference [dimensionless]: 0 where it is those lines. Else a piece has a curve's mean, and ends off corners.

    Returns
    -------
    tuple of (int, float, float, float)
        Last sample of the piece; where the parabola begins, its mean rise a sample, its curvature [the drive's unit].
    """
    n = drive.shape[0]
    end = begin + 1
    low, high = np.inf, -np.inf
    if bulge > 0.0 and begin > 0:
        low = high = drive[end] - 2.0 * drive[begin] + drive[begin - 1]
    total = 0.5 * (drive[begin] + drive[end])
    while end < n - 1 and (parameters.shape[0] == 1 or same(parameters[end], parameters[begin])):
        curvature = drive[end + 1] - 2.0 * drive[end] + drive[end - 1]
        lower, upper = min(low, curvature), max(high, curvature)
        length = end + 1 - begin
        if (upper - lower) * length * length > 16.0 * bend or max(-lower, upper) > ROUNDEST * bend:
            if bulge > 0.0 and length > 2:
                end -= 1
                total -= 0.5 * (drive[end] + drive[end + 1])
            break
        low, high = lower, upper
        total += 0.5 * (drive[end] + drive[end + 1])
        end += 1
    length = end - begin
    ramp = (drive[end] - drive[begin]) / length
    curvature = 0.5 * (low + high) if length > 1 else 0.0
    if bulge == 0.0:
        return end, drive[begin] + curvature / 12.0, ramp, curvature
    turned = slope_at(drive, end) - slope_at(drive, begin)
    if length == 1:
        curvature = turned
    mean = (total - bulge * turned) / length
    return end, mean - 0.5 * ramp * length + curvature * length * length / 12.0, ramp, curvature


def slope_at(drive: Array, sample: int) -> float:
    """Return the slope of a drive at one of its samples, from those beside it.

    Parameters
    ----------
    drive : ndarray, shape (n,)
        Drive at the samples [its SI unit].
    sample : int
        Which.

    Returns
    -------
    float
        Slope [the drive's unit a sample].
    """
    before, after = max(sample - 1, 0), min(sample + 1, drive.shape[0] - 1)
    return (drive[after] - drive[before]) / (after - before)


def same(one: Array, other: Array) -> bool:
    """Return whether two matrices are equal.

    Parameters
    ----------
    one, other : ndarray, shape (n, m)
        The matrices [any unit].
    """
    for i in range(one.shape[0]):
        for j in range(one.shape[1]):
            if one[i, j] != other[i, j]:
                return False
    return True
