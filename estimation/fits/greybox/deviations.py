"""Covariance of a solution, from the slopes of the unknowns that have an effect."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.fits.greybox.covariance import automatic_lags, least_squares_covariance
from estimation.fits.greybox.descent import Point
from estimation.fits.greybox.drive_noise import drive_covariance
from estimation.fits.greybox.intersample_doubt import covariance_of_turns, slopes_of_vanished
from estimation.fits.greybox.problem import Problem
from estimation.fits.greybox.sign_constraints import sign_constrained_covariance
from plant.arrays import Array

NOISE_DOUBT = 0.2
"""Relative standard deviation of a driving channel's noise variance that is counted with the slopes [fraction]: the
variance is known to some percent, and the noise is white in theory only."""


@dataclass(frozen=True, eq=False)
class Information:
    """Information of the slopes at a solution, for the unknowns that have an effect.

    In the last three arrays these are followed by the turns of a slow log's motor that the fit has reduced to zero.

    Parameters
    ----------
    felt : ndarray of int, shape (felt,)
        Indices of the unknowns that have an effect.
    errors : ndarray, shape (outputs, blocks)
        Normalised residuals [dimensionless].
    fitted_slopes : ndarray, shape (outputs * blocks, felt)
        Derivatives of the residuals by these unknowns [dimensionless].
    fitted_bread : ndarray, shape (felt, felt)
        Inverse of their normal equations [dimensionless].
    slopes : ndarray, shape (outputs * blocks, felt or more)
        Derivatives, followed by those of the turns [dimensionless].
    bread, spread : ndarray, shape (felt or more, felt or more)
        Inverse of the normal equations with the turns, and the covariance by the residuals [dimensionless].
    """

    felt: NDArray[np.intp]
    errors: Array
    fitted_slopes: Array
    fitted_bread: Array
    slopes: Array
    bread: Array
    spread: Array

    @property
    def left_over(self) -> Array:
        """All residuals in a row, shape (outputs * blocks,) [dimensionless]."""
        return self.errors.ravel()

    def response(self, shift: Array) -> Array:
        """Return the shift of the unknowns under a change of the residuals, to first order.

        Parameters
        ----------
        shift : ndarray, shape (outputs, blocks)
            Change of the normalised residuals [dimensionless].

        Returns
        -------
        ndarray, shape (felt or more,)
            [dimensionless]
        """
        return self.bread @ (self.slopes.T @ shift.ravel())


def prior_precision(problem: Problem) -> Array:
    """Return one over the prior variance of each coordinate that counts in deviations.

    Returns
    -------
    ndarray, shape (unknowns,)
        Inverse prior variance of each unknown, including how far it may be from where a search ends; zero if nothing is
        known [dimensionless].
    """
    within = [problem.log.within.get(name, np.inf) ** -2.0 for name in problem.model.unknowns]
    return np.asarray(problem.prior + np.array(within), dtype=np.float64)


def information(
    problem: Problem, theta: Array, errors: Array, slopes: Array, felt: NDArray[np.intp], *, warned: bool
) -> Information:
    """Return the information of the slopes at a solution, for the unknowns that have an effect.

    Parameters
    ----------
    problem : Problem
        The problem.
    theta : ndarray, shape (unknowns,)
        Its solution [dimensionless].
    errors : ndarray, shape (outputs, blocks)
        Normalised residuals there [dimensionless].
    slopes : ndarray, shape (outputs * blocks, unknowns)
        Their derivatives [dimensionless].
    felt : ndarray of int, shape (felt,)
        Indices of the unknowns that have an effect.
    warned : bool
        Whether to warn if unknowns are not separately determined.
    """
    fitted = slopes if len(felt) == len(theta) else slopes[:, felt]
    left_over, prior, used = errors.ravel(), prior_precision(problem)[felt], int(np.count_nonzero(errors))
    lags = automatic_lags(left_over)
    fitted_bread, spread = least_squares_covariance(fitted, left_over, used, lags, prior, warned=warned)
    beside, bread = fitted, fitted_bread
    if problem.log.course is not None and (gone := slopes_of_vanished(problem, theta, errors, felt)):
        beside, prior = np.column_stack([fitted, *gone]), np.append(prior, np.zeros(len(gone)))
        bread, spread = least_squares_covariance(beside, left_over, used, lags, prior, warned=warned)
    return Information(felt, errors, fitted, fitted_bread, beside, bread, spread)


def covariance_of(
    problem: Problem,
    point: Point,
    told: Information,
    *,
    least: Array | None,
    disturbed: bool,
    undisturbed: Array | None,
    moved: Array | None = None,
) -> Array:
    """Return the covariance of the unknowns that have an effect: by noise of the outputs, optionally of the drives.

    Parameters
    ----------
    problem : Problem
        The problem.
    point : Point
        Its solution.
    told : Information
        Information of the slopes there.
    least : ndarray, shape (unknowns,), or None
        Lowest coordinates of its search, see `estimation.fits.greybox.sign_constraints` [dimensionless].
    disturbed : bool
        Whether drive noise counts.
    undisturbed : ndarray, shape (outputs, blocks), or None
        Normalised residuals with one model step per sample, if known [dimensionless].
    moved : ndarray, shape (outputs * blocks, draws), optional
        Effect of drive noise on the residuals, see `drive_covariance` [dimensionless].

    Returns
    -------
    ndarray, shape (felt, felt)
        The covariance [dimensionless]; infinite on the diagonal for undetermined unknowns.
    """
    theta, felt, slopes, bread, spread = point.theta, told.felt, told.slopes, told.bread, told.spread
    tilt = bread[:, : len(felt)] @ problem.untilted(theta, told.errors)[felt]
    kept = (
        spread if least is None else sign_constrained_covariance(problem, point, least, felt, told.fitted_bread, spread)
    )
    covariance = kept + NOISE_DOUBT**2 * np.outer(tilt, tilt)
    if disturbed:
        covariance = covariance + drive_covariance(problem, theta, bread, slopes, undisturbed, moved)
    if problem.log.course is not None and disturbed:  # with few turns the windowed estimate is poor
        covariance = covariance + np.diag(np.maximum(np.diag(bread - spread), 0.0))
        covariance = covariance + covariance_of_turns(problem, theta, told.errors, bread, slopes)
    # the windowed estimate need not be positive; if it is not, the unknown is undetermined
    covariance[~(np.diag(spread) > 0.0), ~(np.diag(spread) > 0.0)] = np.inf
    return covariance[: len(felt), : len(felt)]
