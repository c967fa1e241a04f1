"""`drive_covariance(problem, theta, ...)`: the covariance that noise of the driving channels adds to a fit.

It is measured once and acts on all later outputs, so that it is seen by drawing it.
"""

from functools import lru_cache

import numpy as np

from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.greybox.problem import Problem
from plant.arrays import Array

DRAWS = 16
"""Realisations of the driving channels' noise; their spread is known to 18 %, of a part that is seldom the larger."""

SAMPLES_KEPT = 50_000
"""Longest log whose draws are kept for the next one [samples]: 13 MB."""


def drive_covariance(
    problem: Problem, theta: Array, bread: Array, slopes: Array, undisturbed: Array | None = None
) -> Array | float:
    """Return the covariance that noise of the driving channels adds to that of the fitted coordinates.

    Parameters
    ----------
    problem : Problem
        The problem.
    theta : ndarray, shape (unknowns,)
        Its solution [dimensionless].
    bread : ndarray, shape (felt, felt)
        Inverse of ``J'J``, of the unknowns that are felt [dimensionless].
    slopes : ndarray, shape (outputs * blocks, felt)
        ``J``, the derivatives of the normalised residuals [dimensionless].
    undisturbed : ndarray, shape (outputs, blocks), optional
        The normalised residuals there with one model step a sample; run here if not given [dimensionless].

    Returns
    -------
    ndarray, shape (felt, felt), or float
        The covariance [dimensionless]; zero where no driving channel is noisy.
    """
    log = problem.log
    if not any(spread > 0.0 for spread in log.drive_std):
        return 0.0
    rough, samples, spread = problem.coarse, len(log.drives), np.array(log.drive_std)
    if undisturbed is None:  # by the kernel of the draws: by one of its own it would be compiled for this run alone
        undisturbed = next(iter(rough.disturbed(theta, [log.drives])))
    if samples <= SAMPLES_KEPT:
        moved = rough.disturbed_together(theta, _noisy_drives(log)) - undisturbed[..., None]
        answers = bread @ (slopes.T @ moved.reshape(-1, DRAWS))
        return np.asarray(answers @ answers.T / DRAWS, dtype=np.float64)
    rng = np.random.default_rng(0)
    draws = (log.drives + spread * rng.standard_normal(log.drives.shape) for _ in range(DRAWS))
    each = ((errors - undisturbed).ravel() for errors in rough.disturbed(theta, draws))
    answers = np.column_stack([bread @ (slopes.T @ moved) for moved in each])
    return np.asarray(answers @ answers.T / DRAWS, dtype=np.float64)


@lru_cache(maxsize=1)
def _noisy_drives(log: GreyBoxLog) -> Array:
    """Return a log's driving channels with noise, shape (samples, channels, draws); kept for the other balances."""
    drives = np.array(log.drive_std)[:, None] * _kept_draws(*log.drives.shape)
    drives += log.drives[..., None]
    return drives


@lru_cache(maxsize=1)
def _kept_draws(samples: int, channels: int) -> Array:
    """Return draws of white noise, shape (samples, channels, draws), the same for every log: a fit can be repeated.

    They are kept for the other forms of the balance and for the next log of that length.
    """
    draws = np.random.default_rng(0).standard_normal((DRAWS, samples, channels))
    return np.ascontiguousarray(np.moveaxis(draws, 0, -1))
