"""The extended Kalman filter: analytic Jacobian, sequential scalar updates, compiled.

Equations: predict and update as in Gadsden (2011), whose notation the EHA paper follows; the measurement noise is
diagonal, so processing one channel at a time equals the joint update and inverts nothing.
"""

from functools import cache, partial

from estimation.algebra import EKF, Rule, predict_expressions, update_expressions
from estimation.compiled import run_rule
from estimation.filter import FilterProblem, Trace


@cache
def ekf_rule(robust: str) -> Rule:
    """Return the extended Kalman filter with outliers counting as wanted.

    Parameters
    ----------
    robust : str
        See `estimation.algebra.inflation`.

    Returns
    -------
    Rule
        The filter.
    """
    if robust == "none":
        return EKF
    return Rule(f"ekf_{robust.replace('-', '_')}", predict_expressions, partial(update_expressions, robust=robust))


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
    return run_rule(ekf_rule(problem.robust), problem)
