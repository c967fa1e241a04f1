"""Output error of a linear model behind an input nonlinearity (Hammerstein): all values at once, exact derivatives."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimation.arrays import Array
from estimation.identification.fit.covariances import spread_of_fit
from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.input_nonlinearity import NONLINEARITIES
from estimation.identification.free_run.linear_fit import COARSE, fit_linear
from estimation.identification.free_run.linear_kernel import decay_rows, settles
from estimation.identification.free_run.linear_problem import Form, LinearFit, Problem
from estimation.identification.search.levenberg import levenberg
from estimation.notes import EstimateCode
from plant.errors import LogWarning

TOLERANCE, MOST_STEPS = 1e-9, 60
"""Relative gain of the cost below which a descent ends, and most evaluations."""

MOST_REFINED = 3
"""Starts that are refined."""

LINEAR_START_GAIN = 1e-3
"""As `COARSE`, for the linear model before the nonlinearity's values are varied."""


@dataclass(frozen=True, eq=False)
class HammersteinFit:
    """Result of a fit, in the data's scale.

    Parameters
    ----------
    kind : str
        One of `NONLINEARITIES`.
    values : ndarray, shape (k,)
        Values of the nonlinearity.
    starts : ndarray, shape (logs,)
        Initial states of a nonlinearity with memory, one per log; otherwise empty.
    linear : LinearFit
        What follows the nonlinearity.
    """

    kind: str
    values: Array
    starts: Array
    linear: LinearFit

    @property
    def cost(self) -> float:
        """Sum of squared residuals [dimensionless]."""
        return self.linear.cost

    @property
    def theta(self) -> Array:
        """All values [dimensionless], shape (p,)."""
        return np.concatenate([self.values, self.starts, self.linear.theta])


class HammersteinProblem:
    """Sensitivities of one kind and form on given data of one input."""

    def __init__(self, kind: str, form: Form, data: Channels) -> None:
        self.kind, self.form, self.data = NONLINEARITIES[kind], form, data
        self.name = kind
        self.input = np.concatenate([u[:, 0] for u in data.u])
        self.target = np.concatenate(data.y)
        linear = Problem(form, data)
        self.used, self.counted, self.share = linear.used, linear.counted, linear.share
        self.n_static = len(self.kind.names)
        self.n_starts = len(data.u) if self.kind.remembers else 0

    def behind_nonlinearity(self, values: Array, starts: Array) -> tuple[Channels, list[Array]]:
        """Return the data behind the nonlinearity, and the derivatives of each log's input there.

        Parameters
        ----------
        values : ndarray, shape (k,)
            Values of the nonlinearity.
        starts : ndarray, shape (logs,)
            One per log, if it has memory.

        Returns
        -------
        tuple of Channels and list of ndarray, shape (n, columns)
            Columns are values, then the log's own initial state if there is one.
        """
        found = [
            self.kind.apply(u[:, 0], values, float(starts[index]) if self.n_starts else 0.0)
            for index, u in enumerate(self.data.u)
        ]
        return replace(self.data, u=tuple(one[:, None] for one, _ in found)), [slopes for _, slopes in found]

    def jacobian(self, theta: Array) -> tuple[Array, Array]:
        """Return the output and its derivative by every value.

        Parameters
        ----------
        theta : ndarray, shape (p,)
            Nonlinearity, starts, then the linear model's values.

        Returns
        -------
        tuple of ndarray, shapes (n,) and (n, p)
            Output and derivatives, scaled.
        """
        ahead = self.n_static + self.n_starts
        values, starts, linear = theta[: self.n_static], theta[self.n_static : ahead], theta[ahead:]
        data, slopes = self.behind_nonlinearity(values, starts)
        problem = Problem(self.form, data)
        output, behind = problem.jacobian(linear)
        jacobian = np.zeros((output.size, theta.size), order="F")
        jacobian[:, ahead:] = behind
        b = linear[: self.form.n_b]
        f = np.concatenate([[1.0], linear[self.form.n_b : self.form.n_b + self.form.order]])
        for index, by in enumerate(slopes):
            part = slice(int(problem.bounds[index]), int(problem.bounds[index + 1]))
            answers = _responses(by, b, f, self.form.delays[0])
            jacobian[part, : self.n_static] = answers[:, : self.n_static]
            if self.n_starts:
                jacobian[part, self.n_static + index] = answers[:, -1]
        return output, jacobian

    def descend(self, values: Array, starts: Array, linear: Array, least_gain: float = 0.0) -> HammersteinFit:
        """Return the minimum from one start.

        Parameters
        ----------
        values, starts, linear : ndarray, shapes (k,), (logs,) and (p,)
            The start.
        least_gain : float
            As `levenberg` takes it [dimensionless].
        """
        ahead, n_b, n = self.n_static + self.n_starts, self.form.n_b, self.form.order

        def at(theta: Array) -> tuple[float, Array, Array]:
            output, jacobian = self.jacobian(theta)
            left = output - self.target
            return self.counted.square(left), *self.counted.normal_equations(jacobian, left)

        def acceptable(theta: Array) -> bool:
            return self.kind.may(self.input, theta[: self.n_static]) and settles(theta[ahead + n_b : ahead + n_b + n])

        start = np.concatenate([values, starts, linear])
        cost, best = levenberg(at, start, acceptable, tolerance=TOLERANCE, most_steps=MOST_STEPS, least_gain=least_gain)
        return HammersteinFit(
            self.name,
            best[: self.n_static],
            best[self.n_static : ahead],
            LinearFit(self.form, best[ahead:], self.share * cost),
        )


