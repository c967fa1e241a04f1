"""Throttles: a sharp-edged orifice, a laminar path in series with one, and an orifice's friction on a piston."""

from plant.compiled.functions import Scalar, absolute, sqrt


def laminar_orifice_flow(drop: Scalar, conductance: Scalar, orifice: Scalar) -> Scalar:
    """Return the flow through a laminar path in series with an orifice.

    The pressure drop is ``flow / conductance`` across the path and ``(flow / orifice)^2`` across the orifice; the sum
    is solved for the flow. The laminar path dominates at small drops, the orifice at large ones. Source: Table 3's
    flows are linear in pressure, section 3 gives the valve's rated flow; equation 5.7.

    Parameters
    ----------
    drop : float or Expression
        Upstream pressure minus downstream pressure [Pa].
    conductance : float or Expression
        Laminar flow per pascal [m^3/(s Pa)], not negative.
    orifice : float or Expression
        Orifice flow per square root of its pressure drop [m^3/(s Pa^0.5)], positive.

    Returns
    -------
    float or Expression
        Flow [m^3/s], with the sign of the drop.

    Examples
    --------
    >>> flow = float(laminar_orifice_flow(1e6, 1e-8, 3e-6))
    >>> round(flow / 1e-8 + (flow / 3e-6) ** 2, 6)
    1000000.0
    """
    ratio = conductance / orifice
    return 2.0 * conductance * drop / (1.0 + sqrt(1.0 + 4.0 * ratio * ratio * absolute(drop)))


def orifice_constant(flow: Scalar, drop: Scalar) -> Scalar:
    """Return an orifice's flow per square root of its pressure drop, from one rated point.

    Source: the law of a sharp-edged orifice, the paper's reference 2.

    Parameters
    ----------
    flow : float or Expression
        Rated flow [m^3/s].
    drop : float or Expression
        Pressure drop at the rated flow [Pa].

    Returns
    -------
    float or Expression
        ``C_d A_o sqrt(2 / rho)`` [m^3/(s Pa^0.5)].

    Examples
    --------
    >>> float(orifice_constant(2e-3, 1e6))
    2e-06
    """
    return flow / sqrt(drop)


def orifice_friction(density: Scalar, piston_area: Scalar, effective_area: Scalar) -> Scalar:
    """Return the quadratic friction that an orifice between the chambers of a coupled cylinder adds.

    The piston pushes the flow ``A v`` through the orifice, whose pressure drop ``rho (A v / (C_d A_o))^2 / 2`` acts on
    the area A: the increment of a_1 in equation 5.10 is ``rho A^3 / (2 (C_d A_o)^2)``.

    Parameters
    ----------
    density : float or Expression
        Oil density rho [kg/m^3].
    piston_area : float or Expression
        Area A of the coupled piston [m^2].
    effective_area : float or Expression
        Discharge coefficient times area of the orifice, C_d A_o [m^2].

    Returns
    -------
    float or Expression
        Coefficient a_1 [N s^2/m^2].

    Examples
    --------
    >>> round(orifice_friction(860.0, 1.52e-3, 1e-6))
    1510077
    """
    return density * piston_area**3 / (2.0 * effective_area**2)


def effective_area(density: Scalar, piston_area: Scalar, friction: Scalar) -> Scalar:
    """Return the effective area of the orifice that adds a given quadratic friction: the inverse of `orifice_friction`.

    Parameters
    ----------
    density : float or Expression
        Oil density rho [kg/m^3].
    piston_area : float or Expression
        Area A of the coupled piston [m^2].
    friction : float or Expression
        Coefficient a_1 of equation 5.10 that it adds [N s^2/m^2], positive.

    Returns
    -------
    float or Expression
        Effective area C_d A_o [m^2].
    """
    return sqrt(density * piston_area**3 / (2.0 * friction))
