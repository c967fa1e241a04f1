"""What the motor's course between the samples of a slow log leaves open, as noise of the pressure.

A slow log says how fast the motor turns at its samples, not in between. Where speed turns suddenly the oil that is
pumped by straight lines is off in two ways. A command that came at an unknown time leaves a volume open, which stays
until it leaks off: pressure walks. And a motor that nears its new speed over a sample or two is off by the same course
each time, which comes back by itself: the samples beside a turn are off, those after it are not.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimation.arrays import Array, IntArray
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.greybox.problem import Problem
from estimation.fits.greybox.speed_course import steady_bend
from plant.solvers.steps import parameter_names

SLOW = 1.5e-3
"""Sample time from which the motor's course between samples counts [s]; judged: to 1 ms its lead takes it up."""

OWN_NOISE = 4.0
"""Deviations of speed's noise beyond which a second difference is a turn of the motor [dimensionless]."""

SHARES = np.array([0.5, 0.7, 1.0, 1.4])
"""Variances of the pressure's noise that are tried, over what was read off the log [fraction]: in a slow log the latter
holds some of what the actuator does."""

TRIED = np.array([0.0, *np.geomspace(0.005, 0.28, 7)])
"""What is tried of what is open of the oil pumped in a sample, over what a turn of the speed could make of it
[fraction]: a speed that jumps at an unknown time leaves ``12^-1/2`` open."""

LONGEST = 5000
"""Blocks of a log's beginning that are asked what is open [count]."""

AT_ONCE = 64
"""Blocks whose products are summed at a time [count]."""

ALIKE = 1e-9
"""Power of a combination of columns of length one below which it tells nothing [dimensionless]: rounding is some 1e-15
of it."""

MAY_VANISH = ("leakage_coefficient", "flow_bias")
"""Unknowns that a slow log may put to nothing, and so far from what they are that bulk modulus follows."""

NUDGE = 1e-2
"""Change by which an answer is read off: of those unknowns as a share of the rig's value, of what is added to motor
speed as a share of that [fraction]."""


