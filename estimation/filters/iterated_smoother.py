"""The iterated extended Kalman smoother: the most likely trajectory of the whole log, by the Gauss-Newton method.

A filter linearises before it has seen the later samples. If the piston sticks, its linearisation is often on the wrong
side of breaking loose, and the resulting error is never corrected. Here the model is linearised along a trajectory of
the whole log, a filter and an adjoint (Bierman 1973, as in `estimation.filters.smoother`) find its best correction, the
model is run again with the corrected noise, and so on until the sum of squares settles. Bell (1994) shows that this is
the Gauss-Newton method for the most likely trajectory; the step is shortened until the sum falls, so that it ends in a
minimum.

A constant such as bulk modulus is a state without noise, and its covariance is that of the linearised model at the end:
with Gaussian noise it attains the Cramér-Rao bound if the trajectory is known well enough for the model to be linear
about it. Outliers are weighted by their residuals from the trajectory, repeatedly (Holland and Welsch 1977).
"""

from dataclasses import dataclass

import numpy as np

from estimation.arrays import Array
from estimation.engine.contract import FilterProblem, Trace, empty_trace
from estimation.engine.rule import chosen_settings
from estimation.engine.runner import constant_row
from estimation.filters.linearised_log import Lines, Log
from estimation.filters.trajectory_loops import compile_trajectory
from plant.errors import HydrostateError

ITERATIONS = 50
"""Largest number of corrections."""

SETTLED_DECREASE = 1e-3
"""Decrease of the sum of squares below which it has settled: a thirtieth of a standard deviation [dimensionless]."""

STEP_FACTOR = 0.4
"""Factor on a step that does not lower the sum of squares."""

LEAST_STEP_SHARE = 1e-4
"""Share of a correction below which the search ends."""

WEIGHINGS = 10
"""Largest number of times that outliers are weighted again."""

LONGEST = 1_000_000
"""Largest number of samples: the whole linearised log is held in memory, some 300 bytes for each sample."""


@dataclass(frozen=True, eq=False)
class _Trajectory:
    """A run of the model: its adjoint, the states that follow from it, and the sum of squares."""

    adjoint: Array
    states: Array
    cost: float


class _Search:
    """One log, its kernel, and all that stays constant while the trajectory changes."""

    def __init__(self, problem: FilterProblem) -> None:
        n, (samples, channels) = problem.model.width, problem.measured.shape
        self.problem = problem
        self.kernel = compile_trajectory(problem.model, problem.channels, problem.robust)
        self.added_variance = problem.added_variance + problem.noise * problem.sample_time
        self.bounds = np.array([state.scaled_bounds for state in problem.model.states])
        drives, measured = (np.ascontiguousarray(one, np.float64) for one in (problem.drives, problem.measured))
        self.log = Log(
            constant_row(problem, {}),
            drives,
            measured,
            np.tile(problem.variances, (samples, 1)),
            problem.substeps,
        )
        rows, each = (samples - 1) // problem.every + 1, (samples, channels)
        shapes = (samples, n, n), (*each, n), (*each, n), each, each, (rows, n, n)
        self.lines = Lines(*(np.empty(shape) for shape in shapes))

    def run(self, adjoint: Array) -> _Trajectory:
        """Return the model's run for an adjoint."""
        states, known = np.empty_like(adjoint), self.problem.covariance @ adjoint[0]
        start = self.problem.mean + known
        cost = self.kernel.roll(start, adjoint, self.added_variance, self.bounds, self.log, states)
        return _Trajectory(adjoint, states, float(cost + adjoint[0] @ known))

    def begin(self) -> _Trajectory:
        """Return the best of a few runs: from the prior's mean, and with each constant moved by one deviation."""
        samples, n = self.problem.measured.shape[0], self.problem.model.width
        tried = [self.run(np.zeros((samples, n)))]
        for i in np.flatnonzero((self.problem.noise == 0.0) & (np.diag(self.problem.covariance) > 0.0)):
            for sign in (-1.0, 1.0):
                adjoint = np.zeros((samples, n))
                adjoint[0, i] = sign / np.sqrt(self.problem.covariance[i, i])
                tried.append(self.run(adjoint))
        return min(tried, key=lambda one: one.cost)

    def linearise(self, at: _Trajectory) -> Array:
        """Linearise along a trajectory, and return the filter's covariance at the end of the log."""
        P = self.problem.covariance.copy()
        way = (at.states, at.adjoint, self.added_variance, self.log)
        self.kernel.forward(self.problem.mean, P, *way, self.lines, self.problem.every)
        return P

    def corrected(self, at: _Trajectory) -> _Trajectory | None:
        """Return a trajectory with a smaller sum of squares; None if none lies towards the best linear correction."""
        self.linearise(at)
        wanted = np.empty_like(at.adjoint)
        self.kernel.backward(self.lines, wanted)
        share = 1.0
        while share > LEAST_STEP_SHARE:
            candidate = self.run(at.adjoint + share * (wanted - at.adjoint))
            if candidate.cost < at.cost:
                return candidate
            share *= STEP_FACTOR
        return None

    def descend(self, at: _Trajectory) -> _Trajectory:
        """Correct a trajectory until its sum of squares settles."""
        for _ in range(ITERATIONS):
            better = self.corrected(at)
            if better is None:
                break
            at, fallen = better, at.cost - better.cost
            if fallen < SETTLED_DECREASE:
                break
        return at

    def reweigh(self, at: _Trajectory) -> _Trajectory:
        """Weight every sample by its residual, and return the same trajectory with its new sum of squares."""
        self.kernel.reweigh(at.states, self.log, self.problem.variances)
        return self.run(at.adjoint)


