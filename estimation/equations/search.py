"""Steps, starts and noise: the search for the optimum of a user's equations on their logs."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimation.arrays import Array
from estimation.equations.definition import Equations
from estimation.equations.kernel import SCHEMES
from estimation.equations.problem import Part, Problem, spread
from estimation.fits.greybox.descent import Point, descend
from estimation.log_checks.measurement_noise import NORMAL_MAD
from plant.errors import HydrostateError

MOST_STEPS = 64
"""Largest number of model steps for each sample."""

LARGEST_STEP_CHANGE = 0.1
"""Change of the prediction with steps of half the length, over the noise, up to which a search may begin [fraction]."""

LARGEST_SHIFT = 0.05
"""Change of the solution with steps of half the length, in its own standard deviations, up to which it is accepted."""

BALANCED_NOISE = 0.1
"""Noise assumed for every output while a search begins, over its spread [fraction]: no output outweighs the others."""

LEAST_NOISE = 1e-6
"""Least noise of an output, over its spread [fraction], so that a simulation without noise can be fitted."""

EVALUATIONS, SCREENING = 100, 15
"""Evaluations that a descent may take, and evaluations for every start if there are several."""

LEAST_PREDICTED_GAIN = 1e-7
"""Decrease of half the sum of squares predicted for a further step, below which the search ends: less moves no unknown
by a 2000th of its deviation."""

FINALISTS = 3
"""Number of starts that are continued."""

LENGTHS = (1 / 32, 1 / 16, 1 / 8, 1 / 4, 1 / 2, 1.0)
"""Beginnings of the logs on which a search is guided if it failed on the whole [fraction]."""

UNEXPLAINED_RATIO = 3.0
"""Residuals over the noise from the log's second differences, above which this is tried [dimensionless]."""

FEWEST_AT_FIRST = 30
"""Samples of the shortest beginning."""

ROUNDS = 6
"""Number of times that noise is estimated from the residuals and the fit continued; it settles within three."""


@dataclass(frozen=True, eq=False)
class Solution:
    """Result of a search.

    Parameters
    ----------
    problem : Problem
        The problem with its steps and the noise estimated from the residuals.
    others : tuple of ndarray, shape (unknowns,)
        Solutions from other starts [dimensionless].
    moved : float
        Shift of the solution with steps of half the length, in its standard deviations [dimensionless].
    evaluations : int
        Evaluations allowed in a descent, if the last descent did not settle; 0 if it did.
    """

    problem: Problem
    point: Point
    others: tuple[Array, ...] = ()
    moved: float = 0.0
    evaluations: int = 0


def best_solution(
    equations: Equations, parts: Sequence[Part], noise: Array, *, robust: bool, starts: int, seed: int
) -> Solution:
    """Return the best fit found.

    Parameters
    ----------
    parts : sequence of Part
        The logs.
    noise : ndarray, shape (outputs,)
        Standard deviation of each output's noise [its unit]; NaN to estimate it from the residuals.
    robust : bool
        Whether outliers count linearly.
    starts : int
        Number of starts: the parameters' own, the others drawn within their bounds.
    seed : int
        Seed of the random starts.

    Raises
    ------
    HydrostateError
        If the equations run away from every start.
    """
    typical = spread(parts)
    typical = np.where(typical > 0.0, typical, 1.0)
    first = np.where(np.isnan(noise), np.maximum(noise_of(parts), LEAST_NOISE * typical), noise)
    problem = Problem(equations, tuple(parts), "rk4", 1, first, robust)
    guesses = _guesses(problem, starts, seed)
    problem = with_enough_steps(problem, guesses[0])
    rough = problem.with_noise(BALANCED_NOISE * typical)
    ends = _optima(rough, guesses)
    if not _is_explained(problem, ends[0].theta, first):
        ends = sorted([*ends, _optimum_by_lengthening(rough, guesses[0])], key=lambda point: point.cost)
    solution = _refined_solution(problem, ends[0], noise, typical)
    while solution.moved > LARGEST_SHIFT and solution.problem.substeps < MOST_STEPS:
        finer = replace(solution.problem, substeps=2 * solution.problem.substeps)
        solution = _refined_solution(finer, solution.point, noise, typical)
    return replace(solution, others=tuple(end.theta for end in ends[1:]))


def noise_of(parts: Sequence[Part]) -> Array:
    """Return the standard deviation of each output's noise by its second differences, free of smooth signals.

    Returns
    -------
    ndarray, shape (outputs,)
        Each in its unit.
    """
    found: list[float] = []
    for rows in zip(*(part.measured for part in parts), strict=True):
        bends = np.concatenate([np.diff(row[np.isfinite(row)], n=2) for row in rows])
        found.append(NORMAL_MAD * float(np.median(np.abs(bends))) / 6.0**0.5 if len(bends) else 0.0)
    return np.array(found)


def _guesses(problem: Problem, starts: int, seed: int) -> list[Array]:
    """Return the starts: the first as given, the others drawn within the bounds, initial states kept."""
    given = problem.coordinates(np.array([one.start for one in problem.unknowns]))
    low, high = problem.bounds
    rng, found = np.random.default_rng(seed), [given]
    near_low, near_high = np.maximum(low, given - 2.0), np.minimum(high, given + 2.0)
    fitted = len(problem.equations.parameters)
    for _ in range(starts - 1):
        drawn = rng.uniform(np.where(np.isfinite(low), low, near_low), np.where(np.isfinite(high), high, near_high))
        drawn[fitted:] = given[fitted:]
        found.append(drawn)
    return found


