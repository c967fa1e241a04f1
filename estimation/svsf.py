"""The smooth variable structure filter with its covariance and optimal boundary layer, compiled.

Sources: Habibi (2007), the gain with the magnitude ``A = |e_k| + gamma |e_k-1|`` of innovation and
last a-posteriori error; Gadsden and Habibi (2010), the covariance; Gadsden and Habibi (2013) and Gadsden
(2011), the layer that minimises it and the filter that it makes with the Kalman gain. For one channel at a
time the optimal layer is ``A S / (C P C')``. Where it is thinner than the limit, the gain is the optimal one, Kalman's;
where it is thicker, the model has left its uncertainty and the gain is the robust one, ``A sat(e / limit) / e``. How
the unmeasured states follow is said in `estimation.sliding`; prediction is the extended Kalman filter's.
"""

from collections.abc import Sequence

from estimation.algebra import Outputs, Rule, observed, predict_expressions
from estimation.compiled import run_rule
from estimation.filter import FilterProblem, Trace
from estimation.model import ProcessModel
from estimation.settings import chosen_settings
from estimation.sliding import Innovation, sliding_update
from plant.compiled.expression import Expression, select, symbol, unary
from plant.errors import HydrostateError

SVSF_SETTINGS = {"gamma": 0.1, "boundary_layer": 100.0}
"""Memory of the last a-posteriori error, 0 or more and below 1 (Habibi 2007) [fraction]; limit of the boundary layer,
in standard deviations of the channel's sensor [dimensionless].

A filter that averages thousands of samples has an optimal layer of hundreds of deviations; a limit far below that
makes it follow the noise, one far above leaves Kalman's gain alone.
"""


def svsf_share(innovation: Innovation) -> Expression:
    """Return the share of the innovation by which the filter corrects (Gadsden and Habibi 2013).

    Parameters
    ----------
    innovation : Innovation
        Of one channel.

    Returns
    -------
    Expression
        ``C P C' / S`` within the limit, ``A sat(e / limit) / e`` beyond it [fraction].
    """
    size = unary("abs", innovation.value)
    magnitude = size + symbol("gamma") * unary("abs", symbol(f"posterior{innovation.channel}"))
    optimal = innovation.spread / innovation.variance
    limit = symbol("boundary_layer") * unary("sqrt", innovation.noise)
    robust = select(size < limit, magnitude / limit, magnitude / size)
    return select(magnitude > limit * optimal, robust, optimal)


def svsf_update(model: ProcessModel, channels: Sequence[str]) -> Outputs:
    """Return the filter's update by each channel in turn, and the a-posteriori errors that the next one reads.

    Parameters
    ----------
    model : ProcessModel
        The model.
    channels : sequence of str
        Measured channels, in the order of processing.

    Returns
    -------
    dict[str, Expression]
        New mean, covariance, innovations and their variances, and ``posterior`` of each channel [SI].
    """
    outputs = sliding_update(model, channels, svsf_share)
    mean = [outputs[f"z{i}"] for i in range(model.width)]
    for c, value in enumerate(observed(model, mean, channels)):
        y, name = symbol(f"y{c}"), f"posterior{c}"
        outputs[name] = select(unary("present", y), y - value, symbol(name))
    return outputs


SVSF = Rule("svsf", predict_expressions, svsf_update, settings=tuple(SVSF_SETTINGS), memory=("posterior",))
"""The smooth variable structure filter."""


def svsf(problem: FilterProblem) -> Trace:
    """Run the compiled smooth variable structure filter.

    Parameters
    ----------
    problem : FilterProblem
        The task; it may set ``gamma`` [fraction] and ``boundary_layer`` [dimensionless].

    Returns
    -------
    Trace
        Its result.

    Raises
    ------
    HydrostateError
        If a setting is not known or out of its range, or a robust update is asked for.
    """
    settings = chosen_settings(problem, "svsf", SVSF_SETTINGS)
    if not 0.0 <= settings["gamma"] < 1.0:
        raise HydrostateError(f"gamma must be 0 or more and below 1, got {settings['gamma']}")
    if settings["boundary_layer"] <= 0.0:
        raise HydrostateError(f"boundary_layer must be positive, got {settings['boundary_layer']}")
    if problem.robust != "none":
        raise HydrostateError(
            f"svsf takes a large innovation for a change of the plant, not for an outlier: robust must be none, "
            f"got {problem.robust!r}"
        )
    return run_rule(SVSF, problem, settings)
