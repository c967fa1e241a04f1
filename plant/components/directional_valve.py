"""A 4/3 directional valve with tandem centre: which cylinder side the pump feeds, and which side returns to tank."""

from plant.compiled.functions import Scalar, absolute, sign, sqrt, where
from plant.components.friction import velocity_under_friction

SHUT_OPENING = 1e-5
"""Fraction of a land's opening that remains when the land is covered, because a spool leaks [dimensionless]."""


def fed_pressure(spool: Scalar, side_a: Scalar, side_b: Scalar) -> Scalar:
    """Return the pressure that the pump works against (section 5.1: a 4/3 valve reverses the cylinder).

    Parameters
    ----------
    spool : float or Expression
        1 feeds side A, -1 feeds side B; at 0 the pump runs to tank and the cylinder ports are shut [dimensionless].
    side_a, side_b : float or Expression
        Pressures above the tank's [Pa].

    Returns
    -------
    float or Expression
        Pressure downstream of the feeding land [Pa].

    Examples
    --------
    >>> [float(fed_pressure(spool, 5e4, 1e4)) for spool in (1.0, 0.0, -1.0)]
    [50000.0, 0.0, 10000.0]
    """
    return where(spool > 0.0, side_a, where(spool < 0.0, side_b, 0.0))


def tank_openings(spool: Scalar) -> tuple[Scalar, Scalar]:
    """Return the openings of the lands that connect side A and side B to tank (section 5.1).

    Parameters
    ----------
    spool : float or Expression
        -1, 0 or 1 [dimensionless].

    Returns
    -------
    tuple of float or Expression
        Two openings [dimensionless], `SHUT_OPENING` or 1.

    Examples
    --------
    >>> [float(x) for x in tank_openings(1.0)]
    [1e-05, 1.0]
    """
    return where(spool < 0.0, 1.0, SHUT_OPENING), where(spool > 0.0, 1.0, SHUT_OPENING)


def return_flow(pressure: Scalar, conductance: Scalar) -> Scalar:
    """Return the flow from a side to tank through its land, ``K sqrt(p)``. Source: the law of a sharp-edged orifice.

    Parameters
    ----------
    pressure : float or Expression
        Pressure of the side above the tank's [Pa].
    conductance : float or Expression
        Flow per square root of the pressure [m^3/(s Pa^0.5)].

    Returns
    -------
    float or Expression
        Flow [m^3/s], with the sign of the pressure.

    Examples
    --------
    >>> round(1e6 * float(return_flow(3600.0, 3e-8)), 6)
    1.8
    """
    return sign(pressure) * conductance * sqrt(absolute(pressure))


def pressure_after_return(
    pressure: Scalar, inflow: Scalar, compliance: Scalar, conductance: Scalar, h: Scalar
) -> Scalar:
    """Return a side's pressure after an implicit step of ``C p' = inflow - K sqrt(p)``, which is stiff near zero.

    Source: the implicit Euler rule applied to `return_flow`.

    Parameters
    ----------
    pressure : float or Expression
        Pressure at the start of the step, above the tank's [Pa].
    inflow : float or Expression
        All other flow into the side [m^3/s].
    compliance : float or Expression
        C [m^3/Pa].
    conductance : float or Expression
        K, positive [m^3/(s Pa^0.5)].
    h : float or Expression
        Step [s].

    Returns
    -------
    float or Expression
        Pressure at the end of the step [Pa].

    Examples
    --------
    >>> p = float(pressure_after_return(0.0, 1.8e-6, 4e-13, 3e-8, 1.0))
    >>> round(p, 1)
    3594.3
    """
    root = velocity_under_friction(compliance * pressure / h + inflow, conductance, compliance / h, 0.0)
    return root * absolute(root)
