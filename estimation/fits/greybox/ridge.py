"""`Ridge`: two parameters of a fit that nearly cancel, and how to take a finite difference by one of them."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from plant.arrays import Array

STEEPEST = 1e3
"""Largest ratio of the steps of the two logarithms along a ridge [dimensionless]: beyond it, one parameter has
vanished."""


class Ridge(NamedTuple):
    """Two parameters, both fitted as logarithms, that nearly cancel when they rise together.

    A finite difference by one of them alone includes half its curvature, which does not cancel with the slope by the
    other. Where make-up valves open and close, that was larger than the net effect of both, and they seemed known a
    hundred times too well. So the step is taken along the ridge, and the slope by the other is subtracted.

    Parameters
    ----------
    nudged, along : str
        The parameters; the slope by the first is taken along the ridge.
    ratio : float
        Rise of the second with that of the first along the ridge [unit of the second over that of the first].
    """

    nudged: str
    along: str
    ratio: float

    def placed(self, free: Sequence[str]) -> "PlacedRidge | None":
        """Return the ridge among the unknowns of a fit, None if one of the two is not free."""
        if self.nudged not in free or self.along not in free:
            return None
        return PlacedRidge(free.index(self.nudged), free.index(self.along), self.ratio)


class PlacedRidge(NamedTuple):
    """A ridge among the unknowns of a fit.

    Parameters
    ----------
    nudged, along : int
        Their indices.
    ratio : float
        See `Ridge` [unit of the second over that of the first].
    """

    nudged: int
    along: int
    ratio: float

    def steepness(self, theta: Array) -> float:
        """Return the step of the second logarithm along the ridge over that of the first [dimensionless].

        Parameters
        ----------
        theta : ndarray, shape (unknowns,)
            Fitted coordinates [dimensionless].

        Returns
        -------
        float
            Ratio of the two steps, `STEEPEST` at most [dimensionless].
        """
        return min(self.ratio * float(np.exp(theta[self.nudged] - theta[self.along])), STEEPEST)

    def turn(self, points: Array, theta: Array, nudge: float) -> None:
        """Move the neighbour of a point that is shifted in the first parameter onto the ridge, in place.

        Parameters
        ----------
        points : ndarray, shape (1 + unknowns, unknowns)
            The point and its neighbours [dimensionless].
        theta : ndarray, shape (unknowns,)
            The point [dimensionless].
        nudge : float
            How far each neighbour is nudged [dimensionless].
        """
        points[1 + self.nudged, self.along] += np.log1p(nudge * self.steepness(theta))

    def turn_back(self, slopes: Array, theta: Array) -> None:
        """Convert the slope along the ridge into that by the first parameter alone, in place.

        Parameters
        ----------
        slopes : ndarray, shape (..., unknowns)
            Slopes, the first parameter's along the ridge [dimensionless].
        theta : ndarray, shape (unknowns,)
            Where they were taken [dimensionless].
        """
        slopes[..., self.nudged] -= self.steepness(theta) * slopes[..., self.along]
