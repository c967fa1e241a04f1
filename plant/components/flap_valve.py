"""A soft check valve in a port: it opens with a lag over a band of pressure, and its liquid has inertia.

Source: judged; the diaphragm-motor paper gives no law of its umbrella valves, errata M22.
"""

from plant.compiled.functions import Scalar, maximum, minimum
from plant.components.cylinder import velocity_under_friction


def opening_target(
    drop: Scalar, leak: Scalar, lift: Scalar, cracking_pressure: Scalar, opening_range: Scalar
) -> Scalar:
    """Return how far a flap would stand open if the pressure drop lasted (errata M22: the paper gives no valve law).

    Parameters
    ----------
    drop : float, ndarray or Expression
        Pressure before less pressure behind [Pa].
    leak : float or Expression
        Opening that remains when it is shut [dimensionless]; 1 is stuck open.
    lift : float or Expression
        Opening when wide open [dimensionless]; as small as the leak is stuck shut.
    cracking_pressure : float or Expression
        Drop at which it leaves its seat [Pa].
    opening_range : float or Expression
        Further drop at which it is wide open [Pa].

    Returns
    -------
    float, ndarray or Expression
        Share of the port's area [dimensionless].

    Examples
    --------
    >>> round(float(opening_target(500.0, 0.002, 1.0, 200.0, 600.0)), 3)
    0.501
    """
    return leak + (lift - leak) * minimum(maximum((drop - cracking_pressure) / opening_range, 0.0), 1.0)


def orifice_drag(opening: Scalar, area: Scalar, coefficient: Scalar, density: Scalar) -> Scalar:
    """Return the pressure that an orifice takes over the square of its flow, ``rho / (2 (C_q A s)^2)``.

    Source: the law of a sharp-edged orifice.

    Parameters
    ----------
    opening : float, ndarray or Expression
        Share of the area that stands open s [dimensionless], positive.
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
    """Return the flow after an implicit step of ``I q' = drop - R q - D q |q|``: no port is too tight for it.

    Parameters
    ----------
    flow : float, ndarray or Expression
        Flow at the step's start [m^3/s].
    drop : float, ndarray or Expression
        Pressure before less pressure behind [Pa].
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
    >>> q = float(port_flow_after(1e-6, 1e4, 3e14, 6e8, 2.5e6, 5e-6))
    >>> round(2.5e6 * (q - 1e-6) / 5e-6 + 6e8 * q + 3e14 * q * q, 6)
    10000.0
    """
    carried = inertance / h
    return velocity_under_friction(carried * flow + drop, carried + resistance, drag, 0.0)
