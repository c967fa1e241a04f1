"""A soft check valve in a port: it opens with a lag over a pressure range, and its liquid has inertia.

Source: judged; the diaphragm-motor paper gives no law for its umbrella valves, errata M22.
"""

from plant.compiled.functions import Scalar, absolute, maximum, minimum
from plant.components.friction import velocity_under_friction


def opening_target(
    drop: Scalar, leak: Scalar, lift: Scalar, cracking_pressure: Scalar, opening_range: Scalar
) -> Scalar:
    """Return the steady-state opening of a flap at a pressure drop (errata M22: the paper gives no valve law).

    Parameters
    ----------
    drop : float, ndarray or Expression
        Upstream pressure minus downstream pressure [Pa].
    leak : float or Expression
        Opening that remains when it is shut [dimensionless]; 1 means stuck open.
    lift : float or Expression
        Opening when wide open [dimensionless]; if it equals the leak, the flap is stuck shut.
    cracking_pressure : float or Expression
        Drop at which it leaves its seat [Pa].
    opening_range : float or Expression
        Further drop at which it is wide open [Pa].

    Returns
    -------
    float, ndarray or Expression
        Fraction of the port's area [dimensionless].

    Examples
    --------
    >>> round(float(opening_target(500.0, 0.002, 1.0, 200.0, 600.0)), 3)
    0.501
    """
    return leak + (lift - leak) * minimum(maximum((drop - cracking_pressure) / opening_range, 0.0), 1.0)


def orifice_drag(opening: Scalar, area: Scalar, coefficient: Scalar, density: Scalar) -> Scalar:
    """Return the pressure drop of an orifice divided by the square of its flow, ``rho / (2 (C_q A s)^2)``.

    Source: the law of a sharp-edged orifice.

    Parameters
    ----------
    opening : float, ndarray or Expression
        Open fraction s of the area [dimensionless], positive.
    area : float or Expression
        Area of the port [m^2].
    coefficient : float or Expression
        Discharge coefficient C_q [dimensionless].
    density : float or Expression
        Density of the liquid [kg/m^3].

    Returns
    -------
    float, ndarray or Expression
        Drag [Pa s^2/m^6].

    Examples
    --------
    >>> round(orifice_drag(1.0, 1.894e-6, 0.65, 998.0) * 1.8e-6**2)
    1067
    """
    passed = coefficient * area * opening
    return 0.5 * density / (passed * passed)


def port_flow_after(
    flow: Scalar, drop: Scalar, drag: Scalar, resistance: Scalar, inertance: Scalar, h: Scalar
) -> Scalar:
    """Return the flow after a step of ``I q' = drop - R q - D q |q|``, stable at any drag.

    The weight of the losses at the end of the step goes from a half if they are slow, which is second order, to one if
    the port is almost shut. So the step is stable even for an almost shut port.

    Parameters
    ----------
    flow : float, ndarray or Expression
        Flow at the step's start [m^3/s].
    drop : float, ndarray or Expression
        Upstream pressure minus downstream pressure at the middle of the step [Pa].
    drag : float, ndarray or Expression
        D, see `orifice_drag` [Pa s^2/m^6].
    resistance : float or Expression
        R [Pa s/m^3].
    inertance : float or Expression
        I [kg/m^4].
    h : float or Expression
        Step [s].

    Returns
    -------
    float, ndarray or Expression
        Flow at the step's end [m^3/s].

    Examples
    --------
    >>> round(6e7 * float(port_flow_after(1e-6, 1e4, 3e14, 6e8, 2.5e6, 5e-6)), 4)
    61.0907
    """
    carried = inertance / h
    lost = drag * absolute(flow)
    late = late_share((resistance + 2.0 * lost) / carried)
    push = carried * flow + drop - (1.0 - late) * (resistance + lost) * flow
    return velocity_under_friction(push, carried + late * resistance, late * drag, 0.0)


def late_share(decay: Scalar) -> Scalar:
    """Return the weight of a loss at the end of a step: 1/2 for slow decay, which is second order; 1 for sudden decay.

    Parameters
    ----------
    decay : float, ndarray or Expression
        Rate of decay times the step [dimensionless], not negative.

    Returns
    -------
    float, ndarray or Expression
        Weight [dimensionless].

    Examples
    --------
    >>> late_share(0.0), round(late_share(1e6), 6)
    (0.5, 0.999999)
    """
    return (1.0 + decay) / (2.0 + decay)
