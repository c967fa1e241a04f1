"""Local linear trends run over a series of logs, one for each setting of a grid of variances.

Level and slope follow the local linear trend (Durbin and Koopman, Time Series Analysis by State Space Methods, 2012,
section 3.2), in continuous time so that logs need not be evenly spaced: over a time d the slope gains variance
``bend**2 d``, and the level ``wander**2 d + bend**2 d**3 / 3`` with covariance ``bend**2 d**2 / 2``. A third state, the
curvature, lets growth speed up or come to rest; it gains variance ``jerk**2 d``. Self-accelerating wear grows
exponentially: the slope then grows by ``pace`` times itself in a unit of time. Run-in wear levels off: there ``pace``
is negative. Each log has its own measurement
variance, to which every setting adds ``scatter**2``. Values are scaled so that the healthy actuator is at 0 and the
limit at 1; the unit of time is the usual time between two logs, a count of logs.
"""

import math
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from itertools import product

import numpy as np

from faults.trend.kalman_loops import GridRows, Index, Steps, fill_beliefs, fill_predicted
from plant.arrays import Array

BENDS = (0.0, 1e-3, 3e-3, 1e-2)
"""Standard deviation that the slope gains in a step [1/log]."""

SLOPES = (0.005, 0.03)
"""Standard deviation of the slope before the first log [1/log]."""

FAST_SLOPE = 0.2
"""The same for growth that reaches the limit within a few logs; it has no curvature [1/log]."""

CURVATURES = ((0.0, 0.0), (1e-3, 4e-4))
"""Standard deviation of the curvature before the first log, and the standard deviation that it gains in a step
[1/log^2]."""

PACES = (0.03, 0.1, 0.3)
"""Rate of exponential growth of the slope [1/log]: it doubles in 23 logs, in 7, or in 2.3."""

REST_PACES = (-0.2, -0.05)
"""Rate at which a slope decays [1/log]: run-in wear levels off over 5 logs, or over 20."""

REST_SLOPES = (0.03, 0.2)
"""Standard deviation of such a slope before the first log [1/log]: it was the fastest then."""

REST_BENDS = (0.0, 1e-2)
"""Standard deviation that such a slope gains in a step [1/log]: with it, wear may begin after the first log."""

PACED_BENDS = (0.0, 3e-3)
"""Standard deviation that a slope gains in a step besides its exponential growth [1/log]."""

WANDERS = (0.0, 0.005, 0.02)
"""Standard deviation that the level gains in a step by wandering [dimensionless]."""

SCATTERS = (0.0, 0.01, 0.03, 0.1)
"""Standard deviation from log to log beyond each log's own [dimensionless]."""

MOST_GROWTH = math.log(1000.0)
"""Logarithm of the most by which a slope grows by itself between two logs [dimensionless]: after a pause of months no
digit of a level would be left."""

SMALLEST_GROWTH = 1e-4
"""Relative growth in a step below which growth is taken as zero [fraction]: the neglected terms are as large."""

LEVEL = 1.0
"""Standard deviation of the level before the first log [dimensionless]."""

JUMP_PRIOR = 1.0 / 200.0
"""Expected number of jumps per log [probability]."""

CLIP_DEVIATIONS = 3.5
"""Limit at which an innovation is clipped, in standard deviations [dimensionless]: one wrong log is not a trend."""


