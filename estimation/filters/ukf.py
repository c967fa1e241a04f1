"""The unscented Kalman filter: scaled sigma points, additive noise, compiled.

Sources: Julier and Uhlmann (2004), the transform; Julier (2002), its scaling; van der Merwe (2004), chapter 3, the
filter with additive noise. New points are drawn at every step of the model and before every channel.
"""

from functools import partial
from math import isfinite

from estimation.engine.rule import Rule, Setting, positive
from estimation.engine.runner import run_rule
from estimation.filters.sigma_points import Spread, sigma_predict, sigma_update
from plant.compiled.expression import symbol
from plant.compiled.functions import sqrt

UKF_SETTINGS = (
    positive("alpha", 1.0),
    Setting("beta", 2.0, "a number", lambda value, _: isfinite(value)),
    Setting("kappa", 0.0, "above -{n}", lambda value, n: value > -n),
)
"""Spread of the points, weight of the shift, and secondary spread [dimensionless].

The usual alpha of 1e-3 takes differences of the model over a thousandth of a standard deviation. Here a standard
deviation is often a millionth of the mean, and that difference would be rounding.
"""


def scaled_spread(n: int) -> Spread:
    """Return the spread of the scaled transform: reach ``alpha sqrt(n + kappa)`` (Julier 2002)."""
    alpha, beta, kappa = (symbol(name) for name in ("alpha", "beta", "kappa"))
    return Spread(alpha * sqrt(n + kappa), beta + alpha * alpha * kappa / n)


UKF = Rule(
    "ukf",
    partial(sigma_predict, spread_of=scaled_spread),
    partial(sigma_update, spread_of=scaled_spread),
    UKF_SETTINGS,
)
ukf = partial(run_rule, UKF)
"""The unscented Kalman filter, as a rule and as a method."""