def with_enough_steps(problem: Problem, theta: Array) -> Problem:
    """Return the problem with the fewest steps that predict well: explicit, or implicit if the equations are stiff.

    Parameters
    ----------
    theta : ndarray, shape (unknowns,)
        Point of evaluation [dimensionless].

    Raises
    ------
    HydrostateError
        If the equations run away whatever the steps.
    """
    tried: list[tuple[float, Problem]] = []
    for scheme in SCHEMES:
        steps, runs = 1, dict[int, Array | None]()
        while steps <= MOST_STEPS:
            one = replace(problem, scheme=scheme, substeps=steps)
            for count in (steps, 2 * steps):
                if count not in runs:
                    runs[count] = _finite_residuals(replace(one, substeps=count), theta)
            coarse, fine = runs[steps], runs[2 * steps]
            if coarse is not None and fine is not None:
                change = float(np.sqrt(np.mean((coarse - fine) ** 2)))
                if change < LARGEST_STEP_CHANGE:
                    return one
                tried.append((change, one))
            steps *= 2
    if not tried:
        raise HydrostateError("the equations run away: their values leave all bounds; try other starts")
    return min(tried, key=lambda pair: pair[0])[1]


def _finite_residuals(problem: Problem, theta: Array) -> Array | None:
    """Return all residuals, or None if they are not finite."""
    errors = np.concatenate([one.ravel() for one in problem.residuals(theta)])
    return errors if np.isfinite(errors).all() else None


def _optima(problem: Problem, guesses: Sequence[Array]) -> list[Point]:
    """Return the optima reached from the better starts, best first."""
    points = [problem.at(guess) for guess in guesses]
    able = [point.theta for point in points if np.isfinite(point.cost)]
    if not able:
        raise HydrostateError("the equations run away from every start: their values leave all bounds; try others")
    if len(able) > 1:
        near = [descend(problem.at, guess, SCREENING, problem.bounds) for guess in able]
        able = [point.theta for point in sorted(near, key=lambda point: point.cost)[:FINALISTS]]
    ends = [descend(problem.at, guess, EVALUATIONS, problem.bounds) for guess in able]
    return sorted(ends, key=lambda point: point.cost)


def _is_explained(problem: Problem, theta: Array, noise: Array) -> bool:
    """Return whether the residuals are as small as the noise of the measured outputs."""
    errors = np.concatenate(problem.with_noise(noise).residuals(theta), axis=1)
    return bool(np.isfinite(errors).all() and np.sqrt(np.mean(errors**2, axis=1)).max() < UNEXPLAINED_RATIO)


def _optimum_by_lengthening(problem: Problem, guess: Array) -> Point:
    """Return the result of a search along ever longer beginnings, which keeps an oscillation in phase."""
    theta = guess
    for share in LENGTHS:
        counts = [max(round(share * part.measured.shape[1]), FEWEST_AT_FIRST) for part in problem.parts]
        parts = [
            replace(part, inputs=part.inputs[:count], measured=part.measured[:, :count])
            for part, count in zip(problem.parts, counts, strict=True)
        ]
        beginning = replace(problem, parts=tuple(parts))
        theta = descend(beginning.at, theta, EVALUATIONS, beginning.bounds).theta
    return problem.at(theta)


def _refined_solution(problem: Problem, point: Point, noise: Array, typical: Array) -> Solution:
    """Return the fit continued until noise and unknowns agree, and how far it depends on the steps' length."""
    left = 0
    for _ in range(ROUNDS):
        deviations = np.where(np.isnan(noise), _residual_deviations(problem, point.theta, typical), noise)
        same = bool(np.allclose(deviations, problem.noise, rtol=0.01))
        problem = problem.with_noise(deviations)
        point, left = _final_descent(problem, point.theta)
        if same:
            break
    return Solution(problem, point, moved=_step_length_shift(problem, point), evaluations=left)


def _final_descent(problem: Problem, theta: Array) -> tuple[Point, int]:
    counted = 0

    def at(where: Array) -> Point:
        nonlocal counted
        counted += 1
        return problem.at(where)

    point = descend(at, theta, EVALUATIONS, problem.bounds, LEAST_PREDICTED_GAIN)
    return point, EVALUATIONS if counted >= EVALUATIONS else 0


def _residual_deviations(problem: Problem, theta: Array, typical: Array) -> Array:
    """Return the deviation of each output's residuals; degrees of freedom are shared in proportion to samples."""
    errors = problem.errors(theta)
    free = max(1.0 - len(theta) / sum(map(len, errors)), 0.1)
    if problem.robust:
        size = [NORMAL_MAD * float(np.median(np.abs(row))) for row in errors]
    else:
        size = [float(np.sqrt(np.mean(row**2) / free)) for row in errors]
    return np.maximum(size, LEAST_NOISE * typical)


def _step_length_shift(problem: Problem, point: Point) -> float:
    """Return the shift of the solution with steps of half the length, in standard deviations: ``|Q'e|``."""
    finer = _finite_residuals(replace(problem, substeps=2 * problem.substeps), point.theta)
    coarse = _finite_residuals(problem, point.theta)
    if finer is None or coarse is None:
        return np.inf
    values, vectors = np.linalg.eigh(point.gram)
    kept = values > 1e-12 * values.max()
    along = vectors[:, kept].T @ (problem.slopes(point.theta).T @ (finer - coarse)) / np.sqrt(values[kept])
    return float(np.linalg.norm(along))
