"""A piezo diaphragm on its chamber: chamber compliance and centre deflection."""

from plant.compiled.functions import Scalar, exp, log


def chamber_compliance(
    pressure: Scalar, diaphragm: Scalar, liquid: Scalar, gas: Scalar, exponent: Scalar, rest_pressure: Scalar
) -> Scalar:
    """Return the compliance of a chamber: diaphragm, liquid and entrapped gas in parallel.

    The gas follows ``p V^n = const``, so its compliance is ``V/n (p0/p)^(1/n) / p``. Source: the paper gives none; the
    diaphragm-motor paper's equation 1 with errata M1 takes the diaphragm alone, errata M22.

    Parameters
    ----------
    pressure : float, ndarray or Expression
        Absolute pressure of the chamber [Pa], positive.
    diaphragm : float or Expression
        Compliance of the diaphragm C_d [m^3/Pa].
    liquid : float or Expression
        Compliance of the liquid, volume over bulk modulus [m^3/Pa].
    gas : float or Expression
        Gas volume at the rest pressure [m^3], not negative.
    exponent : float or Expression
        Polytropic exponent n [dimensionless].
    rest_pressure : float or Expression
        Absolute pressure at which the gas has the given volume [Pa].

    Returns
    -------
    float, ndarray or Expression
        Compliance [m^3/Pa].

    Examples
    --------
    >>> round(1e13 * float(chamber_compliance(1.5e5, 1.174e-13, 3.079e-16, 3.079e-10, 1.2, 1.5e5)), 3)
    1.194
    """
    return diaphragm + liquid + gas / exponent * exp(log(rest_pressure / pressure) / exponent) / pressure


def centre_deflection(
    voltage: Scalar, pressure: Scalar, deflection_a_volt: Scalar, deflection_a_pascal: Scalar
) -> Scalar:
    """Return the deflection of a diaphragm's centre due to voltage and pressure (equation 16, errata M16).

    Parameters
    ----------
    voltage : float, ndarray or Expression
        Voltage minus its hysteresis [V].
    pressure : float, ndarray or Expression
        Chamber pressure above the outside pressure [Pa].
    deflection_a_volt : float
        w_V [m/V].
    deflection_a_pascal : float
        w_p [m/Pa].

    Returns
    -------
    float, ndarray or Expression
        Deflection [m].

    Examples
    --------
    >>> round(1e6 * centre_deflection(100.0, 1e4, 8.38e-8, 5.193e-10), 3)
    3.187
    """
    return deflection_a_volt * voltage - deflection_a_pascal * pressure
