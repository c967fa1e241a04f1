"""Slopes by finite differences: residuals at a point and at its neighbours run side by side."""

from functools import cache

import numpy as np

from estimation.fits.greybox.normal_loops import fill_differences
from plant.arrays import Array


@cache
def neighbours(unknowns: int) -> Array:
    """Return the directions from a point to itself and to its neighbours, a row each.

    Parameters
    ----------
    unknowns : int
        How many coordinates it has.

    Returns
    -------
    ndarray, shape (1 + unknowns, unknowns)
        Zeros, then a unit along each coordinate [dimensionless].
    """
    return np.eye(unknowns + 1, unknowns, -1)


def differences(found: Array, unknowns: int, nudge: float) -> tuple[Array, Array]:
    """Return the residuals at a point and their slopes.

    Parameters
    ----------
    found : ndarray, shape (outputs, blocks, lanes)
        Residuals at the point, and at its neighbours one after another [dimensionless].
    unknowns : int
        How many neighbours count.
    nudge : float
        How far away they are [dimensionless].

    Returns
    -------
    tuple of ndarray, shapes (outputs, blocks) and (outputs, blocks, unknowns)
        Both [dimensionless].
    """
    here, slopes = np.empty(found.shape[:2]), np.empty((*found.shape[:2], unknowns))
    fill_differences(found, nudge, here, slopes)
    return here, slopes
