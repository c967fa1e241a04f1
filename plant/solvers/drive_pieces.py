"""Parabolas through a drive's samples, each of which one step may follow: pasted into a kernel with the loop."""

import numpy as np

from plant.arrays import Array

ROUNDEST = 100.0
"""A drive has a corner if its second difference exceeds this multiple of the amount that a step may smooth."""


def parabolic_piece(
    drive: Array, parameters: Array, begin: int, bend: float, bulge: float
) -> tuple[int, float, float, float]:
    """Return the last sample up to which the drive follows one parabola, and that parabola.

    Parameters
    ----------
    drive : ndarray, shape (n,)
        Drive at the samples [its SI unit].
    parameters : ndarray, shape (1 or n, lanes, parameters)
        Parameter rows; a piece ends at each change.
    bend : float
        Amount by which the drive may deviate from the parabola [the drive's unit].
    bulge : float
        Excess of straight lines between samples over the drive's mean over a sample time, divided by its second
        difference [dimensionless]: 0 if the drive is those lines. Otherwise a piece has a curve's mean, and does not
        end at corners.

    Returns
    -------
    tuple of (int, float, float, float)
        Last sample of the piece; start of the parabola, its mean rise per sample, its curvature [the drive's unit].
    """
    n = drive.shape[0]
    end = begin + 1
    low, high = np.inf, -np.inf
    if bulge > 0.0 and begin > 0:
        low = high = drive[end] - 2.0 * drive[begin] + drive[begin - 1]
    total = 0.5 * (drive[begin] + drive[end])
    while end < n - 1 and (parameters.shape[0] == 1 or are_equal(parameters[end], parameters[begin])):
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
    """Return the slope of a drive at one of its samples, from the neighbouring samples.

    Parameters
    ----------
    drive : ndarray, shape (n,)
        Drive at the samples [its SI unit].
    sample : int
        Index of the sample.

    Returns
    -------
    float
        Slope [the drive's unit per sample].
    """
    before, after = max(sample - 1, 0), min(sample + 1, drive.shape[0] - 1)
    return (drive[after] - drive[before]) / (after - before)


def are_equal(one: Array, other: Array) -> bool:
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
