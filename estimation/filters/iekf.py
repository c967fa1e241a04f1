"""The iterated extended Kalman filter: the update linearised again at its own result, compiled.

Source: Bell and Cathey (1993), the iterated update as Gauss-Newton: with the prediction z, its covariance P and the
current point x_i, where ``h`` has the Jacobian ``H_i``::

x_{i+1} = z + P H_i' (H_i P H_i' + R)^-1 (y - h(x_i) - H_i (z - x_i))

A fixed number of passes is unrolled. Only the observation is linearised again: the step of the model is short, and is
treated as in the extended Kalman filter.

Every model of `estimation.models.eha_forms` observes linearly in its states, so the first pass is already final: on
those this filter *is* the extended Kalman filter, to the last bit. It differs if ``observe`` is nonlinear or a measured
state is logarithmic.
"""

from collections.abc import Sequence
from functools import partial

from estimation.engine.kalman import Outputs, belief_symbols, bounded_belief, bounded_mean
from estimation.engine.rule import Rule
from estimation.engine.runner import run_rule
from estimation.filters.ekf import ekf_predict, ekf_update, linearised_update, noise_symbols
from estimation.filters.sigma_points import all_affine
from estimation.models.model import ProcessModel

PASSES = 4
"""Linearisations at each sample: near the result, each Gauss-Newton pass squares the error."""


def iekf_update(model: ProcessModel, channels: Sequence[str], robust: str = "none") -> Outputs:
    """Return the iterated update by all channels; a missing sample (NaN) changes nothing.

    Parameters
    ----------
    channels : sequence of str
        Measured channels, in the order of processing.
    robust : str
        How too large innovations count, see `estimation.engine.robust.inflation`; judged in the first pass.

    Returns
    -------
    dict[str, Expression]
        New value of each mean and covariance symbol, innovations ``e`` and their variances ``s`` of the first pass.
    """
    if all_affine(model, channels):
        return ekf_update(model, channels, robust)
    prior, _ = belief_symbols(model)
    first = linearised_update(model, channels, prior, noise_symbols(channels), robust)
    found = first
    for _ in range(PASSES - 1):
        found = linearised_update(model, channels, bounded_mean(model, found.mean), first.noise)
    return first.seen | bounded_belief(model, found.mean, found.covariance)


IEKF = Rule("iekf", ekf_predict, iekf_update)
iekf = partial(run_rule, IEKF)
"""The iterated extended Kalman filter, as a rule and as a method."""
