"""When a limit is crossed: by Monte Carlo from the current belief, with settings drawn by their weight."""

from dataclasses import dataclass
from functools import cache
from statistics import NormalDist

import numpy as np

from faults.trend.kalman import Belief, Settings, exponential_growth
from faults.trend.kalman_loops import Index
from plant.arrays import Array

DRAWS = 1000
"""Number of futures that are drawn [count]."""

STRIDES = np.concatenate([np.ones(60), np.full(30, 8.0)])
"""Time steps in which a future is followed, fine at first [count]."""

HORIZON = float(np.sum(STRIDES))
"""Time over which futures are followed [count]."""

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
"""Quantiles of the crossing time: ends of the 90 % interval, of the 50 % interval, and the median [probability]."""


@dataclass(frozen=True, eq=False)
class Crossing:
    """When the level first reaches the limit.

    Parameters
    ----------
    steps : ndarray, shape (draws,)
        Times from now, sorted; infinite if not within `HORIZON` [count].
    """

    steps: Array

    @property
    def quantiles(self) -> Array:
        """Crossing times at `QUANTILES`, shape (5,); infinite if not within `HORIZON` [count]."""
        places = np.minimum((np.array(QUANTILES) * len(self.steps)).astype(int), len(self.steps) - 1)
        return self.steps[places]

    def within(self, steps: float) -> float:
        """Return the probability of a crossing within a time.

        Parameters
        ----------
        steps : float
            Time from now [count].

        Returns
        -------
        float
            The probability [probability].
        """
        return float(np.mean(self.steps <= steps))


def shared_shifts(below: float, above: float, rng: np.random.Generator) -> Array:
    """Return an error that is common to all logs of an actuator, such as that of its rig file, one for each future.

    Parameters
    ----------
    below, above : float
        Standard deviation of the true level below and above what the logs tell [dimensionless].
    rng : numpy.random.Generator
        Source of their order.

    Returns
    -------
    ndarray, shape (draws,)
        True level less what the logs tell: quantiles of both halves of a normal distribution, in any order.
    """
    normal = rng.permutation(_normal_quantiles())
    return np.where(normal < 0.0, below, above) * normal


@cache
def _normal_quantiles() -> Array:
    return np.array([NormalDist().inv_cdf((place + 0.5) / DRAWS) for place in range(DRAWS)])


def crossing(
    belief: Belief, grid: Settings, rng: np.random.Generator, limit: "float | Array" = 1.0, resting: float = 0.0
) -> Crossing:
    """Return when the level first reaches the limit.

    Parameters
    ----------
    belief : Belief
        The belief after the last log.
    grid : Settings
        The settings of the belief.
    rng : numpy.random.Generator
        Source of the futures.
    limit : float or ndarray, shape (draws,)
        The limit, of all futures or of each [dimensionless].
    resting : float
        Share of the futures that do not grow, whatever their setting: a jump looks like growth [probability].

    Returns
    -------
    Crossing
        From `DRAWS` futures; between two steps the crossing is interpolated linearly.
    """
    chosen = rng.choice(len(grid.slope), DRAWS, p=belief.weights(grid))
    level, slope, curvature = _drawn_states(belief, chosen, rng)
    gone = np.where(level >= limit, 0.0, np.inf)
    bend, wander, jerk = grid.bend[chosen], grid.wander[chosen], grid.jerk[chosen]
    rests = np.arange(DRAWS) < resting * DRAWS
    slope, curvature, bend, jerk = (np.where(rests, 0.0, each) for each in (slope, curvature, bend, jerk))
    paces = {stride: _pace_transitions(stride, grid, chosen) for stride in set(STRIDES.tolist())}
    begin = 0.0
    for stride in STRIDES.tolist():
        turn, half, drift, jolt = rng.standard_normal((4, DRAWS))
        before, bowing = level, curvature
        curvature = curvature + np.sqrt(stride) * jerk * jolt
        (rise, growth), (along, across, turned) = paces[stride]
        bowed = bend * (along * turn + across * half) + np.sqrt(stride) * wander * drift
        level = level + rise * slope + stride**2 * (2.0 * bowing + curvature) / 6.0 + bowed
        slope = growth * slope + 0.5 * stride * (bowing + curvature) + bend * turned * turn
        share = np.clip((limit - before) / np.where(level > before, level - before, 1.0), 0.0, 1.0)
        gone = np.where(np.isinf(gone) & (level >= limit), begin + stride * share, gone)
        begin += stride
    return Crossing(np.sort(gone))


def _pace_transitions(stride: float, grid: Settings, chosen: Index) -> tuple[Array, Array]:
    """Return the transition of slopes, shape (2, draws), and the factor of their noise, shape (3, draws)."""
    moves, noises = np.empty((len(grid.pace), 2)), np.empty((len(grid.pace), 3))
    for pace, own in grid.by_pace:
        moves[own], covariance = exponential_growth(stride, pace)
        turned = np.sqrt(covariance[1, 1])
        along = covariance[0, 1] / turned
        noises[own] = along, np.sqrt(covariance[0, 0] - along**2), turned
    return moves[chosen].T, noises[chosen].T


def _drawn_states(belief: Belief, chosen: Index, rng: np.random.Generator) -> Array:
    """Return levels, slopes and curvatures, shape (3, draws), under the settings that were drawn."""
    sizes, axes = np.linalg.eigh(belief.covariance)
    roots = axes * np.sqrt(np.maximum(sizes, 0.0))[:, None, :]
    normal = rng.standard_normal((len(chosen), 3))
    return (belief.mean[chosen] + np.einsum("nij,nj->ni", roots[chosen], normal)).T
