"""Whether a level grows, or rests: at rest it may jump once, as when another pump is fitted or a seal bursts.

Two or three logs before and after a jump look like fast growth, and so do two bursts of logs with months between.
`faults.trend.changes` begins a new stretch only where logs on both sides confirm the jump. Until then, and where none
can, the jump is one of the explanations.
"""

import numpy as np

from faults.trend.kalman import CLIP_DEVIATIONS, JUMP_PRIOR, LEVEL, Belief, Settings, evidence_of
from faults.trend.rest_loops import RestLimits, fill_rest
from plant.arrays import Array

MOST_JUMPS = 40
"""Number of logs at which a jump is followed at once, the likeliest [count]."""


def rest_evidence(times: Array, values: Array, stds: Array, grid: Settings) -> Array:
    """Return after each log how probable all logs so far are without a slope, for a level that jumps once or never.

    A jump has the same prior probability before each log, and a higher one in a pause that is longer than usual.

    Parameters
    ----------
    times, values, stds : ndarray, shape (n,)
        As in `faults.trend.kalman.beliefs`.
    grid : Settings
        The grid, of which the settings without a slope count.

    Returns
    -------
    ndarray, shape (n,)
        Logarithm of the probability of the logs and of rest [dimensionless].
    """
    still = ~grid.growing
    wander, scatter, prior = (each[still] for each in (grid.wander, grid.scatter, grid.log_prior))
    steps = np.diff(times, prepend=times[:1])
    log_jumps = np.log(-np.expm1(-JUMP_PRIOR * np.maximum(steps, 1.0)))
    limits = RestLimits(CLIP_DEVIATIONS, LEVEL**2, float(np.logaddexp.reduce(prior)))
    found, rows = np.empty(len(times)), min(len(times), MOST_JUMPS)
    mean, variance, evidence = np.empty((3, rows, len(prior)))
    room = mean, variance, evidence, np.empty(rows)
    fill_rest(values, stds, steps, log_jumps, limits, wander, scatter, prior, *room, found)
    return found


def growth_evidence(belief: Belief, grid: Settings, rest: float) -> float:
    """Return the log odds of the logs with a slope against rest.

    Without a slope the ratio has mean 1 at most at any time, so the probability that it ever exceeds 1/a is at most a
    (Ville, Étude critique de la notion de collectif, 1939).

    Parameters
    ----------
    rest : float
        Logarithm of the probability of all logs and of rest, from `rest_evidence` [dimensionless].

    Returns
    -------
    float
        Logarithm of the ratio [dimensionless].
    """
    with_slope = np.where(grid.growing, belief.evidence + grid.log_prior, -np.inf)
    return float(np.logaddexp.reduce(with_slope)) - rest


def jumped_share(belief: Belief, grid: Settings, rest: float) -> float:
    """Return the probability that the level jumped and rests since, beside the settings of the belief.

    Parameters
    ----------
    rest : float
        As in `growth_evidence` [dimensionless].

    Returns
    -------
    float
        Share of all [probability].
    """
    every = evidence_of(belief, grid)
    never = float(np.logaddexp.reduce(np.where(grid.growing, -np.inf, belief.evidence + grid.log_prior)))
    jumped = max(np.exp(rest - every) - np.exp(never - every), 0.0)
    return float(jumped / (1.0 + jumped))
