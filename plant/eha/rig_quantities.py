"""`numbers_with_units(...)`: entries of a rig file such as ``"3.5 cm^3/rev"``, as a nameplate has them, in SI."""

import re
from collections.abc import Mapping
from typing import Any

from plant.errors import RigError
from plant.small_file import shown
from plant.unit_text import GAUGE
from plant.units import conversion_to

_QUANTITY = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([^\s\d+\-.,].*?)\s*")


def numbers_with_units(given: Mapping[str, Any], units: Mapping[str, str]) -> dict[str, Any]:
    """Return the entries of a rig file with every text of a number and a unit as its number in SI.

    Parameters
    ----------
    given : Mapping[str, Any]
        What the file says: numbers in SI stay as they are, in lists too, and so does what is no quantity.
    units : Mapping[str, str]
        The SI unit of each parameter.

    Returns
    -------
    dict[str, Any]
        The same names [SI].

    Raises
    ------
    RigError
        If a unit is unknown, measures something else, or is a gauge pressure.

    Examples
    --------
    >>> found = numbers_with_units({"piston_area": ["31.2 cm^2", 0.0021]}, {"piston_area": "m^2"})
    >>> [round(one, 6) for one in found["piston_area"]]
    [0.00312, 0.0021]
    """
    return {name: _in_si(name, value, units.get(name, "1")) for name, value in given.items()}


def _in_si(name: str, value: Any, unit: str) -> Any:
    if isinstance(value, list):
        return [_in_si(name, one, unit) for one in value]
    found = _QUANTITY.fullmatch(value) if isinstance(value, str) else None
    if found is None:
        return value
    try:
        factor, offset = conversion_to(found[2], unit)
    except ValueError as error:
        raise RigError(
            f"parameters.{name} must be a number or a quantity in {unit}, got {shown(value)}: {error}"
        ) from error
    if found[2] in GAUGE:  # some parameters are absolute pressures
        raise RigError(
            f"parameters.{name} must be in bar or {unit}, got {shown(value)}, a pressure above the atmosphere: "
            "add 1.013 bar if the parameter is absolute"
        )
    return float(found[1]) * factor + offset