IN_VOLUME = 0.5 * np.array([[1.0, 0.0, 1.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
"""Oil that the three of `ways` pump in a sample, by the rise in the sample before, after, and two before; the motor's
lead takes up what goes with the sample's own rise."""

USUAL = 0.1
"""Standard deviation of each before the log is seen, over a sample time [fraction]: 0.02 to 0.15 for motors of 2 to 6
ms at 100 to 500 Hz."""


@dataclass(frozen=True, eq=False)
class Course:
    """What is open of the motor's course between samples.

    Parameters
    ----------
    turns : ndarray, shape (n,)
        What pressure would rise by, did the largest turn of the speed beside it add to the oil pumped up to a sample
        [Pa].
    staying, passing : float
        Standard deviation of what stays, and of what comes back, over that [fraction].
    """

    turns: Array
    staying: float = 1.0
    passing: float = 1.0

    @property
    def passes(self) -> int:
        """How often the motor turns [count]: each turn is felt in the time before it and in that after it."""
        return int(np.count_nonzero(self.turns)) // 2

    def walk(self, samples: int, block: int) -> Array:
        """Return the variance that pressure gains after each block but the last.

        Parameters
        ----------
        samples, block : int
            Samples of the log's beginning that is asked, and of a block [count].

        Returns
        -------
        ndarray, shape (blocks - 1,)
            Of a single block one zero [Pa squared].

        Examples
        --------
        >>> Course(np.array([0.0, 0.0, 3.0, 4.0]), 2.0).walk(4, 1).tolist()
        [0.0, 36.0, 64.0]
        """
        begins = _begins(samples, block)[1:]
        return np.add.reduceat((self.staying * self.turns[:samples]) ** 2, begins) if begins.size else np.zeros(1)

    def beside(self, samples: int, block: int) -> Array:
        """Return the variance of each block's mean that comes back.

        Parameters
        ----------
        samples, block : int
            As of `walk`.

        Returns
        -------
        ndarray, shape (blocks,)
            [Pa squared]

        Examples
        --------
        >>> Course(np.array([0.0, 0.0, 3.0, 4.0]), passing=2.0).beside(4, 1).tolist()
        [0.0, 36.0, 64.0, 64.0]
        """
        near = np.maximum(self.turns, np.append(self.turns[1:], 0.0))[:samples]
        begins = _begins(samples, block)
        return np.add.reduceat((self.passing * near) ** 2, begins) / np.diff(np.append(begins, samples)) ** 2


def _begins(samples: int, block: int) -> IntArray:
    return np.arange(0, samples, block)


def turns(log: GreyBoxLog) -> Array:
    """Return by how much the motor turns at either end of the time up to each sample, the larger of both.

    Parameters
    ----------
    log : GreyBoxLog
        The log, motor speed its first drive.

    Returns
    -------
    ndarray, shape (n,)
        Second differences that are not steady, less what its noise makes of them [rad/s].
    """
    speed = log.drives[:, 0]
    bend = np.diff(speed, n=2, prepend=speed[0], append=speed[-1])
    turn = np.where(steady_bend(speed) == 0.0, np.abs(bend), 0.0)
    return np.maximum(np.maximum(turn, np.append(0.0, turn[:-1])) - OWN_NOISE * log.drive_std[0], 0.0)


def likeliest(problem: Problem, theta: Array, course: Course) -> tuple[float, float]:
    """Return the likeliest of what stays and of what comes back, under any of `SHARES` of the pressure's noise.

    Parameters
    ----------
    problem : Problem
        The problem.
    theta : ndarray, shape (unknowns,)
        Its solution [dimensionless].
    course : Course
        Its turns count alone.

    Returns
    -------
    tuple of float
        See `Course` [fraction].
    """
    log, unit = problem.log, replace(course, staying=1.0, passing=1.0)
    (noise,) = log.noise
    still = problem.on(replace(log, course=None, noise=(replace(noise, walk=0.0),)))
    samples, block = len(log.measured), max(1, round(log.block / log.sample_time))
    left, freed = _without_offset(still, theta, LONGEST)
    level = noise.variance / block
    walk, beside = np.append(0.0, unit.walk(samples, block)), unit.beside(samples, block)
    return restricted(left * level**0.5, freed, level, walk, beside)


def restricted(left: Array, freed: Array, level: float, walk: Array, beside: Array) -> tuple[float, float]:
    """Return the likeliest noise of residuals from which a fit has taken what its unknowns could.

    A log under steps has some twenty turns, of which ten unknowns take up half. To the likelihood of what is left those
    were quiet; the restricted one counts what was taken (Patterson and Thompson 1971, Biometrika 58).

    Parameters
    ----------
    left : ndarray, shape (blocks,)
        Residuals, 0 where missing [Pa].
    freed : ndarray, shape (blocks, columns)
        What was taken out of them: columns of length one at right angles [dimensionless].
    level : float
        Variance of the pressure's noise in a block [Pa squared].
    walk, beside : ndarray, shape (blocks,)
        Variance that is gained up to each block, and that comes back, where each is open in full [Pa squared].

    Returns
    -------
    tuple of float
        What stays and what comes back, see `Course` [fraction].
    """
    share, staying, passing = (one.ravel() for one in np.meshgrid(SHARES, TRIED, TRIED, indexing="ij"))
    white, walks, passes = share * level, staying**2, passing**2
    values = np.column_stack([left, freed])
    mean, spread, cost = np.zeros((len(white), values.shape[1])), np.zeros_like(white), np.zeros_like(white)
    whitened, together = list[Array](), np.zeros((len(white), values.shape[1], values.shape[1]))
    for value, gained, there in zip(values, walk.tolist(), beside.tolist(), strict=False):
        spread += walks * gained
        if value[0] == 0.0:  # missing
            continue
        total = spread + white + passes * there
        innovation = (value - mean) / np.sqrt(total)[:, None]
        cost += np.minimum(innovation[:, 0] ** 2, 9.0) + np.log(total)
        whitened.append(innovation)
        if len(whitened) == AT_ONCE:
            together += _squares(whitened)
        mean += (spread / np.sqrt(total))[:, None] * innovation
        spread -= spread / total * spread
    if whitened:
        together += _squares(whitened)
    known, pulled = together[:, 1:, 1:], together[:, 1:, 0]
    cost += np.linalg.slogdet(known)[1] - np.sum(pulled * np.linalg.solve(known, pulled[..., None])[..., 0], axis=1)
    at = int(np.argmin(cost))
    return float(staying[at]), float(passing[at])


def _squares(whitened: list[Array]) -> Array:
    """Return sums of products of what was whitened, shape (noises, columns, columns), and forget it."""
    parts = np.stack(whitened, axis=1)
    whitened.clear()
    return np.asarray(parts.transpose(0, 2, 1) @ parts, dtype=np.float64)


def _without_offset(problem: Problem, theta: Array, most: int) -> tuple[Array, Array]:
    """Return residuals of the first blocks less what an offset of motor speed and the unknowns make of them.

    An offset leaves pressure off for long. A walk of the pressure would take it up, and none would be found. With them,
    as columns of length one that are at right angles, is what was taken out.
    """
    errors, slopes = problem.linearised(theta)
    columns = np.column_stack([_answers(problem, theta, [np.ones(len(problem.log.drives))]), slopes])
    errors, columns = errors.ravel()[:most], columns[:most]
    sizes = np.linalg.norm(columns, axis=0)
    columns = columns[:, sizes > 0.0] / sizes[sizes > 0.0]
    squares, ways_out = np.linalg.eigh(columns.T @ columns)
    told = squares > ALIKE
    basis = columns @ (ways_out[:, told] / np.sqrt(squares[told]))  # exactly none where a block is missing
    return errors - basis @ (basis.T @ errors), basis


def _answers(problem: Problem, theta: Array, speeds: Iterable[Array]) -> Array:
    """Return how residuals answer to what is added to motor speed, shape (outputs * blocks, several)."""
    drives = problem.log.drives
    others = [np.column_stack([NUDGE * one, np.zeros_like(drives[:, 1:])]) for one in speeds]
    known, *moved = problem.disturbed(theta, [drives, *(drives + other for other in others)])
    return np.stack([(one - known).ravel() for one in moved], axis=-1) / NUDGE


def ways(speed: Array) -> Array:
    """Return what speed at the samples would be, did oil pumped go with its rise in the times beside each as well.

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
    >>> ways(np.array([0.0, 1.0, 3.0])).tolist()
    [[0.0, 1.0, 2.0], [1.0, 2.0, 0.0], [0.0, 0.0, 1.0]]
    """
    rise = np.diff(speed, prepend=speed[0])
    return np.stack([rise, np.append(rise[1:], 0.0), np.append(0.0, rise[:-1])])


def opened(problem: Problem, theta: Array, errors: Array, bread: Array, slopes: Array) -> Array:
    """Return the covariance of unknowns from a motor that bends its course alike at each turn.

    It filters the samples, by weights that are not fitted. What the residuals say of them, and what they leave open, is
    what the unknowns may be off by.

    Parameters
    ----------
    problem : Problem
        The problem, motor speed its first drive.
    theta : ndarray, shape (unknowns,)
        Its solution [dimensionless].
    errors : ndarray, shape (outputs, blocks)
        The normalised residuals there [dimensionless].
    bread : ndarray, shape (felt, felt)
        Inverse of the normal equations of the unknowns that are felt [dimensionless].
    slopes : ndarray, shape (outputs * blocks, felt)
        Derivatives of the residuals by them [dimensionless].

    Returns
    -------
    ndarray, shape (felt, felt)
        [dimensionless]
    """
    columns = _answers(problem.coarse, theta, ways(problem.log.drives[:, 0]))
    answers = bread @ (slopes.T @ columns)
    free = columns - slopes @ answers
    spread = np.linalg.inv(free.T @ free + IN_VOLUME.T @ IN_VOLUME / USUAL**2)
    weights = spread @ (free.T @ errors.ravel())
    return np.asarray(answers @ (spread + np.outer(weights, weights)) @ answers.T, dtype=np.float64)


def vanished(problem: Problem, theta: Array, errors: Array, felt: NDArray[np.intp]) -> list[Array]:
    """Return the derivatives by unknowns that a fit has put to nothing, whose logarithms are not felt there.

    Where they are left out, bulk modulus seems as sure as if a pump without any loss were known.

    Parameters
    ----------
    problem : Problem
        The problem.
    theta : ndarray, shape (unknowns,)
        Its solution [dimensionless].
    errors : ndarray, shape (outputs, blocks)
        The normalised residuals there [dimensionless].
    felt : ndarray of int, shape (felt,)
        Places of the unknowns that are felt.

    Returns
    -------
    list of ndarray, each of shape (outputs * blocks,)
        By the rig's value of each [dimensionless].
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