def iterated_smoother(problem: FilterProblem) -> Trace:
    """Find the most likely trajectory of a log, and the covariance along it.

    Returns
    -------
    Trace
        Final belief, smoothed track with its variance, and the innovations of the filter that is linearised along the
        trajectory; NaN if the model's own run from the prior diverges.

    Raises
    ------
    HydrostateError
        If the user set something, or the log is longer than the memory that is set aside.
    """
    chosen_settings(problem, "iterated-smoother")
    samples = len(problem.measured)
    if samples > LONGEST:
        raise HydrostateError(
            f"the iterated smoother holds the whole log in memory: at most {LONGEST:,} samples, got {samples:,}; "
            "take a part of the log, or another method"
        )
    search = _Search(problem)
    at = search.begin()
    if not np.isfinite(at.cost):
        return _diverged_trace(problem)
    at = search.descend(at)
    if problem.robust != "none":
        for _ in range(WEIGHINGS):
            before = search.reweigh(at)
            at = search.descend(before)
            if before.cost - at.cost < SETTLED_DECREASE:
                break
    return _trace_along(search, at)


def _diverged_trace(problem: FilterProblem) -> Trace:
    trace = empty_trace(problem)
    for part in (trace.mean, trace.covariance, trace.track, trace.track_variance, trace.residuals):
        part.fill(np.nan)
    trace.residual_variances.fill(np.nan)
    return trace._replace(log_likelihood=float("nan"))


def _trace_along(search: _Search, at: _Trajectory) -> Trace:
    """Return the trajectory with the covariances and innovations of the filter linearised along it."""
    problem, lines = search.problem, search.lines
    final = search.linearise(at)
    search.kernel.spread_back(lines, problem.every)
    present = np.isfinite(lines.residual)
    squared = np.where(present, lines.residual**2 / lines.variance, 0.0)
    logs = np.where(present, np.log(2.0 * np.pi * lines.variance), 0.0)
    keep = problem.keep_innovations
    return Trace(
        mean=at.states[-1].copy(),
        covariance=final,
        track=at.states[:: problem.every].copy(),
        track_variance=np.diagonal(lines.kept, axis1=1, axis2=2).copy(),
        nis=squared.sum(axis=0),
        count=present.sum(axis=0).astype(np.float64),
        log_likelihood=-0.5 * float(np.sum(squared + logs)),
        residuals=lines.residual if keep else np.empty((0, lines.residual.shape[1])),
        residual_variances=lines.variance if keep else np.empty((0, lines.residual.shape[1])),
    )
