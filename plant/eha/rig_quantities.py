"""`numbers_with_units(...)`: entries of a rig file such as ``"3.5 cm^3/rev"``, as on a nameplate, converted to SI."""

from collections.abc import Mapping
from typing import Any

from plant.errors import RigError
from plant.log.formats.cell_texts import NUMBER, split_unit
from plant.log.formats.cells import number
from plant.small_file import entry_text
from plant.unit_text import pressure_reference
from plant.units import conversion_to

NUMBER_ADVICE = "write a decimal point, and nothing between thousands"


def numbers_with_units(given: Mapping[str, Any], units: Mapping[str, str]) -> dict[str, Any]:
    """Return the entries of a rig file; a text of a number and a unit becomes its number in SI.

    Parameters
    ----------
    given : Mapping[str, Any]
        Entries of the file: numbers in SI are unchanged, also in lists, and so are entries that are not parameters.
    units : Mapping[str, str]
        The SI unit of each parameter.

    Returns
    -------
    dict[str, Any]
        The same names [SI].

    Raises
    ------
    RigError
        If a text is not a number with a unit, or its unit is unknown, measures another quantity, or is a gauge
        pressure.

    Examples
    --------
    >>> found = numbers_with_units({"piston_area": ["31.2 cm^2", 0.0021]}, {"piston_area": "m^2"})
    >>> [round(one, 6) for one in found["piston_area"]]
    [0.00312, 0.0021]
    """
    return {name: _in_si(name, value, units[name]) if name in units else value for name, value in given.items()}


def _in_si(name: str, value: Any, unit: str) -> Any:
    if isinstance(value, list):
        return [_in_si(name, one, unit) for one in value]
    if not isinstance(value, str):
        return value
    whole = value.strip()
    text, given = (whole, "") if NUMBER.fullmatch(whole) else split_unit(whole)
    wanted = "a number without quotes" if unit == "1" else f"a number in {unit}, or a number and its unit in quotes"
    wrong = f"parameters.{name} must be {wanted}, got {entry_text(value)}"
    if not given:
        raise RigError(f"{wrong}: {NUMBER_ADVICE}" if unit == "1" and "," in text else wrong)
    try:
        amount = number(text)
    except ValueError as error:
        raise RigError(f"{wrong}: {NUMBER_ADVICE}") from error
    try:
        factor, offset = conversion_to(given, unit)
    except ValueError as error:
        raise RigError(f"{wrong}: {error}") from error
    plain, counted_from = pressure_reference(given)
    if counted_from:  # some parameters are absolute pressures, others are differences
        remedy = (
            "a pressure above the atmosphere: add 1.013 bar if the parameter is absolute"
            if counted_from == "gauge"
            else "an absolute pressure: take off 1.013 bar unless the parameter is absolute"
        )
        raise RigError(f"parameters.{name} must be in {plain} or {unit}, got {entry_text(value)}, {remedy}")
    return amount * factor + offset
