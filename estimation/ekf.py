"""The extended Kalman filter: analytic Jacobian, sequential scalar updates, compiled.

Equations: predict and update as in Gadsden (2011), whose notation the EHA paper follows; the measurement noise is
diagonal, so processing one channel at a time equals the joint update and inverts nothing.
"""

from dataclasses import replace

from estimation.filter import FilterProblem, Trace, empty_trace
from estimation.kernels import compile_ekf


def ekf(problem: FilterProblem) -> Trace:
    """Run the compiled extended Kalman filter.

    Parameters
    ----------
    problem : FilterProblem
        The task.

    Returns
    -------
    Trace
        Its result.
    """
    trace = empty_trace(problem)
    run = compile_ekf(problem.model, problem.channels)
    nis, count, log_likelihood = run(
        trace.mean,
        trace.covariance,
        problem.speed,
        problem.measured,
        problem.parameters,
        problem.noise,
        problem.variances,
        problem.sample_time,
        problem.substeps,
        problem.every,
        trace.track,
        trace.track_variance,
        trace.residuals,
        trace.residual_variances,
    )
    return replace(trace, nis=nis, count=count, log_likelihood=log_likelihood)
