"""Gaussian beliefs."""

from dataclasses import dataclass

import numpy as np

from estimation.arrays import Array
from plant.errors import HydrostateError


@dataclass(frozen=True, eq=False)
class Gaussian:
    """A belief about a state: its mean and covariance.

    Parameters
    ----------
    mean : ndarray, shape (n,)
        Mean, in the model's units.
    covariance : ndarray, shape (n, n)
        Covariance, symmetric.

    Raises
    ------
    HydrostateError
        If the shapes do not agree, a value is not finite, or a variance is negative.

    Examples
    --------
    >>> Gaussian(np.zeros(2), np.eye(2)).std.tolist()
    [1.0, 1.0]
    """

    mean: Array
    covariance: Array

    def __post_init__(self) -> None:
        mean = np.array(self.mean, dtype=np.float64)
        covariance = np.array(self.covariance, dtype=np.float64)
        if mean.ndim != 1 or covariance.shape != (len(mean), len(mean)):
            raise HydrostateError(f"a belief needs shapes (n,) and (n, n), got {mean.shape} and {covariance.shape}")
        if not (np.all(np.isfinite(mean)) and np.all(np.isfinite(covariance))):
            raise HydrostateError(f"a belief must be finite, got mean {mean} with covariance {covariance}")
        if np.any(np.diag(covariance) < 0.0):
            raise HydrostateError(f"variances must not be negative, got {np.diag(covariance)}")
        mean.flags.writeable = covariance.flags.writeable = False
        object.__setattr__(self, "mean", mean)
        object.__setattr__(self, "covariance", covariance)

    @property
    def std(self) -> Array:
        """Standard deviations, shape (n,)."""
        return np.sqrt(np.diag(self.covariance))
