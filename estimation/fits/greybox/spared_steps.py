"""Short model steps only where they matter, during a search; its end uses all of them.

Between samples pressures are nearly straight lines, so that one step is as exact as four. A few samples differ: a valve
opens or closes there. They are found from two runs at one point, so that a search has the same cost function
throughout. See decision 294.
"""

from dataclasses import replace

import numpy as np

from estimation.arrays import IntArray
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.greybox.problem import Problem
from estimation.fits.greybox.side_by_side import LANES
from plant.arrays import Array

FELT_ERRORS = (1e-4, 3e-4, 1e-3, 3e-3)
"""Error of one long step, in standard deviations of the noise, above which a sample has short steps: the first value,
or the next one if too many samples exceed it [dimensionless]. In 20 plain training logs the first moves the optimum by
at most 0.017 deviations of bulk modulus."""

AROUND = 3
"""Samples before and after it that have short steps, too: a search moves the moment at which a valve opens
[samples]."""

MOST_SHORT = 0.3
"""Share of samples with short steps that is too large [fraction]."""

LAST_EVALUATIONS = 4
"""Evaluations with all short steps at the end of a search that had few [count]."""


def steps_where_needed(problem: Problem, theta: Array) -> IntArray:
    """Return model steps up to each sample: one where that is as exact as several, near a point.

    Parameters
    ----------
    theta : ndarray, shape (unknowns,)
        The point [dimensionless].

    Returns
    -------
    ndarray of int, shape (n,)
        Those of the log if nothing can be saved, or if it has gaps [count].
    """
    log = problem.log
    few = np.ones_like(log.steps)
    if log.gaps.size or np.array_equal(few, log.steps):
        return log.steps
    errors = _long_step_errors(problem, theta)
    for felt in FELT_ERRORS:
        short = np.convolve(errors > felt, np.ones(2 * AROUND + 1), "same") > 0.0
        if np.mean(short) <= MOST_SHORT:
            return np.where(short, log.steps, few)
    return log.steps


def with_steps(problem: Problem, steps: IntArray | None) -> Problem:
    """Return a problem with other model steps.

    Parameters
    ----------
    problem : Problem
        The problem.
    steps : ndarray of int, shape (n,), or None
        Up to each sample [count]; None keeps those of the problem.

    Returns
    -------
    Problem
        The problem; the same object if nothing changes.
    """
    log = problem.log.stepped(steps)
    return problem if log is problem.log else problem.on(log)


def with_steps_where_needed(problem: Problem, theta: Array) -> Problem:
    """Return a problem with short model steps where they matter near a point, see `steps_where_needed`.

    Parameters
    ----------
    theta : ndarray, shape (unknowns,)
        The point [dimensionless].

    Returns
    -------
    Problem
        The problem; the same object if nothing can be saved.
    """
    return with_steps(problem, steps_where_needed(problem, theta))


def step_errors(problem: Problem, theta: Array) -> Array:
    """Return the errors of a log's model steps against implicit ones, near a point.

    Parameters
    ----------
    theta : ndarray, shape (unknowns,)
        The point [dimensionless].

    Returns
    -------
    ndarray, shape (outputs, blocks)
        Of each block's residual, in standard deviations of its noise [dimensionless].
    """
    return _residual_difference(problem, theta, problem.log, replace(problem.log, stiff=True))


def _long_step_errors(problem: Problem, theta: Array) -> Array:
    """Return the error of one long step up to each sample, over the noise, shape (n,) [dimensionless].

    The error of a step stays until the oil has leaked off, so errors of steps are differences.
    """
    log = problem.log
    white = tuple(one.scaled(1.0, 0.0) for one in log.noise)
    bare = replace(log, measured=np.zeros(log.measured.shape), block=log.sample_time, noise=white, course=None)
    errors = _residual_difference(problem, theta, bare.coarsened(), bare)
    return np.max(np.abs(np.diff(errors, axis=1, prepend=0.0)), axis=0)


def _residual_difference(problem: Problem, theta: Array, rough: GreyBoxLog, fine: GreyBoxLog) -> Array:
    """Return a log's residuals with some model steps minus those with others, shape (outputs, blocks)."""
    # side by side, as in a search, so that no further kernel is compiled for these two runs
    rows = [rough.parameters] * min(1 + len(theta), LANES)
    there, exact = (problem.on(one).residuals_of(theta, rows)[0] for one in (rough, fine))
    return there - exact
