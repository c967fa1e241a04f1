"""Maximum-likelihood output error of a state-space model with several inputs and outputs, with covariance."""

from dataclasses import dataclass

import numpy as np

from estimation.arrays import Array
from estimation.identification.fit.covariances import spread_of_fit
from estimation.identification.search.levenberg import levenberg
from estimation.identification.state_space.joint import Joint
from estimation.identification.state_space.problem import Problem, Size, Values
from estimation.identification.state_space.starts import subspace_starts
from estimation.identification.state_space.system import StateSpace
from plant.errors import HydrostateError


@dataclass(frozen=True)
class Effort:
    """Effort limits of a search.

    Parameters
    ----------
    weighings : int
        Times that the noise's covariance is taken from the residual.
    charts, steps : int
        Sets of coordinates for each of them, and evaluations in one.
    gain : float
        Share of the cost below which another set is not tried; a step ends at a hundredth of it [dimensionless].
    """

    weighings: int
    charts: int
    steps: int
    gain: float


THOROUGH_EFFORT = Effort(3, 6, 25, 1e-7)
"""Effort of the final fit."""

MOST_DESCENDED = 2
"""Number of starts from which the search descends [count]."""


@dataclass(frozen=True, eq=False)
class StateSpaceFit:
    """Result of a fit, in the data's scale.

    Parameters
    ----------
    theta : ndarray, shape (k,)
        As `Problem.unpacked` takes it.
    noise : ndarray, shape (p, p)
        Covariance of the residual [scaled].
    deviance : float
        Twice the negative log likelihood, but for a constant [dimensionless].
    """

    size: Size
    theta: Array
    noise: Array
    deviance: float

    @property
    def a(self) -> Array:
        """Transition of the states, shape (n, n)."""
        return self.theta[: self.size.n**2].reshape(self.size.n, self.size.n)


def fit_state_space(
    size: Size, data: Joint, start: Array | None = None, effort: Effort = THOROUGH_EFFORT
) -> StateSpaceFit:
    """Return the maximum-likelihood model of a size: white output noise, with unknown covariance.

    Parameters
    ----------
    data : Joint
        Scaled.
    start : ndarray, shape (k,), optional
        Where to begin; subspace starts are tried unless told.
    effort : Effort
        How far the search goes.

    Raises
    ------
    HydrostateError
        If there are too few samples for the size.
    """
    problem = Problem(size, data)
    wanted = size.n_matrices - size.n**2 + size.n * len(data.u)
    if int(problem.used.sum()) < 2 * wanted:
        raise HydrostateError(
            f"a state space of order {size.n} has {wanted} values, the logs have {int(problem.used.sum())} samples of "
            "all outputs together: give a lower order"
        )
    starts = [start] if start is not None else _starts(problem)
    if not starts:
        raise HydrostateError(f"the logs are too short for a state space of order {size.n}: give a lower order")
    fits = [_descended(problem, one, effort) for one in starts[:MOST_DESCENDED]]
    return min(fits, key=lambda fit: fit.deviance)


def _starts(problem: Problem) -> list[Array]:
    """Return subspace models with the best B, D, levels and first states, the best fitting first."""
    found = [_completed_values(problem, a, c) for a, c in subspace_starts(problem.data, problem.size.n)]
    return sorted(found, key=lambda theta: float(np.sum(_residual(problem, theta) ** 2)))


def _completed_values(problem: Problem, a: Array, c: Array) -> Array:
    size = problem.size
    columns = problem.linear_columns(a, c)
    used = problem.used.T
    target = np.where(problem.used, problem.y, 0.0).T
    values = np.asarray(np.linalg.lstsq(columns[used], target[used], rcond=1e-10)[0], dtype=np.float64)
    n_b, n_d = size.n * size.m, size.p * size.m * size.direct
    b, d, level, starts = np.split(values, np.cumsum([n_b, n_d, size.p]))
    feed = d.reshape(size.p, size.m) if size.direct else np.zeros((size.p, size.m))
    whole = Values(a, b.reshape(size.n, size.m), c, feed, level, starts.reshape(-1, size.n))
    return problem.balanced(problem.packed(whole))


def _residual(problem: Problem, theta: Array) -> Array:
    """Return the residual, zero for missing outputs, shape (samples, p)."""
    return np.where(problem.used, problem.outputs(problem.unpacked(theta)) - problem.y, 0.0)


