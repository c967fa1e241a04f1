"""The relinearised extended Kalman filter: it filters the log again from its last result.

One pass linearises the first samples about a guess that may be far off, treats them as if the linearisation had been
right, and ends overconfident in a wrong value. The next pass begins at the last pass's constants, with several times
their deviations and the same correlations, so that every linearisation is near its result. It is the Gauss-Newton
iteration of a maximum-likelihood fit with the filter as its model (Bell and Cathey 1993, *The iterated Kalman filter
update as a Gauss-Newton method*, for one update).
"""

from dataclasses import replace

import numpy as np

from estimation.arrays import Array
from estimation.engine.contract import FilterProblem, Trace
from estimation.filters.ekf import ekf

INFLATION = 3.0
"""Factor on the final deviations of a pass's constants with which the next one begins [fraction]. The prior thus counts
the log a ninth too often, for which the returned covariance is corrected."""

MOST_PASSES = 10
"""Largest number of passes over the same samples."""

LEAST_LIKELIHOOD_GAIN = 0.3
"""Gain in log-likelihood below which no further pass is made [dimensionless]."""


def relinearised(problem: FilterProblem, mean: Array, covariance: Array, most: int = MOST_PASSES) -> Trace:
    """Filter a log repeatedly until linearising it again changes nothing.

    Parameters
    ----------
    problem : FilterProblem
        The task, with its prior.
    mean, covariance : ndarray, shapes (n,) and (n, n)
        Final belief of an earlier pass, scaled; only its constants are used, which are states without process noise.
    most : int
        Largest number of passes.

    Returns
    -------
    Trace
        The most likely pass, its covariance of the constants no smaller than the log allows; NaN if all diverged.
    """
    best = ekf(_task_with_prior(problem, mean, covariance))
    found = best
    for _ in range(most - 1):
        if not np.isfinite(found.log_likelihood):
            break
        found = ekf(_task_with_prior(problem, found.mean, found.covariance))
        gain = found.log_likelihood - best.log_likelihood
        if gain > 0.0:
            best = found
        if abs(gain) < LEAST_LIKELIHOOD_GAIN:
            break
    wider = np.where(problem.noise == 0.0, np.sqrt(1.0 + INFLATION**-2), 1.0)
    return best._replace(covariance=np.outer(wider, wider) * best.covariance)


def _task_with_prior(problem: FilterProblem, mean: Array, covariance: Array) -> FilterProblem:
    """Return the task with a prior about the constants of an earlier pass, no wider than the first one."""
    constant = problem.noise == 0.0
    block = np.ix_(constant, constant)
    prior = problem.covariance.copy()
    known = np.linalg.inv(prior[block]) + np.linalg.inv(INFLATION**2 * covariance[block])
    spread = np.linalg.inv(known)
    prior[block] = 0.5 * (spread + spread.T)
    return replace(problem, mean=np.where(constant, mean, problem.mean), covariance=prior)
