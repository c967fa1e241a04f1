"""`faulty_coefficient(parameters, name, factor)`: first guesses of leakage, flow bias and friction under a fault.

See decision 311.
"""

from plant.eha.model import EhaParameters
from plant.eha.scales import PAPER_RIG, friction_scales, leakage_scales

FAULTS_TRIED = ((1.0, 1.0), (5.0, 6.0), (12.5, 6.0))
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