@dataclass(frozen=True, eq=False)
class Settings:
    """A grid of settings, each with the same prior weight within its hypothesis.

    Parameters
    ----------
    pace, slope, curvature, jerk, bend, wander, scatter : ndarray, shape (g,)
        Values from `REST_PACES`, `PACES`, `SLOPES`, `REST_SLOPES`, `FAST_SLOPE`, `CURVATURES`, `BENDS`, `REST_BENDS`,
        `PACED_BENDS`, `WANDERS` and `SCATTERS` [each in its unit]; paces rise.
    """

    pace: Array
    slope: Array
    curvature: Array
    jerk: Array
    bend: Array
    wander: Array
    scatter: Array

    @property
    def growing(self) -> "np.ndarray[tuple[int], np.dtype[np.bool_]]":
        """Whether each setting has a slope."""
        return self.slope > 0.0

    @cached_property
    def by_pace(self) -> tuple[tuple[float, slice], ...]:
        """Each pace, and the settings that have it."""
        paces, first = np.unique(self.pace, return_index=True)
        ends = [*first[1:], len(self.pace)]
        return tuple((float(pace), slice(int(a), int(b))) for pace, a, b in zip(paces, first, ends, strict=True))

    @cached_property
    def paces(self) -> tuple[float, ...]:
        """Its paces, rising [1/log]."""
        return tuple(pace for pace, _ in self.by_pace)

    @cached_property
    def pace_places(self) -> Index:
        """Index of each setting's pace, shape (g,)."""
        return np.repeat(np.arange(len(self.by_pace)), [own.stop - own.start for _, own in self.by_pace])

    @property
    def rows(self) -> GridRows:
        """The settings in the form that the loops take."""
        return GridRows(self.pace_places, self.bend, self.jerk, self.scatter)

    @cached_property
    def log_prior(self) -> Array:
        """Logarithm of each setting's prior weight, half to each hypothesis [dimensionless].

        The kinds of growth share the half for growth equally: steady, bending, curved, exponential, levelling off.
        """
        kinds = [~self.growing, self.pace < 0.0, self.pace > 0.0, self.curvature > 0.0, self.bend > 0.0]
        way = np.select(kinds, np.arange(len(kinds)), default=len(kinds))
        _, place, counts = np.unique(way, return_inverse=True, return_counts=True)
        ways = np.where(self.growing, len(np.unique(way[self.growing])), 1)
        return -np.log(2.0 * ways * counts[place])


@cache
def settings() -> Settings:
    """Return the grid: every combination with a slope, and those without one."""
    bent = [(0.0, slope, *curvature, bend) for slope, curvature, bend in product(SLOPES, CURVATURES, BENDS)]
    fast = [(0.0, FAST_SLOPE, 0.0, 0.0, bend) for bend in BENDS]
    paced = [(pace, slope, 0.0, 0.0, bend) for pace, slope, bend in product(PACES, SLOPES, PACED_BENDS)]
    still = (0.0, 0.0, 0.0, 0.0, 0.0)
    rested = [(pace, slope, 0.0, 0.0, bend) for pace, slope, bend in product(REST_PACES, REST_SLOPES, REST_BENDS)]
    grid = [(*one, *rest) for one in (*rested, *bent, still, *fast, *paced) for rest in product(WANDERS, SCATTERS)]
    return Settings(*np.array(grid).T)


@dataclass(frozen=True, eq=False)
class Belief:
    """Belief after a log, under each setting.

    Parameters
    ----------
    mean : ndarray, shape (g, 3)
        Level, slope and curvature [dimensionless, 1/log, 1/log^2].
    covariance : ndarray, shape (g, 3, 3)
        Their covariance [products of their units].
    evidence : ndarray, shape (g,)
        Logarithm of the probability of all logs so far [dimensionless].
    """

    mean: Array
    covariance: Array
    evidence: Array

    def weights(self, grid: Settings) -> Array:
        """Return the posterior weight of each setting, shape (g,) [probability]."""
        total = self.evidence + grid.log_prior
        shares = np.exp(total - np.max(total))
        return shares / np.sum(shares)


def first_belief(grid: Settings) -> Belief:
    """Return the prior belief, before the first log."""
    count = len(grid.slope)
    covariance = np.zeros((count, 3, 3))
    covariance[:, 0, 0], covariance[:, 1, 1], covariance[:, 2, 2] = LEVEL**2, grid.slope**2, grid.curvature**2
    return Belief(np.zeros((count, 3)), covariance, np.zeros(count))


def beliefs(times: Array, values: Array, stds: Array, grid: Settings) -> list[Belief]:
    """Return the belief before the first log, and after each log.

    Parameters
    ----------
    times : ndarray, shape (n,)
        Times of the logs, rising [count].
    values, stds : ndarray, shape (n,)
        Value of each log, and its own standard deviation [dimensionless].
    grid : Settings
        The grid.

    Returns
    -------
    list of Belief
        One more than there are logs.
    """
    first, rows = first_belief(grid), len(times) + 1
    if not len(times):
        return [first]
    mean, covariance = np.empty((rows, *first.mean.shape)), np.empty((rows, *first.covariance.shape))
    evidence = np.empty((rows, *first.evidence.shape))
    mean[0], covariance[0], evidence[0] = first.mean, first.covariance, first.evidence
    steps = np.diff(times, prepend=times[:1])
    made = [_step(step, grid.paces) for step in steps.tolist()]
    moves, bent, jerked = (np.array(one) for one in zip(*made, strict=True))
    before = Steps(moves, bent, jerked, steps[:, None] * grid.wander**2)
    fill_beliefs(values, stds, CLIP_DEVIATIONS, grid.rows, before, mean, covariance, evidence)
    return [Belief(mean[k], covariance[k], evidence[k]) for k in range(rows)]


