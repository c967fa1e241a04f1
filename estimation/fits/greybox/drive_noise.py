"""`drive_covariance(problem, theta, ...)`: the covariance that noise of the driving channels adds to a fit.

One noise sample affects all later outputs, so the effect is simulated with random draws.
"""

from functools import lru_cache

import numpy as np

from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.greybox.problem import Problem
from plant.arrays import Array

DRAWS = 16
"""Realisations of the drive noise. The standard deviation is then known to 18 %; it is seldom the larger part."""

SAMPLES_KEPT = 50_000
"""Longest log whose draws are kept for the next log [samples]: 13 MB."""


def drive_covariance(
    problem: Problem,
    theta: Array,
    bread: Array,
    slopes: Array,
    undisturbed: Array | None = None,
    moved: Array | None = None,
) -> Array | float:
    """Return the covariance that noise of the driving channels adds to that of the fitted coordinates.

    Parameters
    ----------
    problem : Problem
        The problem.
    theta : ndarray, shape (unknowns,)
        Its solution [dimensionless].
    bread : ndarray, shape (felt, felt)
        Inverse of ``J'J``, for the unknowns that have an effect [dimensionless].
    slopes : ndarray, shape (outputs * blocks, felt)
        ``J``, the derivatives of the normalised residuals [dimensionless].
    undisturbed : ndarray, shape (outputs, blocks), optional
        The normalised residuals there with one model step per sample; computed if not given [dimensionless].
    moved : ndarray, shape (outputs * blocks, draws), optional
        Effect of drive noise on the residuals, see `effect_of_drive_noise`; computed if not given [dimensionless].

    Returns
    -------
    ndarray, shape (felt, felt), or float
        The covariance [dimensionless]; zero if no driving channel has noise.
    """
    if not any(spread > 0.0 for spread in problem.log.drive_std):
        return 0.0
    moved = effect_of_drive_noise(problem, theta, undisturbed) if moved is None else moved
    answers = bread @ (slopes.T @ moved)
    return np.asarray(answers @ answers.T / DRAWS, dtype=np.float64)


def effect_of_drive_noise(problem: Problem, theta: Array, undisturbed: Array | None = None) -> Array:
    """Return the effect of random draws of drive noise on the residuals of a log.

    All balances of a log integrate the pumped flow, so the draws of one serve for the others.

    Parameters
    ----------
    problem : Problem
        The problem.
    theta : ndarray, shape (unknowns,)
        Its solution [dimensionless].
    undisturbed : ndarray, shape (outputs, blocks), optional
        See `drive_covariance` [dimensionless].

    Returns
    -------
    ndarray, shape (outputs * blocks, draws)
        Changes of the normalised residuals [dimensionless].
    """
    log, rough = problem.log, problem.coarse
    if undisturbed is None:
        # uses the kernel of the draws, so that no other is compiled
        (undisturbed,) = rough.disturbed(theta, [log.drives])
    if len(log.drives) <= SAMPLES_KEPT:
        moved = rough.disturbed_together(theta, _noisy_drives(log)) - undisturbed[..., None]
        return moved.reshape(-1, DRAWS)
    rng, spread = np.random.default_rng(0), np.array(log.drive_std)
    draws = (log.drives + spread * rng.standard_normal(log.drives.shape) for _ in range(DRAWS))
    return np.column_stack([(errors - undisturbed).ravel() for errors in rough.disturbed(theta, draws)])


@lru_cache(maxsize=1)
def _noisy_drives(log: GreyBoxLog) -> Array:
    """Return a log's driving channels with noise, shape (samples, channels, draws); kept for the other balances."""
    drives = np.array(log.drive_std)[:, None] * _kept_draws(*log.drives.shape)
    drives += log.drives[..., None]
    return drives


@lru_cache(maxsize=1)
def _kept_draws(samples: int, channels: int) -> Array:
    """Return draws of white noise, shape (samples, channels, draws), equal for every log so that fits are repeatable.

    They are kept for the other forms of the balance and for the next log of that length.
    """
    draws = np.random.default_rng(0).standard_normal((DRAWS, samples, channels))
    return np.ascontiguousarray(np.moveaxis(draws, 0, -1))
