"""A reed valve: its flow, and the forces of its seat and stop."""

from plant.compiled.functions import Scalar, maximum, sqrt


def reed_flow(
    drop: Scalar, opening: Scalar, perimeter: Scalar, coefficient: Scalar, density: Scalar, laminar_drop: Scalar
) -> Scalar:
    """Return the flow past a reed, equations 14 and 15 of the piezo-stack paper, laminar at small drops (errata P8).

    Oil flows in both directions: it flows back through a reed that has not closed yet.

    Parameters
    ----------
    drop : float or Expression
        Upstream pressure minus downstream pressure [Pa].
    opening : float or Expression
        Lift of the reed [m]; the valve is shut below zero.
    perimeter : float or Expression
        Perimeter w of the opening [m].
    coefficient : float or Expression
        Discharge coefficient c_d [dimensionless].
    density : float or Expression
        Oil density rho [kg/m^3].
    laminar_drop : float or Expression
        Drop eps at which the flow is 0.84 of the orifice's [Pa].

    Returns
    -------
    float or Expression
        Flow [m^3/s].

    Examples
    --------
    >>> round(6e4 * float(reed_flow(1e6, 1e-4, 0.0124, 0.62, 850.0, 1e4)), 3)
    2.237
    """
    area = coefficient * perimeter * maximum(opening, 0.0)
    size = sqrt(drop * drop + laminar_drop * laminar_drop)
    return area * sqrt(2.0 / density) * (drop / size) * sqrt(size)


def contact_force(depth: Scalar, rate: Scalar, stiffness: Scalar, damping: Scalar, soft_depth: Scalar) -> Scalar:
    """Return the restoring force of a seat or stop: a spring, and a damper that increases gradually (errata P7).

    Parameters
    ----------
    depth : float or Expression
        Penetration depth of the contact [m]; no contact below zero.
    rate : float or Expression
        Rate of penetration [m/s].
    stiffness : float or Expression
        Stiffness [N/m].
    damping : float or Expression
        Damping beyond the soft depth [N s/m].
    soft_depth : float or Expression
        Depth over which the damping increases, so that the force does not jump [m].

    Returns
    -------
    float or Expression
        Force, outward positive [N].

    Examples
    --------
    >>> round(float(contact_force(1e-6, 0.0, 2e7, 300.0, 1e-6)), 9)
    20.0
    """
    pressed = maximum(depth, 0.0)
    share = pressed / (pressed + soft_depth)
    return stiffness * pressed + damping * share * rate
