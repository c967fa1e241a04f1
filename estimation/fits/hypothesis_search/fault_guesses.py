"""`faulty_coefficient(parameters, name, factor)`: first guesses of leakage, flow bias and friction under a fault.

See decision 311.
"""

import math

from plant.eha.model import EhaParameters
from plant.eha.scales import PAPER_RIG, friction_scales, leakage_scales

WORST_LEAKAGE = 12.5
"""Worst leakage of Table 3 over the healthy one, rounded [dimensionless]."""

FAULTS_TRIED = ((1.0, 1.0), (5.0, 6.0), (WORST_LEAKAGE, 6.0))
"""Leakage and flow bias of the starts, as multiples of the healthy paper rig's: the spread of Table 3."""

LEAST_LEAKAGE = 1e-3
"""Smallest first guess of a leakage, over the rated pump flow [fraction]: a logarithm cannot start at zero."""


def leakage_guess(p: EhaParameters) -> float:
    """Return the first guess of a leakage [m^3/(s Pa)].

    Returns
    -------
    float
        The healthy actuator's, or a small one if it has none.
    """
    return max(p.leakage_coefficient, LEAST_LEAKAGE * p.rated_flow / p.relief_pressure)


def flow_bias_guess(p: EhaParameters) -> float:
    """Return the first guess of a flow bias [m^3/s].

    Returns
    -------
    float
        The healthy actuator's, or a small one if it has none.
    """
    return max(p.flow_bias, LEAST_LEAKAGE * p.rated_flow)


def faulty_coefficient(p: EhaParameters, name: str, healthy: float, factor: float) -> float:
    """Return a faulty coefficient: above the healthy one by as much as in the paper's rig at this multiple.

    A multiple of the healthy value means nothing on another actuator: if a sound one leaks very little, the last row of
    Table 3 is forty times as much, not twelve.

    Parameters
    ----------
    p : EhaParameters
        The healthy actuator.
    name : str
        The coefficient, of leakage or friction.
    healthy : float
        Its value before the fault [SI].
    factor : float
        Multiple of the paper rig's healthy value; 1 for no fault [dimensionless].

    Returns
    -------
    float
        The coefficient [SI].

    Examples
    --------
    >>> round(faulty_coefficient(EhaParameters(), "flow_bias", 2.413e-6, 6.0), 12)
    1.4478e-05
    """
    scales = {**leakage_scales(p), **friction_scales(p)}
    return healthy + (factor - 1.0) * scales[name] * float(getattr(PAPER_RIG, name))


def leakage_range(p: EhaParameters) -> float:
    """Return how far the worst leakage of an actuator is from its healthy one, over the same on the paper's rig.

    What goes with leakage, such as the drain of a worn pump, may be as many deviations from its healthy value on a
    tight actuator as on the paper's.

    Parameters
    ----------
    p : EhaParameters
        The healthy actuator.

    Returns
    -------
    float
        Ratio of the logarithms, 1 or more [dimensionless].

    Examples
    --------
    >>> leakage_range(EhaParameters()), round(leakage_range(EhaParameters(leakage_coefficient=1e-13)), 2)
    (1.0, 2.49)
    """
    worst = (
        math.log(faulty_coefficient(one, "leakage_coefficient", healthy, WORST_LEAKAGE) / healthy)
        for one, healthy in ((p, leakage_guess(p)), (PAPER_RIG, PAPER_RIG.leakage_coefficient))
    )
    return max(next(worst) / next(worst), 1.0)
