"""Local linear trends run over a series of logs, one for each setting of a grid of variances.

Level and slope follow the local linear trend (Durbin and Koopman, Time Series Analysis by State Space Methods, 2012,
section 3.2), in continuous time so that logs need not be evenly spaced: over a time d the slope gains variance
``bend**2 d``, and the level ``wander**2 d + bend**2 d**3 / 3`` with covariance ``bend**2 d**2 / 2``. A third state, the
curvature, lets growth speed up or come to rest; it gains variance ``jerk**2 d``. Each log brings its own measurement
variance, to which every setting adds ``scatter**2``. Values are on the scale on which the healthy actuator is 0 and the
limit 1; the unit of time is the usual time between two logs, a count of logs.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, lru_cache
from itertools import product

import numpy as np

from plant.arrays import Array

BENDS = (0.0, 1e-3, 3e-3, 1e-2)
"""Standard deviation that the slope gains in a step [1/log]."""

SLOPES = (0.005, 0.03)
"""Standard deviation of the slope before the first log [1/log]."""

CURVATURES = ((0.0, 0.0), (1e-3, 4e-4))
"""Standard deviation of the curvature before the first log, and that which it gains in a step [1/log^2]."""

WANDERS = (0.0, 0.005, 0.02)
"""Standard deviation that the level gains in a step by wandering [dimensionless]."""

SCATTERS = (0.0, 0.01, 0.03, 0.1)
"""Standard deviation from log to log beyond each log's own [dimensionless]."""

LEVEL = 1.0
"""Standard deviation of the level before the first log [dimensionless]."""

GROSS = 3.5
"""An innovation counts as no more than so many standard deviations [dimensionless]: one wrong log is no trend."""


@dataclass(frozen=True, eq=False)
class Settings:
    """A grid of settings, each with the same prior weight within its hypothesis.

    Parameters
    ----------
    slope, curvature, jerk, bend, wander, scatter : ndarray, shape (g,)
        As `SLOPES`, `CURVATURES`, `BENDS`, `WANDERS` and `SCATTERS` say [each in its unit].
    """

    slope: Array
    curvature: Array
    jerk: Array
    bend: Array
    wander: Array
    scatter: Array

    @property
    def growing(self) -> "np.ndarray[tuple[int], np.dtype[np.bool_]]":
        """Whether a slope is believed at all."""
        return self.slope > 0.0

    @property
    def log_prior(self) -> Array:
        """Logarithm of each setting's prior weight, half to each hypothesis [dimensionless]."""
        counts = np.where(self.growing, np.sum(self.growing), np.sum(~self.growing))
        return -np.log(2.0 * counts)


@cache
def settings() -> Settings:
    """Return the grid: every combination with a slope, and those without one."""
    growth = [(slope, *curvature, bend) for slope, curvature, bend in product(SLOPES, CURVATURES, BENDS)]
    grid = [(*one, *rest) for rest in product(WANDERS, SCATTERS) for one in (*growth, (0.0, 0.0, 0.0, 0.0))]
    return Settings(*np.array(grid).T)


