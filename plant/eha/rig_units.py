"""Entries of a rig file that are not in SI, detected by sizes that no actuator has.

A number in a wrong unit describes another actuator, whose bulk modulus and class may pass every check, or a search that
does not end. The limits are far beyond any real actuator, so that only an error in a unit exceeds them.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from plant.eha.model import EhaParameters
from plant.errors import RigError


class Limits(NamedTuple):
    """Limits of an entry of a rig file, with its unit and an example.

    Parameters
    ----------
    least, most : float
        Its limits [SI].
    unit, example : str
        Its unit, and an example as on a nameplate.
    """

    least: float
    most: float
    unit: str
    example: str


LIMITS: Mapping[str, Limits] = MappingProxyType(
    {
        "pump_displacement": Limits(1e-11, 1e-2, "m^3/rad", "8 cm^3/rev"),
        "piston_area": Limits(1e-6, 10.0, "m^2", "31.2 cm^2"),
        "bulk_modulus": Limits(1e6, 1e11, "Pa", "1.4 GPa"),
        "leakage_coefficient": Limits(0.0, 1e-7, "m^3/(s Pa)", "0.03 L/min/bar"),
        "flow_bias": Limits(0.0, 1e-2, "m^3/s", "0.1 L/min"),
        "relief_pressure": Limits(1e4, 1e9, "Pa", "160 bar"),
        "accumulator_pressure": Limits(1e3, 1e9, "Pa", "3 bar"),
        "accumulator_gas": Limits(1e-9, 10.0, "m^3", "0.3 L"),
        "stroke": Limits(1e-4, 30.0, "m", "200 mm"),
    }
)
"""Limits of the entries; judged."""

LENGTHS = (1e-3, 1e2)
"""Limits of chamber volume over piston area [m]; judged: half a chamber, with port and hose, is as long as some
pistons' travel. It detects litres in an actuator of any size."""

MOST_GAS = 100.0
"""Largest ratio of accumulator gas to a chamber's dead volume [dimensionless]; judged: litres given as cubic metres
make it a thousand times too large."""


def _unit_advice(example: str) -> str:
    return f'write another unit in quotes, as in "{example}"'


def require_si(p: EhaParameters) -> None:
    """Refuse an actuator if one of its entries is not in SI.

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
    >>> require_si(EhaParameters(stroke=200.0))  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    plant.errors.RigError: parameters.stroke must be from 0.0001 to 30 m, got 200; ... in quotes, as in "200 mm"
    """
    for name, one in LIMITS.items():
        value = getattr(p, name)
        if value is not None and not one.least <= value <= one.most:
            limits = f"from {one.least:g} to {one.most:g} {one.unit}"
            raise RigError(f"parameters.{name} must be {limits}, got {value:g}; {_unit_advice(one.example)}")
    length = p.chamber_volume / p.piston_area
    if not LENGTHS[0] <= length <= LENGTHS[1]:
        raise RigError(
            f"parameters.chamber_volume must be {LENGTHS[0]:g} to {LENGTHS[1]:g} m of the piston's area, got "
            f"{p.chamber_volume:g} m^3, which is {length:.3g} m of {p.piston_area:g} m^2; "
            f'{_unit_advice("0.6 L")}, and piston_area as in "31.2 cm^2"'
        )
    if p.accumulator_gas is not None and p.accumulator_gas > MOST_GAS * p.chamber_volume:
        raise RigError(
            f"parameters.accumulator_gas must be at most {MOST_GAS:g} times chamber_volume ({p.chamber_volume:g} m^3), "
            f"got {p.accumulator_gas:g} m^3; {_unit_advice('0.3 L')}"
        )
