"""`nudge_for(log, model, free)`: step of the finite differences by which a freed problem finds its slopes."""

from collections.abc import Collection

from estimation.fits.greybox.log import GreyBoxLog
from estimation.models.flow_parameters import is_single
from estimation.models.greybox import GreyBoxModel
from plant.solvers.steps import parameter_names

NUDGE = 1e-4
"""Step in the fitted coordinates [dimensionless]. Residuals of a piston that sticks and slips have many small corners:
a step of 1e-7 sees the slope between two of them, and searches stop far from the optimum."""

UNEVEN_NUDGE = 1e-3
"""The same of a single rod [dimensionless]. Its make-up valves open and shut all the time: where the pressures of both
sides cross, one model step earlier or later is a jump of a third of the noise, which a step of 1e-4 took for slopes ten
times as steep as they are. Searches stopped above their minimum, and deviations came out up to 100 times too small."""


def nudge_for(log: GreyBoxLog, model: GreyBoxModel, free: Collection[str]) -> float:
    """Return the step of the finite differences.

    Parameters
    ----------
    log : GreyBoxLog
        The log, with the actuator's parameters.
    model : GreyBoxModel
        The model.
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