@dataclass(frozen=True, eq=False)
class Belief:
    """What is believed after a log under each setting.

    Parameters
    ----------
    mean : ndarray, shape (g, 3)
        Level, slope and curvature [dimensionless, 1/log, 1/log^2].
    covariance : ndarray, shape (g, 3, 3)
        Of the three [products of their units].
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
    """Return what is believed before the first log."""
    count = len(grid.slope)
    covariance = np.zeros((count, 3, 3))
    covariance[:, 0, 0], covariance[:, 1, 1], covariance[:, 2, 2] = LEVEL**2, grid.slope**2, grid.curvature**2
    return Belief(np.zeros((count, 3)), covariance, np.zeros(count))


def beliefs(times: Array, values: Array, stds: Array, grid: Settings) -> Iterator[Belief]:
    """Yield what is believed after each log.

    Parameters
    ----------
    times : ndarray, shape (n,)
        Rising [count].
    values, stds : ndarray, shape (n,)
        What each log says, and its own standard deviation [dimensionless].
    grid : Settings
        The grid.

    Yields
    ------
    Belief
        One a log.
    """
    now = first_belief(grid)
    for time, before, value, std in zip(times, np.concatenate([times[:1], times[:-1]]), values, stds, strict=True):
        now = after(now, float(time - before), float(value), float(std), grid)
        yield now


def after(now: Belief, step: float, value: float, std: float, grid: Settings) -> Belief:
    """Return what is believed after a further log.

    Parameters
    ----------
    step : float
        Time since the last one [count].
    value, std : float
        What the log says, and its own standard deviation [dimensionless].
    """
    return absorbed(moved(now, step, grid), value, std, grid)


def moved(now: Belief, step: float, grid: Settings) -> Belief:
    """Return what is believed of a later time.

    Parameters
    ----------
    step : float
        How much later [count].
    """
    move, both, bent, jerked = _step(step)
    gained = grid.bend[:, None] ** 2 * bent + grid.jerk[:, None] ** 2 * jerked
    gained[:, 0] += grid.wander**2 * step
    covariance = now.covariance.reshape(-1, 9) @ both.T + gained
    return Belief(now.mean @ move.T, covariance.reshape(-1, 3, 3), now.evidence)


@lru_cache(maxsize=64)
def _step(step: float) -> tuple[Array, Array, Array, Array]:
    """Return what moves means and covariances, rows one after the other, and what noise on slope and curvature adds."""
    move = np.array([[1.0, step, 0.5 * step**2], [0.0, 1.0, step], [0.0, 0.0, 1.0]])
    return move, np.asarray(np.kron(move, move), dtype=np.float64), _gained(step, 2).ravel(), _gained(step, 3).ravel()


def _gained(step: float, states: int) -> Array:
    """Return the covariance, shape (3, 3), that unit white noise on the last of some states brings in a time."""
    place = np.arange(states - 1, -1, -1)
    power = place[:, None] + place + 1
    factorials = np.array([1.0, 1.0, 2.0])[place]
    gained = np.zeros((3, 3))
    gained[:states, :states] = step**power / (power * factorials[:, None] * factorials)
    return gained


def absorbed(now: Belief, value: float, std: float, grid: Settings) -> Belief:
    """Return what is believed after a log, an innovation beyond `GROSS` being counted as that.

    Parameters
    ----------
    value, std : float
        What the log says, and its own standard deviation [dimensionless].
    """
    innovation = value - now.mean[:, 0]
    expected = np.maximum(now.covariance[:, 0, 0] + std**2 + grid.scatter**2, (innovation / GROSS) ** 2)
    gain = now.covariance[:, :, 0] / expected[:, None]
    said = -0.5 * (np.log(2.0 * np.pi * expected) + innovation**2 / expected)
    covariance = now.covariance - gain[:, :, None] * now.covariance[:, None, 0, :]
    return Belief(now.mean + gain * innovation[:, None], covariance, now.evidence + said)


def evidence_of(belief: Belief, grid: Settings) -> float:
    """Return the logarithm of the probability of all logs, settings integrated out [dimensionless]."""
    return float(np.logaddexp.reduce(belief.evidence + grid.log_prior))


def growth_evidence(belief: Belief, grid: Settings) -> float:
    """Return how much more probable the logs are with a slope than without.

    Without a slope the ratio has mean 1 at any time, so it ever exceeds 1/a with a probability of a at most (Ville,
    Étude critique de la notion de collectif, 1939).

    Returns
    -------
    float
        Logarithm of the ratio [dimensionless].
    """
    with_slope = np.where(grid.growing, belief.evidence + grid.log_prior, -np.inf)
    without = np.where(grid.growing, -np.inf, belief.evidence + grid.log_prior)
    return float(np.logaddexp.reduce(with_slope) - np.logaddexp.reduce(without))


def moments(now: Belief, grid: Settings, state: int = 0) -> tuple[float, float]:
    """Return mean and standard deviation of a state, settings integrated out.

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
