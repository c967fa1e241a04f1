"""filterpy's extended Kalman filter as a second engine, and as the reference for this project's filter.

filterpy's filter has no nonlinear process function, and its `predict_update` linearises too early. So the prediction is
overridden here, the Jacobian is set before each `predict`, and one update takes all channels that are present. filterpy
imports scipy.stats, which takes longer than filtering a log, so it is imported only when this filter first runs.
"""

import math
import warnings
from types import SimpleNamespace
from typing import Any

import numpy as np

from estimation.arrays import Array
from estimation.engine.contract import FilterProblem, Trace, empty_trace
from estimation.engine.linearised import compile_step
from estimation.models.model import ProcessModel
from plant.errors import HydrostateError
from plant.solvers.steps import parameter_names


def filterpy_ekf(problem: FilterProblem) -> Trace:
    """Run filterpy's extended Kalman filter on the task, one Python step at a time.

    Returns
    -------
    Trace
        Its result, NaN from the sample at which it diverges. The joint innovations are converted to the equivalent
        sequential ones, channel by channel; if a sample is missing, residual and variance are NaN.

    Raises
    ------
    HydrostateError
        If a robust update is asked for.
    """
    if problem.robust != "none":
        raise HydrostateError(f"filterpy's filter has no robust update, got robust {problem.robust!r}")
    from scipy.linalg import LinAlgWarning

    trace = empty_trace(problem)
    for values in (trace.track, trace.track_variance, trace.residuals, trace.residual_variances):
        values.fill(np.nan)
    H, bounds = _observation_matrix(problem), _bounds(problem.model)
    kalman = _filter(problem)
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore", LinAlgWarning)  # an ill-conditioned covariance stays usable for a long time
        try:
            log_likelihood = sum(
                _filter_sample(kalman, problem, trace, H, bounds, k) for k in range(len(problem.measured))
            )
        except (np.linalg.LinAlgError, ValueError):  # numpy and scipy raise these if the covariance is no longer valid
            lost = np.full_like(problem.mean, np.nan)
            return trace._replace(mean=lost, covariance=np.outer(lost, lost), log_likelihood=math.nan)
    return trace._replace(mean=kalman.x, covariance=kalman.P, log_likelihood=log_likelihood)


def _filter(problem: FilterProblem) -> Any:
    """Return filterpy's filter before the first sample; `_predict` moves its mean, so its own prediction does not."""
    from filterpy.kalman import ExtendedKalmanFilter

    kalman: Any = ExtendedKalmanFilter(dim_x=problem.model.width, dim_z=len(problem.channels))
    kalman.x, kalman.P, kalman.added_variance = problem.mean.copy(), problem.covariance.copy(), problem.added_variance
    kalman.predict_x = lambda u=0: None  # noqa: ARG005  filterpy passes a drive
    return kalman


def _filter_sample(
    kalman: Any, problem: FilterProblem, trace: Trace, H: Array, bounds: tuple[Array, Array], k: int
) -> float:
    """Predict to sample k and update with it; return its log-likelihood."""
    if k:
        _predict(kalman, problem, k)
    log_likelihood = 0.0
    y = problem.measured[k]
    present = np.isfinite(y)
    if np.any(present):
        residual, variance = _update(kalman, y[present], H[present], problem.variances[present])
        kalman.x = np.clip(kalman.x, *bounds)
        ratio = residual**2 / variance
        trace.nis[present] += ratio
        trace.count[present] += 1.0
        log_likelihood = -0.5 * float(np.sum(ratio + np.log(2.0 * math.pi * variance)))
        if problem.keep_innovations:
            trace.residuals[k, present], trace.residual_variances[k, present] = residual, variance
    if k % problem.every == 0:
        trace.track[k // problem.every] = kalman.x
        trace.track_variance[k // problem.every] = np.diag(kalman.P)
    return log_likelihood


def _bounds(model: ProcessModel) -> tuple[Array, Array]:
    lower, upper = zip(*(state.scaled_bounds for state in model.states), strict=True)
    return np.array(lower), np.array(upper)


def _observation_matrix(problem: FilterProblem) -> Array:
    """Return the matrix of the channels; every model of this project observes linearly."""
    parameters = SimpleNamespace(
        **dict(zip(parameter_names(problem.model.parameters), problem.parameters, strict=True))
    )
    rows: list[list[float]] = []
    for channel in problem.channels:
        row: list[float] = []
        for i, state in enumerate(problem.model.states):
            unit = tuple(state.scale if j == i else 0.0 for j in range(problem.model.width))
            row.append(float(problem.model.observe(unit, parameters)[channel]))
        rows.append(row)
    return np.array(rows)


def _predict(kalman: Any, problem: FilterProblem, k: int) -> None:
    step = compile_step(problem.model).step
    h = problem.sample_time / problem.substeps
    kalman.Q = np.diag(problem.noise) * h + np.diag(kalman.added_variance[k]) / problem.substeps
    slope = (problem.drives[k] - problem.drives[k - 1]) / problem.substeps
    for j in range(problem.substeps):
        start = problem.drives[k - 1] + j * slope
        kalman.x, kalman.F = step(kalman.x, start, start + slope, problem.parameters, h)
        kalman.predict()


def _update(kalman: Any, y: Array, rows: Array, variances: Array) -> tuple[Array, Array]:
    """Update with all channels at once; return the innovations that sequential updates would have had.

    Channels are scaled by their standard deviations, since filterpy inverts the innovations' covariance. With ``S = L
    L'``, the sequential innovations are ``diag(L) * solve(L, residual)`` and their variances ``diag(L)**2``.
    """
    unit = np.sqrt(variances)
    H = rows / unit[:, None]
    kalman.update(y / unit, HJacobian=lambda _: H, Hx=lambda x: H @ x, R=np.eye(len(y)))
    root = np.asarray(np.linalg.cholesky(kalman.S), dtype=np.float64)
    size = unit * np.diag(root)
    return size * np.linalg.solve(root, kalman.y), size**2