def predict(now: Belief, step: float, grid: Settings) -> Belief:
    """Return the belief at a later time.

    Parameters
    ----------
    step : float
        Time to the prediction [count].
    """
    moves, bent, jerked = _step(step, grid.paces)
    mean, covariance = np.empty_like(now.mean), np.empty_like(now.covariance)
    ahead = Steps(moves[None], bent[None], jerked[None], (grid.wander**2 * step)[None])
    fill_predicted(now.mean, now.covariance, grid.rows, ahead, 0, mean, covariance)
    return Belief(mean, covariance, now.evidence)


@lru_cache(maxsize=64)
def _step(step: float, paces: tuple[float, ...]) -> tuple[Array, Array, Array]:
    """Return transitions of the mean, and covariances that unit noise on slope (each per pace) and curvature adds."""
    moves = np.tile([[1.0, step, 0.5 * step**2], [0.0, 1.0, step], [0.0, 0.0, 1.0]], (len(paces), 1, 1))
    bent, jerked = np.tile(_noise_covariance(step, 2), (len(paces), 1, 1)), _noise_covariance(step, 3)
    for move, turned, pace in zip(moves, bent, paces, strict=True):
        if pace:  # settings with a pace have no curvature
            move[:2, 1], turned[:2, :2] = exponential_growth(step, pace)
    return moves, bent, jerked


def exponential_growth(step: float, pace: float) -> tuple[Array, Array]:
    """Return the transition of level and slope for a growing slope, and the covariance from white noise on the slope.

    The white noise has unit density. Over a long time the growth is slower, so that it is `MOST_GROWTH` in all.

    Parameters
    ----------
    step : float
        The time [count].
    pace : float
        Relative growth of the slope in a unit of time, may be 0 or negative [1/log].

    Returns
    -------
    ndarray, shape (2,)
        Gain of the level, and the slope [count, dimensionless].
    ndarray, shape (2, 2)
        Covariance of level and slope.
    """
    if abs(pace) * step < SMALLEST_GROWTH:  # the limit for small growth; the formulas below would lose all digits
        return np.array([step, 1.0]), _noise_covariance(step, 2)[:2, :2]
    pace = min(pace, MOST_GROWTH / step)
    once, twice = np.expm1(pace * step) / pace, np.expm1(2.0 * pace * step) / (2.0 * pace)
    # integrals from 0 to the step of expm1(pace t) / pace and exp(pace t): of their squares and of their product
    level, both = (twice - 2.0 * once + step) / pace**2, (twice - once) / pace
    return np.array([once, 1.0 + pace * once]), np.array([[level, both], [both, twice]])


def _noise_covariance(step: float, states: int) -> Array:
    """Return the covariance, shape (3, 3), that unit white noise on the last of some states adds over a time."""
    place = np.arange(states - 1, -1, -1)
    power = place[:, None] + place + 1
    factorials = np.array([1.0, 1.0, 2.0])[place]
    gained = np.zeros((3, 3))
    gained[:states, :states] = step**power / (power * factorials[:, None] * factorials)
    return gained


def evidence_of(belief: Belief, grid: Settings) -> float:
    """Return the logarithm of the probability of all logs, marginalised over the settings [dimensionless]."""
    return float(np.logaddexp.reduce(belief.evidence + grid.log_prior))


def moments(now: Belief, grid: Settings, state: int = 0) -> tuple[float, float]:
    """Return mean and standard deviation of a state, marginalised over the settings.

    Parameters
    ----------
    state : int
        0 for the level [dimensionless], 1 for the slope [1/log].

    Returns
    -------
    tuple of float
        Both [the state's unit].
    """
    weights, means = now.weights(grid), now.mean[:, state]
    mean = float(weights @ means)
    return mean, float(np.sqrt(weights @ (now.covariance[:, state, state] + (means - mean) ** 2)))
