"""A linear fit of one input as a `LinearModel`: units of the channels, both covariances, offset and initial state."""

from dataclasses import replace

import numpy as np

from estimation.arrays import Array
from estimation.identification.fit.covariances import Spread, spread_of_fit
from estimation.identification.fit.validate import estimate_initial_state
from estimation.identification.free_run.data import Channels, Scaling
from estimation.identification.free_run.linear_dynamics import LinearDynamics
from estimation.identification.free_run.linear_problem import LinearFit, Problem
from estimation.identification.model.linear_model import LinearModel
from estimation.identification.search.experiments import Experiments, data_hash


def linear_model(fit: LinearFit, data: Channels, by: Scaling) -> LinearModel:
    """Return a fit of one input with its covariance, the robust one if the residual is not white.

    Parameters
    ----------
    data : Channels
        Scaled.
    by : Scaling
        The scaling.
    """
    form, problem = fit.form, Problem(fit.form, data)
    output, residual, found_spread = _residual_and_spread(fit, problem)
    used = problem.used
    n_main, gain = form.n_b + form.order, by.y_std / float(by.u_std[0])
    unscale = np.concatenate([np.full(form.n_b, gain), np.ones(form.order)])
    white, robust, taken = (
        one[:n_main, :n_main] * np.outer(unscale, unscale)
        for one in (found_spread.white, found_spread.robust, found_spread.taken)
    )
    b = fit.theta[: form.n_b] * gain
    level = by.y_mean + by.y_std * float(fit.theta[n_main])
    rss, n_used = float(residual @ residual) * by.y_std**2, int(np.count_nonzero(used))
    spread = np.concatenate(data.y)[used]
    deviation = float(np.sum((spread - spread.mean()) ** 2)) * by.y_std**2
    found = LinearModel(
        numerator=np.concatenate([np.zeros(form.delays[0]), b]),
        denominator=fit.f,
        sample_time=data.sample_time,
        input_name=data.inputs[0],
        output_name=data.output,
        delay=form.delays[0],
        covariance=taken,
        covariance_white=white,
        covariance_robust=robust,
        fit_percent=100.0 * (1.0 - float(np.sqrt(rss / deviation))),
        rmse=float(np.sqrt(rss / n_used)),
        residual_std=float(np.sqrt(rss / max(n_used - fit.theta.size, 1))),
        n_samples=n_used,
        data_hash=data_hash(_experiments(data, problem), data.sample_time),
        structure="output-error",
        offset=level - float(b.sum() / fit.f.sum()) * float(by.u_mean[0]),
    )
    return _with_initial_state(found, output[: data.y[0].size] * by.y_std + by.y_mean, data.u[0][:, 0], by)


def gain_deviations(fit: LinearFit, data: Channels, by: Scaling) -> tuple[float, ...]:
    """Return the standard deviation of the steady gain from each input, robust if the residual is not white.

    Parameters
    ----------
    data : Channels
        Scaled.
    by : Scaling
        The scaling.

    Returns
    -------
    tuple of float
        One per input [output unit / input unit].
    """
    n_main = fit.form.n_b + fit.form.order
    spread = _residual_and_spread(fit, Problem(fit.form, data))[2].taken[:n_main, :n_main]
    slopes = LinearDynamics.of(fit).gain_slopes()
    variances = np.einsum("ij,jk,ik->i", slopes, spread, slopes)
    return tuple((np.sqrt(variances) * by.y_std / by.u_std).tolist())


def _residual_and_spread(fit: LinearFit, problem: Problem) -> tuple[Array, Array, Spread]:
    """Return output, residual, and the covariances of all values."""
    output, jacobian = problem.jacobian(fit.theta)
    residual = np.where(problem.used, problem.y - output, 0.0)
    return output, residual, spread_of_fit(jacobian, residual, problem.used, problem.bounds.astype(np.int64))


def _with_initial_state(model: LinearModel, simulated: Array, u: Array, by: Scaling) -> LinearModel:
    inputs = by.u_mean[0] + by.u_std[0] * u
    return replace(model, initial_state=estimate_initial_state(model, inputs, simulated))


def _experiments(data: Channels, problem: Problem) -> Experiments:
    u = np.concatenate([one[:, 0] for one in data.u])
    return Experiments(u, np.where(problem.used, problem.y, 0.0), problem.used, problem.bounds.astype(np.int64))