def _responses(inputs: Array, b: Array, f: Array, delay: int) -> Array:
    """Return the response of the linear model to each column, constant at its first value before."""
    rows = np.empty((inputs.shape[1], inputs.shape[0]))
    padded = np.concatenate([np.repeat(inputs[:1], delay + b.size, axis=0), inputs])
    for row, column in zip(rows, padded.T, strict=True):
        row[:] = np.convolve(column, b)[b.size : b.size + row.size]
    decay_rows(f, rows, float(b.sum()) * inputs[0])
    return rows.T


def fit_hammerstein(kind: str, form: Form, data: Channels, denominators: Sequence[Array]) -> HammersteinFit | None:
    """Return the best model of one kind and form; None if the input's samples do not reach the nonlinearity.

    Parameters
    ----------
    kind : str
        One of `NONLINEARITIES`.
    data : Channels
        Scaled, one input.
    denominators : sequence of ndarray, shape (order + 1,)
        Starts of the linear part.
    """
    problem = HammersteinProblem(kind, form, data)
    tried: list[tuple[float, Array, Array]] = []
    for values in problem.kind.starts(problem.input):
        if not problem.kind.may(problem.input, values):
            continue
        behind, _ = problem.behind_nonlinearity(values, _first_inputs(problem))
        if any(np.ptp(u) == 0.0 for u in behind.u):
            continue
        inner = Problem(form, behind)
        tried += [(inner.profiled(f)[0], values, f) for f in denominators]
    fits: list[HammersteinFit] = []
    for _, values, f in _distinct_starts(sorted(tried, key=lambda one: one[0])):
        behind, _ = problem.behind_nonlinearity(values, _first_inputs(problem))
        near = fit_linear(form, behind, [f], least_gain=LINEAR_START_GAIN)
        fits.append(problem.descend(values, _first_inputs(problem), near.theta, COARSE))
    return min(fits, key=lambda one: one.cost) if fits else None


def _first_inputs(problem: HammersteinProblem) -> Array:
    return np.array([u[0, 0] for u in problem.data.u]) if problem.n_starts else np.empty(0)


def _distinct_starts(ranked: Sequence[tuple[float, Array, Array]]) -> list[tuple[float, Array, Array]]:
    """Return the best starts of different values of the nonlinearity."""
    kept: list[tuple[float, Array, Array]] = []
    for one in ranked:
        if len(kept) < MOST_REFINED and not any(np.array_equal(one[1], other[1]) for other in kept):
            kept.append(one)
    return kept


def finished_fit(fit: HammersteinFit, data: Channels) -> HammersteinFit:
    """Return the fit continued to its minimum, on its own data.

    Parameters
    ----------
    data : Channels
        Scaled.
    """
    return HammersteinProblem(fit.kind, fit.linear.form, data).descend(fit.values, fit.starts, fit.linear.theta)


def refitted_hammerstein(fit: HammersteinFit, data: Channels, least_gain: float = 0.0) -> HammersteinFit:
    """Return the fit continued on other data with as many logs.

    Parameters
    ----------
    data : Channels
        Scaled.
    least_gain : float
        As `levenberg` takes it [dimensionless].
    """
    problem = HammersteinProblem(fit.kind, fit.linear.form, data)
    starts = fit.starts if len(fit.starts) == problem.n_starts else _first_inputs(problem)
    behind, _ = problem.behind_nonlinearity(fit.values, starts)
    begun = fit_linear(fit.linear.form, behind, [fit.linear.f], least_gain=max(LINEAR_START_GAIN, least_gain))
    return problem.descend(fit.values, starts, begun.theta, least_gain)


def deviations(fit: HammersteinFit, data: Channels) -> Array:
    """Return the standard deviations of the nonlinearity's values, for coloured residuals.

    Parameters
    ----------
    data : Channels
        The data of the fit.

    Returns
    -------
    ndarray, shape (k,)
        In the data's scale; infinite for a value without information [dimensionless].
    """
    problem = HammersteinProblem(fit.kind, fit.linear.form, data)
    output, jacobian = problem.jacobian(fit.theta)
    residual = np.where(problem.used, output - problem.target, 0.0)
    bounds = np.concatenate([[0], np.cumsum([y.size for y in data.y])]).astype(np.int64)
    spread = spread_of_fit(jacobian, residual, problem.used, bounds)
    if not spread.determined:
        warnings.warn(LogWarning(EstimateCode.NOT_DETERMINED.note()), stacklevel=2)
    variance = np.diag(spread.taken)[: problem.n_static]
    return np.sqrt(np.where(variance > 0.0, variance, np.inf))
