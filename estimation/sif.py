"""The sliding innovation filter, in its extended form, compiled.

Source: Gadsden and Al-Shabi (2020), for linear and, as here, for nonlinear plants: the gain is
``C+ sat(|e| / layer)`` with the innovation e, the covariance that of any gain. How the unmeasured states follow is
said in `estimation.sliding`; prediction is the extended Kalman filter's.
"""

from functools import partial

from estimation.algebra import Rule, predict_expressions
from estimation.compiled import run_rule
from estimation.filter import FilterProblem, Trace
from estimation.settings import chosen_settings
from estimation.sliding import Innovation, sliding_update
from plant.compiled.expression import ONE, Expression, select, symbol, unary
from plant.errors import HydrostateError

SIF_SETTINGS = {"boundary_layer": 100.0}
"""Width of the boundary layer, in standard deviations of the channel's sensor [dimensionless]: the innovation that is
believed whole. Ten follow the noise, ten thousand take seconds to converge."""


def sif_share(innovation: Innovation) -> Expression:
    """Return the share of the innovation by which the filter corrects (Gadsden and Al-Shabi 2020).

    Parameters
    ----------
    innovation : Innovation
        Of one channel.

    Returns
    -------
    Expression
        ``sat(|e| / layer)`` [fraction].
    """
    part = unary("abs", innovation.value) / (symbol("boundary_layer") * unary("sqrt", innovation.noise))
    return select(part > 1.0, ONE, part)


SIF = Rule("sif", predict_expressions, partial(sliding_update, share=sif_share), settings=tuple(SIF_SETTINGS))
"""The sliding innovation filter."""


def sif(problem: FilterProblem) -> Trace:
    """Run the compiled sliding innovation filter.

    Parameters
    ----------
    problem : FilterProblem
        The task; it may set ``boundary_layer`` [dimensionless].

    Returns
    -------
    Trace
        Its result.

    Raises
    ------
    HydrostateError
        If a setting is not known or not positive, or a robust update is asked for.
    """
    settings = chosen_settings(problem, "sif", SIF_SETTINGS)
    if settings["boundary_layer"] <= 0.0:
        raise HydrostateError(f"boundary_layer must be positive, got {settings['boundary_layer']}")
    if problem.robust != "none":
        raise HydrostateError(
            f"sif takes a large innovation for a change of the plant, not for an outlier: robust must be none, "
            f"got {problem.robust!r}"
        )
    return run_rule(SIF, problem, settings)
