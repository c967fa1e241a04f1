"""Flows of the pump with its losses and of the relief valve."""

from plant.compiled.functions import Scalar, absolute, maximum, sign


def pumped_flow(speed: Scalar, displacement: Scalar, bias: Scalar) -> Scalar:
    """Return the flow that the pump delivers: the ideal flow minus the flow bias, as a dead zone.

    The paper subtracts ``sign(speed) * bias`` (equation 5.8), which would pump backward if the ideal flow is below the
    bias; a loss cannot exceed the flow (errata E8).

    Parameters
    ----------
    speed : float or Expression
        Motor speed [rad/s].
    displacement : float or Expression
        Pump displacement [m^3/rad].
    bias : float or Expression
        Flow bias Q_b [m^3/s].

    Returns
    -------
    float or Expression
        Effective flow [m^3/s], with the sign of the speed.

    Examples
    --------
    >>> round(float(pumped_flow(125.66, 5.57e-7, 2.413e-6)), 9)
    6.758e-05
    >>> float(pumped_flow(1.0, 5.57e-7, 2.413e-6))
    0.0
    """
    ideal = displacement * speed
    return sign(ideal) * maximum(absolute(ideal) - bias, 0.0)


def relief_flow(pressure: Scalar, setting: Scalar, conductance: Scalar) -> Scalar:
    """Return the flow of the bidirectional relief valve: none below its setting, linear above.

    Source: sections 2 and 3 give the setting, 500 psi; the slope is judged, the paper gives none.

    Parameters
    ----------
    pressure : float or Expression
        Differential pressure [Pa].
    setting : float or Expression
        Pressure at which it opens [Pa].
    conductance : float or Expression
        Flow per pascal above the setting [m^3/(s Pa)].

    Returns
    -------
    float or Expression
        Flow from the high-pressure side to the low-pressure side [m^3/s], with the sign of the pressure.

    Examples
    --------
    >>> float(relief_flow(3.0e6, 3.4475e6, 1e-8))
    0.0
    """
    return sign(pressure) * conductance * maximum(absolute(pressure) - setting, 0.0)
