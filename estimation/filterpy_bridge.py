"""filterpy's extended Kalman filter as a second engine, and as the oracle that ours is held to.

filterpy's filter has no nonlinear process function, and its `predict_update` linearises too early; so the prediction
is overridden here, the Jacobian is set before each `predict`, and one update takes all channels that are present.
"""

import math
from dataclasses import replace

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter
from numpy.typing import NDArray

from estimation.filter import FilterProblem, Trace, empty_trace
from estimation.kernels import compile_step
from plant.integrate import PARAMETER_NAMES

Array = NDArray[np.float64]


class _ModelFilter(ExtendedKalmanFilter):  # type: ignore[misc]  # filterpy carries no types
    """filterpy's filter with the prediction of the mean taken from outside."""

    moved: Array

    def predict_x(self, u: object = 0) -> None:
        """Set the mean to where the model moved it."""
        del u
        self.x = self.moved


def filterpy_ekf(problem: FilterProblem) -> Trace:
    """Run filterpy's extended Kalman filter on the task, one Python step at a time.

    Parameters
    ----------
    problem : FilterProblem
        The task.

    Returns
    -------
    Trace
        Its result; the residuals are those of the joint update, so their log-likelihood and total NIS equal the
        sequential ones while single channels differ.
    """
    trace = empty_trace(problem)
    width = problem.model.width
    H = _observation_matrix(problem)
    kalman = _ModelFilter(dim_x=width, dim_z=len(problem.channels))
    kalman.x, kalman.P = problem.mean.copy(), problem.covariance.copy()
    kalman.Q = np.diag(problem.noise) * problem.sample_time / problem.substeps
    log_likelihood = 0.0
    for k, y in enumerate(problem.measured):
        if k:
            _predict(kalman, problem, k)
        present = np.isfinite(y)
        if np.any(present):
            log_likelihood += _update(kalman, y, H, present, problem.variances, trace)
        if k % problem.every == 0:
            trace.track[k // problem.every] = kalman.x
            trace.track_variance[k // problem.every] = np.diag(kalman.P)
    return replace(trace, mean=kalman.x, covariance=kalman.P, log_likelihood=log_likelihood)


def _observation_matrix(problem: FilterProblem) -> Array:
    """Return the matrix of the channels; every model of this project observes linearly."""
    parameters = dict(zip(PARAMETER_NAMES, problem.parameters, strict=True))
    rows: list[list[float]] = []
    for channel in problem.channels:
        row: list[float] = []
        for i, state in enumerate(problem.model.states):
            unit = tuple(state.scale if j == i else 0.0 for j in range(problem.model.width))
            row.append(float(problem.model.observe(unit, parameters)[channel]))
        rows.append(row)
    return np.array(rows)


def _predict(kalman: _ModelFilter, problem: FilterProblem, k: int) -> None:
    step = compile_step(problem.model).step
    h = problem.sample_time / problem.substeps
    slope = (problem.speed[k] - problem.speed[k - 1]) / problem.substeps
    for j in range(problem.substeps):
        start = problem.speed[k - 1] + j * slope
        kalman.moved, kalman.F = step(kalman.x, start, start + slope, problem.parameters, h)
        kalman.predict()


def _update(kalman: _ModelFilter, y: Array, H: Array, present: Array, variances: Array, trace: Trace) -> float:
    rows = H[present]
    kalman.update(
        y[present],
        HJacobian=lambda x: rows,
        Hx=lambda x: rows @ x,
        R=np.diag(variances[present]),
    )
    residual, spread = kalman.y, kalman.S
    trace.nis[present] += residual**2 / np.diag(spread)
    trace.count[present] += 1.0
    _, log_determinant = np.linalg.slogdet(2.0 * math.pi * spread)
    return float(-0.5 * (residual @ np.linalg.solve(spread, residual) + log_determinant))
