"""The cubature Kalman filter: 2n equally weighted points at ``sqrt(n)`` standard deviations, compiled.

Source: Arasaratnam and Haykin (2009), the third-degree rule and the algorithm of appendix A, with the
points of each channel drawn anew. It is the scaled transform with alpha 1, beta 0 and kappa 0, and has nothing to set.
"""

from functools import cache, partial
from math import sqrt

from estimation.algebra import Rule
from estimation.compiled import run_rule
from estimation.filter import FilterProblem, Trace
from estimation.settings import chosen_settings
from estimation.sigma_points import Spread, sigma_predict, sigma_update
from plant.compiled.expression import ZERO, constant


def cubature_spread(n: int) -> Spread:
    """Return the spread of the cubature points (Arasaratnam and Haykin 2009).

    Parameters
    ----------
    n : int
        Count of states.

    Returns
    -------
    Spread
        Reach ``sqrt(n)``; the shift of the mean has no weight of its own.
    """
    return Spread(constant(sqrt(n)), ZERO)


@cache
def ckf_rule(robust: str) -> Rule:
    """Return the cubature Kalman filter with outliers counting as wanted.

    Parameters
    ----------
    robust : str
        See `estimation.algebra.inflation`.

    Returns
    -------
    Rule
        The filter.
    """
    name = "ckf" if robust == "none" else f"ckf_{robust.replace('-', '_')}"
    return Rule(
        name,
        partial(sigma_predict, spread_of=cubature_spread),
        partial(sigma_update, spread_of=cubature_spread, robust=robust),
    )


def ckf(problem: FilterProblem) -> Trace:
    """Run the compiled cubature Kalman filter.

    Parameters
    ----------
    problem : FilterProblem
        The task.

    Returns
    -------
    Trace
        Its result.

    Raises
    ------
    HydrostateError
        If the user set something.
    """
    chosen_settings(problem, "ckf", {})
    return run_rule(ckf_rule(problem.robust), problem)
