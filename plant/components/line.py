"""A short hydraulic line: inertance, laminar resistance and minor losses."""

from plant.compiled.functions import Scalar, absolute

PI = 3.141592653589793


def line_flow_rate(
    drop: Scalar, flow: Scalar, length: Scalar, area: Scalar, density: Scalar, viscosity: Scalar, minor_losses: Scalar
) -> Scalar:
    """Return the rate of a line's flow, equations 17 and 19 to 21 of the piezo-stack paper (errata P10, P12).

    Parameters
    ----------
    drop : float or Expression
        Inlet pressure minus outlet pressure [Pa].
    flow : float or Expression
        Flow [m^3/s].
    length : float or Expression
        Length [m].
    area : float or Expression
        Cross-section A_t [m^2].
    density : float or Expression
        Oil density [kg/m^3].
    viscosity : float or Expression
        Dynamic viscosity [Pa s].
    minor_losses : float or Expression
        Sum of the loss coefficients xi [dimensionless].

    Returns
    -------
    float or Expression
        Rate of change of the flow [m^3/s^2].

    Examples
    --------
    >>> round(line_flow_rate(1e5, 0.0, 0.462, 3.85e-5, 850.0, 0.02, 2.3), 4)
    0.0098
    """
    inertance = density * length / area
    resistance = 8.0 * PI * viscosity * length / (area * area)
    minor = 0.5 * density * minor_losses / (area * area) * flow * absolute(flow)
    return (drop - resistance * flow - minor) / inertance


def reynolds_number(flow: Scalar, area: Scalar, density: Scalar, viscosity: Scalar) -> Scalar:
    """Return the Reynolds number of a flow in a round line, equation 16 of the piezo-stack paper (errata P9).

    Parameters
    ----------
    flow : float, ndarray or Expression
        Flow [m^3/s].
    area : float
        Cross-section A_t [m^2].
    density : float
        Oil density [kg/m^3].
    viscosity : float
        Dynamic viscosity [Pa s].

    Returns
    -------
    float, ndarray or Expression
        ``rho v D / mu`` [dimensionless].

    Examples
    --------
    >>> round(reynolds_number(2.67e-5, 3.85e-5, 850.0, 0.0207))
    199
    """
    diameter = (4.0 * area / PI) ** 0.5
    return density * absolute(flow) / area * diameter / viscosity
