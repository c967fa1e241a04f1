"""The sliding innovation filter, in its extended form, compiled.

Source: Gadsden and Al-Shabi (2020), for linear and, as here, for nonlinear plants: the gain is ``C+ sat(|e| / layer)``
with the innovation e; the covariance is that of any gain. `estimation.filters.sliding_mode` explains how the unmeasured
states follow; prediction is the extended Kalman filter's.
"""

from functools import partial

from estimation.engine.rule import Rule, positive
from estimation.engine.runner import run_rule
from estimation.filters.ekf import ekf_predict
from estimation.filters.sliding_mode import Innovation, sliding_update
from plant.compiled.expression import ONE, Expression, select, symbol, unary

SIF_SETTINGS = (positive("boundary_layer", 100.0),)
"""Width of the boundary layer, in standard deviations of the channel's sensor [dimensionless]: an innovation of this
size is applied in full. Ten follow the noise, ten thousand take seconds to converge."""


def sif_share(innovation: Innovation) -> Expression:
    """Return the share of the innovation by which the filter corrects (Gadsden and Al-Shabi 2020).

    Returns
    -------
    Expression
        ``sat(|e| / layer)`` [fraction].
    """
    part = unary("abs", innovation.value) / (symbol("boundary_layer") * unary("sqrt", innovation.noise))
    return select(part > 1.0, ONE, part)


SIF = Rule("sif", ekf_predict, partial(sliding_update, share=sif_share), SIF_SETTINGS, weighs_outliers=False)
sif = partial(run_rule, SIF)
"""The sliding innovation filter, as a rule and as a method."""
