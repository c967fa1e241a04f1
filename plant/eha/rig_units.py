"""Entries of a rig file in another unit than SI, told by sizes that no actuator has.

A number in a wrong unit makes another actuator, whose bulk modulus and class may pass every check, or a search that
finds no end. Limits are far beyond what is built, so that only a slip of units is outside.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from plant.eha.model import EhaParameters
from plant.errors import RigError


class Limits(NamedTuple):
    """What an entry of a rig file may be.

    Parameters
    ----------
    least, most : float
        Its limits [SI].
    unit, slip : str
        Its unit, and how what a nameplate says is converted to it.
    """

    least: float
    most: float
    unit: str
    slip: str


_PRESSURE = "bar times 1e5, MPa times 1e6 and psi times 6895 are Pa"

LIMITS: Mapping[str, Limits] = MappingProxyType(
    {
        "pump_displacement": Limits(1e-11, 1e-2, "m^3/rad", "cm^3 per revolution times 1.5915e-7 is m^3/rad"),
        "piston_area": Limits(1e-6, 10.0, "m^2", "mm^2 times 1e-6 and cm^2 times 1e-4 are m^2"),
        "bulk_modulus": Limits(1e6, 1e11, "Pa", f"{_PRESSURE}; GPa times 1e9 too"),
        "leakage_coefficient": Limits(0.0, 1e-7, "m^3/(s Pa)", "L/min at a bar times 1.667e-10 is m^3/(s Pa)"),
        "flow_bias": Limits(0.0, 1e-2, "m^3/s", "L/min times 1.667e-5 is m^3/s"),
        "relief_pressure": Limits(1e4, 1e9, "Pa", _PRESSURE),
        "accumulator_pressure": Limits(1e3, 1e9, "Pa", f"{_PRESSURE}, absolute"),
        "stroke": Limits(1e-4, 30.0, "m", "mm times 1e-3 is m"),
    }
)
"""What entries may be; judged."""

LENGTHS = (1e-3, 1e2)
"""Chamber volume over piston area [m]; judged: half a chamber, with port and hose, is as long as some pistons' travel.
Litres are told by it in any size of actuator."""


def require_si(p: EhaParameters) -> None:
    """Refuse an actuator if one of its entries is in another unit than SI.

    Parameters
    ----------
    p : EhaParameters
        The actuator of a rig file.

    Raises
    ------
    RigError
        If an entry has a size that no actuator has.

    Examples
    --------
    >>> require_si(EhaParameters(flow_bias=2.0))
    Traceback (most recent call last):
    plant.errors.RigError: parameters.flow_bias must be from 0 to 0.01 m^3/s, got 2: L/min times 1.667e-5 is m^3/s
    """
    for name, one in LIMITS.items():
        value = getattr(p, name)
        if value is not None and not one.least <= value <= one.most:
            limits = f"from {one.least:g} to {one.most:g} {one.unit}"
            raise RigError(f"parameters.{name} must be {limits}, got {value:g}: {one.slip}")
    length = p.chamber_volume / p.piston_area
    if not LENGTHS[0] <= length <= LENGTHS[1]:
        raise RigError(
            f"parameters.chamber_volume must be {LENGTHS[0]:g} to {LENGTHS[1]:g} m of the piston's area, got "
            f"{p.chamber_volume:g} m^3, which is {length:.3g} m of {p.piston_area:g} m^2: L times 1e-3 and cm^3 times "
            "1e-6 are m^3, and for piston_area cm^2 times 1e-4 and mm^2 times 1e-6 are m^2"
        )
