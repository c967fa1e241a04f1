"""The unscented Kalman filter: scaled sigma points, additive noise, compiled.

Sources: Julier and Uhlmann (2004), the transform; Julier (2002), its scaling; van der Merwe (2004), chapter 3,
the filter with additive noise. Points are drawn anew at every step of the model and before every channel.
"""

from functools import cache, partial

from estimation.algebra import Rule
from estimation.compiled import run_rule
from estimation.filter import FilterProblem, Trace
from estimation.settings import chosen_settings
from estimation.sigma_points import Spread, sigma_predict, sigma_update
from plant.compiled.expression import symbol
from plant.compiled.functions import sqrt
from plant.errors import HydrostateError

UKF_SETTINGS = {"alpha": 1.0, "beta": 2.0, "kappa": 0.0}
"""Spread of the points, weight of the shift, and secondary spread [dimensionless].

The usual alpha of 1e-3 differences the model over a thousandth of a standard deviation; here a belief is often a
millionth of its mean, and that difference would be rounding.
"""


def scaled_spread(n: int) -> Spread:
    """Return the spread of the scaled transform: reach ``alpha sqrt(n + kappa)`` (Julier 2002).

    Parameters
    ----------
    n : int
        Count of states.

    Returns
    -------
    Spread
        In the symbols of the settings.
    """
    alpha, beta, kappa = (symbol(name) for name in UKF_SETTINGS)
    return Spread(alpha * sqrt(n + kappa), beta + alpha * alpha * kappa / n)


@cache
def ukf_rule(robust: str) -> Rule:
    """Return the unscented Kalman filter with outliers counting as wanted.

    Parameters
    ----------
    robust : str
        See `estimation.algebra.inflation`.

    Returns
    -------
    Rule
        The filter.
    """
    name = "ukf" if robust == "none" else f"ukf_{robust.replace('-', '_')}"
    return Rule(
        name,
        partial(sigma_predict, spread_of=scaled_spread),
        partial(sigma_update, spread_of=scaled_spread, robust=robust),
        settings=tuple(UKF_SETTINGS),
    )


def ukf(problem: FilterProblem) -> Trace:
    """Run the compiled unscented Kalman filter.

    Parameters
    ----------
    problem : FilterProblem
        The task; it may set ``alpha``, ``beta`` and ``kappa`` [dimensionless].

    Returns
    -------
    Trace
        Its result.

    Raises
    ------
    HydrostateError
        If a setting is not known, or alpha or n + kappa is not positive.
    """
    settings = chosen_settings(problem, "ukf", UKF_SETTINGS)
    if settings["alpha"] <= 0.0 or settings["kappa"] <= -problem.model.width:
        raise HydrostateError(
            f"ukf needs alpha above 0 and kappa above -{problem.model.width}, "
            f"got alpha {settings['alpha']} and kappa {settings['kappa']}"
        )
    return run_rule(ukf_rule(problem.robust), problem, settings)
