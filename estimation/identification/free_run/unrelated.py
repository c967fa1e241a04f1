"""Whether inputs explain an output at all, or a slow model follows it without them.

A pole slower than a held-back block follows a ramp or a slow oscillation by its initial state alone, and integrates any
input to a wandering curve that looks like another. Blocks do not reveal it, since the outputs on both sides determine
the run, and neither does an information criterion, which counts samples as if the residual were white (spurious
regression, Granger and Newbold 1974). The same inputs in other orders have no such relation to the output: they explain
as much of it as chance does.
"""

from collections.abc import Callable

from estimation.identification.free_run.choose_polynomial import PolynomialCandidate
from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.hammerstein_fit import HammersteinFit, refitted_hammerstein
from estimation.identification.free_run.integrating import refitted_linear
from estimation.identification.free_run.linear_problem import LinearFit
from estimation.identification.free_run.other_orders import reordered_channels

OTHER_ORDERS = 19
"""Number of other orders of the inputs: one given in advance beats them all by chance in 5 % of unrelated logs."""

LEAST_ERROR_RATIO = 1.1
"""Least ratio of the error with another order of the inputs to that with the right one, if the model has a pole at 1:
such a model has a ramp of its own, and beside it an unrelated input wins by a few percent at times (judged)."""


def explains(cost: float, refit: Callable[[Channels], float], data: Channels) -> bool:
    """Return whether inputs explain the output better than the same inputs in any other order.

    Parameters
    ----------
    cost : float
        Sum of squared residuals with the inputs as measured [dimensionless].
    refit : callable
        From other data to the sum of squared residuals of a fit to them, infinite without a fit [dimensionless].
    data : Channels
        Scaled.

    Examples
    --------
    >>> import numpy as np
    >>> from estimation.identification.free_run.data import channels_from
    >>> data = channels_from([np.arange(40.0)[:, None]], [np.arange(40.0)], 0.1, ["u"], "y")
    >>> explains(1.0, lambda _: 2.0, data), explains(2.0, lambda _: 1.0, data)
    (True, False)
    """
    return all(refit(other) > cost for other in reordered_channels(data, OTHER_ORDERS))


def linear_explains(fit: LinearFit, data: Channels) -> bool:
    """Return whether inputs explain the output by a linear model, whose poles are fitted again to each order of them.

    Parameters
    ----------
    fit : LinearFit
        Of these data.
    data : Channels
        Scaled.
    """
    own = LEAST_ERROR_RATIO * fit.cost if fit.integrates else fit.cost
    return explains(own, lambda other: refitted_linear(fit, other).cost, data)


def bend_explains(fit: HammersteinFit, data: Channels) -> bool:
    """Return whether the input explains the output by a model with a nonlinearity at its input.

    Parameters
    ----------
    fit : HammersteinFit
        Of these data.
    data : Channels
        Scaled.
    """
    return explains(fit.cost, lambda other: refitted_hammerstein(fit, other).cost, data)


def polynomial_explains(found: PolynomialCandidate, data: Channels) -> bool:
    """Return whether inputs explain the output by a polynomial model.

    Parameters
    ----------
    found : PolynomialCandidate
        Fitted to these data.
    data : Channels
        Scaled.
    """

    def cost(other: Channels) -> float:
        fit = found.refit(other)
        return float("inf") if fit is None else fit.cost

    return explains(found.fit.cost, cost, data)
