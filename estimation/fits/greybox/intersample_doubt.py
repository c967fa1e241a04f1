"""Unknown motor speed between the samples of a slow log (intersample behaviour), as noise of the pressure.

A slow log has the motor speed at its samples, but not between them. If speed changes suddenly, the volume pumped by
straight lines is wrong in two ways. A command at an unknown time leaves a volume error that leaks off: pressure makes a
random step and returns as slowly as leakage lets it. And a motor that approaches its new speed over a sample or two has
the same error each time, which cancels by itself: the samples next to a turn are off, those after it are not.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.arrays import Array, IntArray
from estimation.fits.greybox.intersample_speed import steady_bend
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.greybox.problem import Problem
from plant.solvers.steps import parameter_names

SLOW = 1.5e-3
"""Sample time from which the motor's course between samples matters [s]; judged: up to 1 ms its lead absorbs it."""

OWN_NOISE = 4.0
"""Deviations of the speed noise beyond which a second difference is a turn of the motor [dimensionless]."""

MAY_VANISH = ("leakage_coefficient", "flow_bias")
"""Unknowns that the fit of a slow log may reduce to zero, so far from the truth that bulk modulus follows."""

NUDGE = 1e-2
"""Finite-difference step: for those unknowns as a share of the rig's value, for motor speed as a share of the change
[fraction]."""


