"""`nudge_for(log, model, free)`: finite-difference step for the slopes of a freed problem."""

from collections.abc import Collection

from estimation.fits.greybox.log import GreyBoxLog
from estimation.models.flow_parameters import is_single
from estimation.models.greybox import GreyBoxModel
from plant.solvers.steps import parameter_names

NUDGE = 1e-4
"""Step in the fitted coordinates [dimensionless]. Residuals of a piston with stick-slip have many small corners: a step
of 1e-7 finds the slope between two of them, and searches stop far from the optimum."""

UNEVEN_NUDGE = 1e-3
"""The same for a single rod [dimensionless]. Its make-up valves open and close all the time. Where the pressures of
both sides cross, a shift by one model step changes the residual by a third of the noise, which a step of 1e-4 took for
slopes ten times too steep. Searches stopped above their minimum, and deviations were up to 100 times too small."""


def nudge_for(log: GreyBoxLog, model: GreyBoxModel, free: Collection[str]) -> float:
    """Return the step of the finite differences.

    Parameters
    ----------
    log : GreyBoxLog
        The log, with the actuator's parameters.
    free : collection of str
        Parameters that are fitted.

    Returns
    -------
    float
        In the fitted coordinates [dimensionless].
    """
    names = parameter_names(model.parameters)
    differ = log.parameters[names.index("area_difference")] if "area_difference" in names else 0.0
    return UNEVEN_NUDGE if is_single(free, differ) else NUDGE