def _noise(problem: Problem, theta: Array) -> Array:
    """Return the covariance of the residual over the samples at which both outputs are present."""
    left, used = _residual(problem, theta), problem.used.astype(np.float64)
    noise = left.T @ left / np.maximum(used.T @ used, 1.0)
    size = np.sqrt(np.diag(noise)) + 1e-12
    together = noise / np.outer(size, size)
    # with few common samples the result may not be a covariance matrix
    if np.linalg.eigvalsh(together).min() < 1e-6:
        together = np.eye(len(together))
    return together * np.outer(size, size)


def _whitener(problem: Problem, noise: Array) -> Array:
    """Return the matrix that whitens residuals; where samples are missing, it only scales them."""
    if problem.used.all():
        return np.asarray(np.linalg.inv(np.linalg.cholesky(noise)), dtype=np.float64)
    return np.asarray(np.diag(1.0 / np.sqrt(np.diag(noise))), dtype=np.float64)


def _descended(problem: Problem, start: Array, effort: Effort) -> StateSpaceFit:
    theta = start
    for _ in range(effort.weighings):
        white = _whitener(problem, _noise(problem, theta))
        cost = np.inf
        for _ in range(effort.charts):
            now, theta = _minimum_near(problem, problem.balanced(theta), white, effort)
            if not now < cost * (1.0 - effort.gain):
                break
            cost = now
    noise, used = _noise(problem, theta), problem.used
    together = float(np.linalg.slogdet(noise)[1]) if used.all() else float(np.log(np.diag(noise)).sum())
    deviance = float(used.sum()) / problem.size.p * together
    return StateSpaceFit(problem.size, theta, noise, deviance)


def _minimum_near(problem: Problem, theta: Array, white: Array, effort: Effort) -> tuple[float, Array]:
    """Return the least weighted cost near given values, and its position."""
    basis = problem.directions(theta)

    def at(moved: Array) -> tuple[float, Array, Array]:
        left, columns = _whitened(problem, theta + basis @ moved, basis, white)
        flat = columns.reshape(-1, basis.shape[1])
        return float(np.sum(left**2)), flat.T @ flat, flat.T @ left.ravel()

    def stable(moved: Array) -> bool:
        values = problem.unpacked(theta + basis @ moved)
        return bool(np.abs(np.linalg.eigvals(values.a)).max() < 1.0)

    begin = np.zeros(basis.shape[1])
    cost, best = levenberg(at, begin, stable, tolerance=1e-2 * effort.gain, most_steps=effort.steps)
    return cost, theta + basis @ best


def _whitened(problem: Problem, theta: Array, basis: Array, white: Array) -> tuple[Array, Array]:
    """Return residuals and their slopes along some directions, zero where a sample is missing, mixed by a whitener."""
    outputs, slopes = problem.jacobian(theta)
    used = problem.used.T
    left = np.where(used, outputs - np.where(used, problem.y.T, 0.0), 0.0)
    columns = np.where(used[:, :, None], slopes @ basis, 0.0)
    return white @ left, np.tensordot(white, columns, axes=1)


def system_of(fit: StateSpaceFit, data: Joint, delays: tuple[int, ...]) -> StateSpace:
    """Return a fit with its covariance; the robust one if the residual of an output is not white.

    Parameters
    ----------
    data : Joint
        Scaled, inputs delayed.
    delays : tuple of int
        Of each input [samples].
    """
    problem = Problem(fit.size, data)
    v, basis = problem.unpacked(fit.theta), problem.directions(fit.theta)
    used = problem.used.T
    left, columns = _whitened(problem, fit.theta, basis, _whitener(problem, fit.noise))
    bounds = [0, *(part.stop + o * len(problem.u) for o in range(fit.size.p) for part in data.slices)]
    found = spread_of_fit(
        columns.reshape(left.size, -1), left.ravel(), used.ravel(), np.array(bounds, dtype=np.int64), fit.size.p
    )
    k = fit.size.n_matrices
    spread = (basis @ found.taken @ basis.T)[:k, :k]
    return StateSpace(v.a, v.b, v.c, v.d, v.level, delays, fit.size.direct, data.sample_time, spread)