IN_VOLUME = 0.5 * np.array([[1.0, 0.0, 1.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
"""Oil that the three of `speed_rises` pump in a sample, per rise in the sample before, after, and two before; the
motor\'s lead absorbs what is proportional to the sample's own rise."""

USUAL_DEVIATION = 0.1
"""Prior standard deviation of each, over a sample time [fraction]: 0.02 to 0.15 for motors of 2 to 6 ms at 100 to 500
Hz."""


@dataclass(frozen=True, eq=False)
class IntersampleDoubt:
    """Uncertainty of motor speed between samples.

    Parameters
    ----------
    turns : ndarray, shape (n,)
        Rise of pressure up to a sample, if the largest change of speed beside it were added to the pumped volume [Pa].
    staying, passing : float
        Standard deviation of the lasting part and of the returning part, over that [fraction].
    kept : float
        What leakage leaves of the lasting part by the next sample [fraction].
    """

    turns: Array
    staying: float = 1.0
    passing: float = 1.0
    kept: float = 1.0

    def turn_count(self, variance: float) -> float:
        """Return the number of bends of motor speed that exceed the noise.

        Each turn affects the interval before it and the one after it.

        Parameters
        ----------
        variance : float
            Variance of the pressure noise per sample [Pa squared].

        Returns
        -------
        float
            At least 1 [count].
        """
        left = (self.staying**2 + self.passing**2) * self.turns**2
        return max(1.0, 0.5 * float(np.sum(left / (left + variance))))

    def walk(self, samples: int, block: int) -> Array:
        """Return the variance that pressure gains after each block but the last.

        Parameters
        ----------
        samples, block : int
            Samples of the log's beginning, and of a block [count].

        Returns
        -------
        ndarray, shape (blocks - 1,)
            Zero for a single block [Pa squared].

        Examples
        --------
        >>> IntersampleDoubt(np.array([0.0, 0.0, 3.0, 4.0]), 2.0).walk(4, 1).tolist()
        [0.0, 36.0, 64.0]
        """
        begins = _block_starts(samples, block)[1:]
        return np.add.reduceat((self.staying * self.turns[:samples]) ** 2, begins) if begins.size else np.zeros(1)

    def beside(self, samples: int, block: int) -> Array:
        """Return the variance of each block's mean due to the returning part.

        Parameters
        ----------
        samples, block : int
            As in `walk`.

        Returns
        -------
        ndarray, shape (blocks,)
            [Pa squared]

        Examples
        --------
        >>> IntersampleDoubt(np.array([0.0, 0.0, 3.0, 4.0]), passing=2.0).beside(4, 1).tolist()
        [0.0, 36.0, 64.0, 64.0]
        """
        near = np.maximum(self.turns, np.append(self.turns[1:], 0.0))[:samples]
        begins = _block_starts(samples, block)
        return np.add.reduceat((self.passing * near) ** 2, begins) / np.diff(np.append(begins, samples)) ** 2


def _block_starts(samples: int, block: int) -> IntArray:
    return np.arange(0, samples, block)


def turns(log: GreyBoxLog) -> Array:
    """Return the bend of motor speed at either end of the interval before each sample, the larger of both.

    Parameters
    ----------
    log : GreyBoxLog
        The log, motor speed its first drive.

    Returns
    -------
    ndarray, shape (n,)
        Unsteady second differences, less what noise contributes [rad/s].
    """
    speed = log.drives[:, 0]
    bend = np.diff(speed, n=2, prepend=speed[0], append=speed[-1])
    turn = np.where(steady_bend(speed) == 0.0, np.abs(bend), 0.0)
    return np.maximum(np.maximum(turn, np.append(0.0, turn[:-1])) - OWN_NOISE * log.drive_std[0], 0.0)


def responses_to_speed(problem: Problem, theta: Array, speeds: Iterable[Array]) -> Array:
    """Return the response of residuals to a change of motor speed.

    Parameters
    ----------
    problem : Problem
        The problem, motor speed its first drive.
    theta : ndarray, shape (unknowns,)
        Where it is computed [dimensionless].
    speeds : iterable of ndarray, each of shape (n,)
        Changes of speed [rad/s].

    Returns
    -------
    ndarray, shape (outputs * blocks, several)
        Residuals per unit of the change [dimensionless].
    """
    drives = problem.log.drives
    others = [np.column_stack([NUDGE * one, np.zeros_like(drives[:, 1:])]) for one in speeds]
    known, *moved = problem.disturbed(theta, [drives, *(drives + other for other in others)])
    return np.stack([(one - known).ravel() for one in moved], axis=-1) / NUDGE


def speed_rises(speed: Array) -> Array:
    """Return the rises of speed near each sample on which the oil pumped up to it may depend.

    Parameters
    ----------
    speed : ndarray, shape (n,)
        At the samples [rad/s].

    Returns
    -------
    ndarray, shape (3, n)
        The rise up to a sample, after it, and up to the one before [rad/s].

    Examples
    --------
    >>> speed_rises(np.array([0.0, 1.0, 3.0])).tolist()
    [[0.0, 1.0, 2.0], [1.0, 2.0, 0.0], [0.0, 0.0, 1.0]]
    """
    rise = np.diff(speed, prepend=speed[0])
    return np.stack([rise, np.append(rise[1:], 0.0), np.append(0.0, rise[:-1])])


def covariance_of_turns(problem: Problem, theta: Array, errors: Array, bread: Array, slopes: Array) -> Array:
    """Return the covariance of unknowns due to a motor that bends its course alike at each turn.

    Such a motor filters the samples with weights that are not fitted. The residuals determine these weights in part;
    the result is the effect of what remains.

    Parameters
    ----------
    problem : Problem
        The problem, motor speed its first drive.
    theta : ndarray, shape (unknowns,)
        Its solution [dimensionless].
    errors : ndarray, shape (outputs, blocks)
        The normalised residuals there [dimensionless].
    bread : ndarray, shape (felt, felt)
        Inverse of the normal equations of the unknowns that have an effect [dimensionless].
    slopes : ndarray, shape (outputs * blocks, felt)
        Derivatives of the residuals by them [dimensionless].

    Returns
    -------
    ndarray, shape (felt, felt)
        [dimensionless]
    """
    columns = responses_to_speed(problem.coarse, theta, speed_rises(problem.log.drives[:, 0]))
    answers = bread @ (slopes.T @ columns)
    free = columns - slopes @ answers
    spread = np.linalg.inv(free.T @ free + IN_VOLUME.T @ IN_VOLUME / USUAL_DEVIATION**2)
    weights = spread @ (free.T @ errors.ravel())
    return np.asarray(answers @ (spread + np.outer(weights, weights)) @ answers.T, dtype=np.float64)


def slopes_of_vanished(problem: Problem, theta: Array, errors: Array, felt: NDArray[np.intp]) -> list[Array]:
    """Return the derivatives by unknowns that a fit has reduced to zero, where their logarithms have no effect.

    Without them, bulk modulus would seem as certain as if the pump were known to have no loss.

    Parameters
    ----------
    problem : Problem
        The problem.
    theta : ndarray, shape (unknowns,)
        Its solution [dimensionless].
    errors : ndarray, shape (outputs, blocks)
        The normalised residuals there [dimensionless].
    felt : ndarray of int, shape (felt,)
        Indices of the unknowns that have an effect.

    Returns
    -------
    list of ndarray, each of shape (outputs * blocks,)
        Per relative change of the rig's value of each [dimensionless].
    """
    rig = dict(zip(parameter_names(problem.model.parameters), problem.log.parameters.tolist(), strict=True))
    found: list[Array] = []
    for place, name in enumerate(problem.model.unknowns):
        if name in MAY_VANISH and place not in felt and rig[name] > 0.0:
            moved = theta.copy()
            moved[place] = np.log(np.exp(theta[place]) + NUDGE * rig[name])
            column = (problem.residuals(moved) - errors).ravel() / NUDGE
            if float(column @ column) > 1.0:
                found.append(column)
    return found
