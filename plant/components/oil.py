"""Oil with entrained air, and with vapour if there is too little oil: one closed-form equation of state.

The *amount* of oil is its mass, given as its volume at atmospheric pressure [m^3]. A chamber of volume V with the
amount n is filled by liquid, which shrinks linearly with pressure, and by air, which shrinks as 1/p (isothermal)::

    V/n = (1 - air) (1 - (p - p_a)/beta) + air (p_a - p_v)/(p - p_v)

Its stiffness is equation 5 of the piezo-stack paper with n = 1 (errata P5) to first order in the air fraction. Vapour
fills the remaining volume, so the pressure never falls below the vapour pressure p_v.
"""

from plant.compiled.functions import Scalar, absolute, sqrt, where

ATMOSPHERE = 101_325.0
"""Pressure at which the air fraction is stated [Pa], equation 6 of the piezo-stack paper."""

NUCLEI = 1e-9
"""Air fraction of oil without free air: bubble nuclei, which smooth the onset of vapour over about 100 Pa."""


def oil_pressure(
    amount: Scalar, volume: Scalar, bulk_modulus: Scalar, air_fraction: Scalar, vapour_pressure: Scalar
) -> Scalar:
    """Return the absolute pressure of a positive amount of oil in a volume; it always exceeds the vapour pressure.

    Parameters
    ----------
    amount : float or Expression
        Oil, as its volume at atmospheric pressure [m^3], positive.
    volume : float or Expression
        Volume of the chamber [m^3], positive.
    bulk_modulus : float or Expression
        Bulk modulus beta of the oil without air [Pa].
    air_fraction : float or Expression
        Volume of air over the volume of oil and air, at atmospheric pressure [dimensionless].
    vapour_pressure : float or Expression
        Vapour pressure p_v [Pa].

    Returns
    -------
    float or Expression
        Pressure [Pa].

    Examples
    --------
    >>> round(float(oil_pressure(1.001, 1.0, 2.07e8, 0.0, 2e3)))
    308118
    >>> round(float(oil_pressure(0.9, 1.0, 2.07e8, 0.0, 2e3)), 1)
    2000.0
    """
    air = air_fraction + NUCLEI
    gas = air * (ATMOSPHERE - vapour_pressure)
    softness = (1.0 - air) / bulk_modulus
    squeezed = (1.0 - air) + softness * (ATMOSPHERE - vapour_pressure) - volume / amount
    return vapour_pressure + root_above_zero(softness, squeezed, gas)


def root_above_zero(softness: Scalar, squeezed: Scalar, gas: Scalar) -> Scalar:
    """Return the pressure above the vapour pressure at which ``softness p^2 - squeezed p = gas``, without cancellation.

    Parameters
    ----------
    softness : float or Expression
        Decrease of the oil's volume plus increase of the walls' volume per pascal [unit of volume/Pa], positive.
    squeezed : float or Expression
        Excess of the volume of the oil without air over the available volume, at the vapour pressure [unit of volume].
    gas : float or Expression
        Volume of the air times its pressure [unit of volume times Pa], positive.

    Returns
    -------
    float or Expression
        Pressure [Pa].

    Examples
    --------
    >>> [float(root_above_zero(1.0, squeezed, 6.0)) for squeezed in (1.0, -1.0)]
    [3.0, 2.0]
    """
    root = sqrt(squeezed * squeezed + 4.0 * softness * gas)
    outer = root + absolute(squeezed)
    return where(squeezed > 0.0, outer / (2.0 * softness), 2.0 * gas / outer)


def specific_volume(pressure: Scalar, bulk_modulus: Scalar, air_fraction: Scalar, vapour_pressure: Scalar) -> Scalar:
    """Return the volume that a unit amount of oil fills: the inverse of `oil_pressure`.

    Parameters
    ----------
    pressure : float or Expression
        Absolute pressure [Pa], above the vapour pressure.
    bulk_modulus, air_fraction, vapour_pressure : float or Expression
        As in `oil_pressure` [Pa, dimensionless, Pa].

    Returns
    -------
    float or Expression
        Volume over amount [dimensionless]; 1 at atmospheric pressure.

    Examples
    --------
    >>> round(specific_volume(2.07e6 + 101_325.0, 2.07e8, 0.0, 2e3), 6)
    0.99
    """
    air = air_fraction + NUCLEI
    liquid = (1.0 - air) * (1.0 - (pressure - ATMOSPHERE) / bulk_modulus)
    return liquid + air * (ATMOSPHERE - vapour_pressure) / (pressure - vapour_pressure)


def effective_bulk_modulus(
    pressure: Scalar, bulk_modulus: Scalar, air_fraction: Scalar, vapour_pressure: Scalar
) -> Scalar:
    """Return the stiffness ``-V dp/dV`` of oil with air, equation 5 of the piezo-stack paper with n = 1.

    Parameters
    ----------
    pressure : float or Expression
        Absolute pressure [Pa], above the vapour pressure.
    bulk_modulus, air_fraction, vapour_pressure : float or Expression
        As in `oil_pressure` [Pa, dimensionless, Pa].

    Returns
    -------
    float or Expression
        Effective bulk modulus [Pa].

    Examples
    --------
    >>> round(effective_bulk_modulus(1e6, 1.4e9, 0.01, 2e3) / 1e6)
    581
    """
    air = air_fraction + NUCLEI
    above = pressure - vapour_pressure
    slope = (1.0 - air) / bulk_modulus + air * (ATMOSPHERE - vapour_pressure) / (above * above)
    return specific_volume(pressure, bulk_modulus, air_fraction, vapour_pressure) / slope
