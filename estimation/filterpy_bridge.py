"""filterpy's extended Kalman filter as a second engine, and as the oracle that ours is held to.

filterpy's filter has no nonlinear process function, and its `predict_update` linearises too early; so the prediction
is overridden here, the Jacobian is set before each `predict`, and one update takes all channels that are present.
"""

import math
from dataclasses import replace
from types import SimpleNamespace

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
        Its result. The joint innovations are given as the sequential ones that they are equal to, channel by channel;
        where a sample is missing, residual and variance are NaN.
    """
    trace = empty_trace(problem)
    H = _observation_matrix(problem)
    lower, upper = (np.array([getattr(s, end) / s.scale for s in problem.model.states]) for end in ("lower", "upper"))
    kalman = _ModelFilter(dim_x=problem.model.width, dim_z=len(problem.channels))
    kalman.x, kalman.P = problem.mean.copy(), problem.covariance.copy()
    kalman.Q = np.diag(problem.noise) * problem.sample_time / problem.substeps
    log_likelihood = 0.0
    for k, y in enumerate(problem.measured):
        if k:
            _predict(kalman, problem, k)
        present = np.isfinite(y)
        residual, variance = np.full_like(y, np.nan), np.full_like(y, np.nan)
        if np.any(present):
            residual[present], variance[present] = _update(kalman, y[present], H[present], problem.variances[present])
            kalman.x = np.clip(kalman.x, lower, upper)
            ratio = residual[present] ** 2 / variance[present]
            trace.nis[present] += ratio
            trace.count[present] += 1.0
            log_likelihood -= 0.5 * float(np.sum(ratio + np.log(2.0 * math.pi * variance[present])))
        if problem.keep_innovations:
            trace.residuals[k], trace.residual_variances[k] = residual, variance
        if k % problem.every == 0:
            trace.track[k // problem.every] = kalman.x
            trace.track_variance[k // problem.every] = np.diag(kalman.P)
    return replace(trace, mean=kalman.x, covariance=kalman.P, log_likelihood=log_likelihood)


def _observation_matrix(problem: FilterProblem) -> Array:
    """Return the matrix of the channels; every model of this project observes linearly."""
    parameters = SimpleNamespace(**dict(zip(PARAMETER_NAMES, problem.parameters, strict=True)))
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


def _update(kalman: _ModelFilter, y: Array, rows: Array, variances: Array) -> tuple[Array, Array]:
    """Update with all channels at once; return what updating with one after the other would have seen.

    Channels are counted in their own standard deviations, since filterpy inverts the innovations' covariance. With
    ``S = L L'``, the sequential innovations are ``diag(L) * solve(L, residual)`` and their variances ``diag(L)**2``.
    """
    unit = np.sqrt(variances)
    H = rows / unit[:, None]
    kalman.update(y / unit, HJacobian=lambda _: H, Hx=lambda x: H @ x, R=np.eye(len(y)))
    root = np.asarray(np.linalg.cholesky(kalman.S), dtype=np.float64)
    size = unit * np.diag(root)
    return size * np.linalg.solve(root, kalman.y), size**2
