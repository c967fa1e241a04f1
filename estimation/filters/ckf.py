"""The cubature Kalman filter: 2n equally weighted points at ``sqrt(n)`` standard deviations, compiled.

Source: Arasaratnam and Haykin (2009), the third-degree rule and the algorithm of appendix A, with new points for each
channel. It is the scaled transform with alpha 1, beta 0 and kappa 0, and has no settings.
"""

from functools import partial
from math import sqrt

from estimation.engine.rule import Rule
from estimation.engine.runner import run_rule
from estimation.filters.sigma_points import Spread, sigma_predict, sigma_update
from plant.compiled.expression import ZERO, constant


def cubature_spread(n: int) -> Spread:
    """Return the spread of the cubature points (Arasaratnam and Haykin 2009).

    Returns
    -------
    Spread
        Reach ``sqrt(n)``; the shift of the mean has no extra weight.
    """
    return Spread(constant(sqrt(n)), ZERO)


CKF = Rule("ckf", partial(sigma_predict, spread_of=cubature_spread), partial(sigma_update, spread_of=cubature_spread))
ckf = partial(run_rule, CKF)
"""The cubature Kalman filter, as a rule and as a method."""
