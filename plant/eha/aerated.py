"""The gear-pump actuator with air in its oil: the oil as estimated from a log, the rest as given in the rig file."""

from dataclasses import dataclass, fields

from plant.eha.model import EhaParameters
from plant.units import si


@dataclass(frozen=True, kw_only=True)
class AeratedParameters(EhaParameters):
    """Parameters of an actuator, and the air in its oil. Bulk modulus is that of the oil without air.

    The circuit around it (`plant.eha.circuit_parameters.circuit_of`) has the same air fraction.

    Examples
    --------
    >>> AeratedParameters(air_fraction=0.01).piston_area
    0.00152
    """

    air_fraction: float = si(0.0, "1", "entrained air at atmospheric pressure", "a log")


def with_air_in_oil(p: EhaParameters, air_fraction: float, bulk_modulus: float) -> AeratedParameters:
    """Return an actuator with air in its oil.

    Parameters
    ----------
    air_fraction : float
        Volume of air over the volume of oil and air, at atmospheric pressure [fraction].
    bulk_modulus : float
        Bulk modulus of the oil without air [Pa].
    """
    known = {field.name: getattr(p, field.name) for field in fields(EhaParameters)}
    return AeratedParameters(**known | {"bulk_modulus": bulk_modulus}, air_fraction=air_fraction)
