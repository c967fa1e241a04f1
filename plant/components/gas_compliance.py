"""Oil in a volume that a gas spring lets grow with pressure: an accumulator's port, or a compliant wall."""

from plant.compiled.functions import Scalar
from plant.components.oil import ATMOSPHERE, NUCLEI, root_above_zero


def compliant_oil_pressure(
    amount: Scalar, volume: Scalar, compliance: Scalar, rest_pressure: Scalar, oil: tuple[Scalar, Scalar, Scalar]
) -> Scalar:
    """Return the absolute pressure of oil in a volume that grows by the compliance times the pressure above rest.

    This is `plant.components.oil.oil_pressure` with one more spring in parallel with the liquid: the volumes of liquid,
    air and vapour add up to ``volume + compliance (p - rest_pressure)``, a quadratic in p. Source: the accumulator's
    node, errata P16.

    Parameters
    ----------
    amount : float or Expression
        Oil, as its volume at atmospheric pressure [m^3], positive.
    volume : float or Expression
        Volume at the rest pressure [m^3].
    compliance : float or Expression
        Growth of the volume per pascal [m^3/Pa]; 0 for rigid walls.
    rest_pressure : float or Expression
        Pressure at which the volume has the given value [Pa].
    oil : tuple of float or Expression
        Bulk modulus [Pa], air fraction [dimensionless] and vapour pressure [Pa], as in `oil_pressure`.

    Returns
    -------
    float or Expression
        Pressure [Pa].

    Examples
    --------
    >>> round(float(compliant_oil_pressure(1.001, 1.0, 0.0, 1e5, (2.07e8, 0.0, 2e3))))
    308118
    """
    bulk_modulus, air_fraction, vapour_pressure = oil
    air = air_fraction + NUCLEI
    gas = amount * air * (ATMOSPHERE - vapour_pressure)
    softness = amount * (1.0 - air) / bulk_modulus + compliance
    squeezed = (
        amount * (1.0 - air) * (1.0 + (ATMOSPHERE - vapour_pressure) / bulk_modulus)
        - volume
        + compliance * (rest_pressure - vapour_pressure)
    )
    return vapour_pressure + root_above_zero(softness, squeezed, gas)
