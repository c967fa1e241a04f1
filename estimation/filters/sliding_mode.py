"""Common parts of the sliding-mode filters: an update by a share of the innovation, with a valid covariance.

The published gains invert the observation matrix, ``K = C+ diag(share)``: this needs all states measured, or uses the
Moore-Penrose inverse, by which an unmeasured state never moves. Neither is useful here, where acceleration or pressure
and bulk modulus are unmeasured. The reduced form of Habibi (2007) divides by the coupling of unmeasured to measured
states, which vanishes at rest. As in the filters combined with the Kalman filter's covariance (Gadsden 2011; Gadsden,
Habibi and Kirubarajan 2014) the belief is available, and so the inverse is weighted by it::

C+ = P C' (C P C')^-1, K = P C' (C P C')^-1 share

An unmeasured state moves by its regression on the measured ones, and with the share ``C P C' / S`` the gain is
Kalman's. The covariance is that of any gain (Gadsden and Habibi 2010): ``(I - K C) P (I - K C)' + K R K'``.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from estimation.engine.kalman import (
    Outputs,
    belief_symbols,
    bounded_belief,
    channel_projection,
    corrected_belief,
    predicted_outputs,
    total,
)
from estimation.models.model import ProcessModel
from plant.compiled.expression import ONE, ZERO, Expression, jacobian, select, symbol, unary


@dataclass(frozen=True)
class Innovation:
    """Innovation of one channel in a sliding-mode filter, with its variances.

    Parameters
    ----------
    value : Expression
        Measured minus predicted [SI].
    noise : Expression
        The sensor's variance [SI squared].
    spread : Expression
        Variance of the prediction, ``C P C'`` [SI squared].
    """

    channel: int
    value: Expression
    noise: Expression
    spread: Expression

    @property
    def variance(self) -> Expression:
        """Variance of the innovation, ``S = C P C' + R`` [SI squared]."""
        return self.spread + self.noise


Share: TypeAlias = Callable[[Innovation], Expression]
"""Share of its innovation by which a prediction is corrected [fraction]."""


def sliding_update(model: ProcessModel, channels: Sequence[str], share: Share) -> Outputs:
    """Return the update by each channel in turn; a missing sample (NaN) changes nothing.

    Parameters
    ----------
    channels : sequence of str
        Measured channels, in the order of processing.

    Returns
    -------
    dict[str, Expression]
        New value of each mean and covariance symbol, innovations ``e`` and their variances ``s``.
    """
    prior, covariance = belief_symbols(model)
    n, mean, outputs = model.width, list(prior), Outputs()
    predicted = predicted_outputs(model, prior, channels)
    for c, H in enumerate(jacobian(predicted, prior)):
        y = symbol(f"y{c}")
        present = unary("present", y)
        residual = y - (predicted[c] + total([H[i] * (mean[i] - prior[i]) for i in range(n)]))
        PH, spread = channel_projection(covariance, H)
        innovation = Innovation(c, residual, symbol(f"r{c}"), spread)
        inverse = select(innovation.spread > 0.0, ONE / innovation.spread, ZERO)
        part = select(present, share(innovation), ZERO)
        step = select(present, residual, ZERO) * part * inverse
        # the covariance update for any gain, multiplied out for K = P C' (C P C')^-1 part
        loss = (2.0 * part - part * part * innovation.variance * inverse) * inverse
        mean, covariance = corrected_belief(mean, covariance, PH, step, loss)
        outputs |= {f"e{c}": residual, f"s{c}": innovation.variance}
    return outputs | bounded_belief(model, mean, covariance)
