"""Linear discriminant analysis with a shrunk covariance: scores of classes, and how far a run is from all of them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular

from estimation.arrays import Array, IntArray


@dataclass(frozen=True, eq=False)
class Discriminant:
    """Learned classes: one normal distribution each, with a common covariance.

    Parameters
    ----------
    mean, scale : ndarray, shape (p,)
        Values that standardise the features [the feature's unit].
    centres : ndarray, shape (classes, p)
        Means of the classes, standardised [dimensionless].
    factor : ndarray, shape (p, p)
        Lower Cholesky factor of the covariance [dimensionless].
    log_priors : ndarray, shape (classes,)
        Logarithm of each class's share; minus infinity for a class without runs [dimensionless].
    """

    mean: Array
    scale: Array
    centres: Array
    factor: Array
    log_priors: Array

    def scores(self, x: Array) -> Array:
        """Return log probabilities of classes, up to a constant for each run.

        Parameters
        ----------
        x : ndarray, shape (n, p)
            Features.

        Returns
        -------
        ndarray, shape (n, classes)
            Scores [dimensionless].
        """
        weights = cho_solve((self.factor, True), self.centres.T)
        shift = self.log_priors - 0.5 * np.einsum("ij,ji->i", self.centres, weights)
        return (x - self.mean) / self.scale @ weights + shift

    def distances(self, x: Array) -> Array:
        """Return the Mahalanobis distance of every run from the nearest class: within the classes' space, and overall.

        The classes' space is spanned by their means: variation common to all classes, such as temperature, cannot hide
        an unknown class there.

        Parameters
        ----------
        x : ndarray, shape (n, p)
            Features.

        Returns
        -------
        ndarray, shape (n, 2)
            Distances [standard deviations].
        """
        known = np.isfinite(self.log_priors)
        white = _whitened(self.factor, ((x - self.mean) / self.scale).T)
        centres = _whitened(self.factor, self.centres[known].T)
        basis, size, _ = np.linalg.svd(centres - centres.mean(axis=1, keepdims=True), full_matrices=False)
        basis = basis[:, size > 1e-9 * size[0]]
        along = _nearest_distance(basis.T @ white, basis.T @ centres)
        return np.column_stack([along, _nearest_distance(white, centres)])


def _nearest_distance(columns: Array, centres: Array) -> Array:
    squares = [np.einsum("ij,ij->j", left, left) for left in (columns - one[:, None] for one in centres.T)]
    return np.sqrt(np.min(squares, axis=0))


def _whitened(factor: Array, columns: Array) -> Array:
    return np.asarray(solve_triangular(factor, columns, lower=True), dtype=np.float64)


def learn(x: Array, places: IntArray, count: int, shares: Sequence[float] = (1.0,)) -> list[Discriminant]:
    """Learn classes from labelled runs.

    The covariance within classes is shrunk by the rule of Ledoit and Wolf (Journal of Multivariate Analysis 88, 2004,
    page 365), or by a share of it, after each feature is scaled to unit deviation within classes.

    Parameters
    ----------
    x : ndarray, shape (n, p)
        Features [any unit].
    places : ndarray of int, shape (n,)
        Class of each run.
    count : int
        Number of classes; one may be without runs.
    shares : sequence of float
        Shares of the rule's shrinkage that are applied [fraction].
    """
    from sklearn.covariance import ledoit_wolf_shrinkage

    mean, scale = x.mean(axis=0), _positive_deviation(x.std(axis=0))
    z = (x - mean) / scale
    runs = np.bincount(places, minlength=count)
    centres = np.stack([z[places == k].mean(axis=0) if runs[k] else np.zeros(z.shape[1]) for k in range(count)])
    within = z - centres[places]
    spread = _positive_deviation(within.std(axis=0))
    within /= spread
    rule = float(ledoit_wolf_shrinkage(within, assume_centered=True))
    covariance = within.T @ within / len(within)
    log_priors = np.full(count, -np.inf)
    log_priors[runs > 0] = np.log(runs[runs > 0] / len(places))
    return [
        Discriminant(mean, scale, centres, spread[:, None] * _factor(covariance, share * rule), log_priors)
        for share in shares
    ]


def _factor(covariance: Array, shrinkage: float) -> Array:
    """Return the lower Cholesky factor of a covariance that is shrunk towards a multiple of the unit matrix."""
    level = float(np.trace(covariance)) / len(covariance)
    shrunk = (1.0 - shrinkage) * covariance
    # ensures an inverse even with fewer runs than features, or with constant features
    shrunk[np.diag_indices_from(shrunk)] += shrinkage * level + 1e-9 * (1.0 + level)
    return np.tril(np.asarray(cho_factor(shrunk, lower=True)[0], dtype=np.float64))


def _positive_deviation(deviation: Array) -> Array:
    """Return deviations, with 1 for features that do not vary."""
    return np.where(deviation > 1e-12 * (1.0 + deviation.max(initial=0.0)), deviation, 1.0)
