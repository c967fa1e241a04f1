"""The smooth variable structure filter with its covariance and optimal boundary layer, compiled.

Sources: Habibi (2007), the gain with the magnitude ``A = |e_k| + gamma |e_k-1|`` of innovation and last a-posteriori
error; Gadsden and Habibi (2010), the covariance; Gadsden and Habibi (2013) and Gadsden (2011), the layer that minimises
it and the resulting combination with the Kalman gain. For one channel at a time the optimal layer is ``A S / (C P
C')``. If it is thinner than the limit, the gain is the optimal one, Kalman's; if it is thicker, the model is outside
its uncertainty and the gain is the robust one, ``A sat(e / limit) / e``. `estimation.filters.sliding_mode` explains how
the unmeasured states follow; prediction is the extended Kalman filter's.
"""

from collections.abc import Sequence
from functools import partial

from estimation.engine.kalman import Outputs, predicted_outputs
from estimation.engine.rule import Rule, Setting, positive
from estimation.engine.runner import run_rule
from estimation.filters.ekf import ekf_predict
from estimation.filters.sliding_mode import Innovation, sliding_update
from estimation.models.model import ProcessModel
from plant.compiled.expression import Expression, select, symbol, unary

SVSF_SETTINGS = (
    Setting("gamma", 0.1, "0 or more and below 1", lambda value, _: 0.0 <= value < 1.0),
    positive("boundary_layer", 100.0),
)
"""Memory of the last a-posteriori error, 0 or more and below 1 (Habibi 2007) [fraction]; limit of the boundary layer,
in standard deviations of the channel's sensor [dimensionless].

A filter that averages thousands of samples has an optimal layer of hundreds of deviations. A limit far below that makes
it follow the noise; a limit far above leaves only Kalman's gain.
"""


def svsf_share(innovation: Innovation) -> Expression:
    """Return the share of the innovation by which the filter corrects (Gadsden and Habibi 2013).

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
    """Return the filter's update by each channel in turn, and the a-posteriori errors for the next update.

    Parameters
    ----------
    channels : sequence of str
        Measured channels, in the order of processing.

    Returns
    -------
    dict[str, Expression]
        New mean, covariance, innovations and their variances, and ``posterior`` of each channel [SI].
    """
    outputs = sliding_update(model, channels, svsf_share)
    mean = [outputs[f"z{i}"] for i in range(model.width)]
    for c, value in enumerate(predicted_outputs(model, mean, channels)):
        y, name = symbol(f"y{c}"), f"posterior{c}"
        outputs[name] = select(unary("present", y), y - value, symbol(name))
    return outputs


SVSF = Rule("svsf", ekf_predict, svsf_update, SVSF_SETTINGS, memory=("posterior",), weighs_outliers=False)
svsf = partial(run_rule, SVSF)
"""The smooth variable structure filter, as a rule and as a method."""
