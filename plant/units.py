"""Units: machine-readable notes on parameters, and conversion of a log's columns to SI when the log is read.

Inside the project everything is SI; a unit occurs only in a name's suffix (``speed_rpm``) or in an `SI` note.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import cache
from math import isfinite
from numbers import Real
from typing import TYPE_CHECKING, Any, get_args, get_type_hints

from plant.errors import RigError
from plant.unit_text import plain_unit

if TYPE_CHECKING:
    import pint

LITRE_PER_MINUTE = 1e-3 / 60.0
"""One litre per minute, in m^3/s."""


SMALLEST, LARGEST = 1e-40, 1e40
"""Bounds of a parameter's size [SI]: no actuator has a parameter beyond them, in any unit."""


@dataclass(frozen=True)
class SI:
    """The note on a parameter: its unit, its meaning, and the source of its value.

    Parameters
    ----------
    unit : str
        SI unit, written with ``^`` and ``/``: ``"m^3/(s Pa)"``.
    meaning : str
        The quantity, in a few words.
    source : str
        Table, equation or section of the source, with the erratum if one applies.
    signed, zero : bool
        Whether it may have either sign, or be zero; otherwise it must be positive.
    """

    unit: str
    meaning: str
    source: str
    signed: bool = False
    zero: bool = False


def si(default: Any, unit: str, meaning: str, source: str, *, signed: bool = False, zero: bool = False) -> Any:
    """Return a field of a parameter dataclass with its note; takes the arguments of `SI` and a default.

    Parameters
    ----------
    default : float, bool, tuple of float or None
        Its default value [its unit]; a parameter may always have its default value.

    Examples
    --------
    >>> @dataclass(frozen=True)
    ... class Rod:
    ...     area: float = si(3e-4, "m^2", "area of the rod", "drawing 7")
    >>> Rod().area, notes(Rod)["area"].unit
    (0.0003, 'm^2')
    """
    return field(default=default, metadata={"si": SI(unit, meaning, source, signed, zero or default == 0.0)})


@cache
def notes(parameter_class: type) -> Mapping[str, SI]:
    """Return the `SI` note of every field of a parameter dataclass.

    Parameters
    ----------
    parameter_class : type
        A dataclass whose fields are ``si(...)``, or ``Annotated[float, SI(...)]`` if they have no default.

    Returns
    -------
    Mapping[str, SI]
        One note for each field name, in field order.

    Raises
    ------
    TypeError
        If a field carries no note.

    Examples
    --------
    >>> from plant.eha.model import EhaParameters
    >>> notes(EhaParameters)["piston_area"].unit
    'm^2'
    """
    hints = get_type_hints(parameter_class, include_extras=True)
    found: dict[str, SI] = {}
    for one in fields(parameter_class):
        hint = hints[one.name]
        note = one.metadata.get("si") or next((extra for extra in get_args(hint) if isinstance(extra, SI)), None)
        if note is None:
            raise TypeError(f"{parameter_class.__name__}.{one.name} must carry an SI note, got {hint}")
        found[one.name] = note
    return found


def require_number(name: str, value: object, *, signed: bool = False, zero: bool = False) -> None:
    """Refuse a parameter that is not a finite number, or has the wrong sign.

    Parameters
    ----------
    value : object
        Its value [its own unit].

    Raises
    ------
    RigError
        If it is not a finite number, or has the wrong sign.

    Examples
    --------
    >>> require_number("moving_mass", 0.0)
    Traceback (most recent call last):
        ...
    plant.errors.RigError: moving_mass must be positive, got 0.0
    """
    if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
        raise RigError(f"{name} must be a finite number, got {value!r}")
    if not signed and (value < 0.0 or (value == 0.0 and not zero)):
        raise RigError(f"{name} must {'not be negative' if zero else 'be positive'}, got {value!r}")
    # within these limits, squares neither overflow nor underflow
    if abs(value) > LARGEST or (value and abs(value) < SMALLEST and not (zero or signed)):
        raise RigError(f"{name} must be from {SMALLEST:g} to {LARGEST:g} in size, got {value!r}")


def require_numbers(parameters: Any) -> None:
    """Refuse a set of parameters if a number, or a row of numbers, is not finite or has the wrong sign.

    Parameters
    ----------
    parameters : dataclass instance
        The parameters, each in its own unit; one that is None by default may be None. A number of NumPy becomes a
        float, so that no model computes in its precision.

    Raises
    ------
    RigError
        If one is not finite or has the wrong sign; the message names it.
    """
    noted = notes(type(parameters))
    for one in fields(parameters):
        value, note = getattr(parameters, one.name), noted[one.name]
        if value is None and one.default is None:
            continue
        if not isinstance(value, tuple | list):
            if isinstance(value, Real) and not isinstance(value, int | float):
                value = float(value)
                object.__setattr__(parameters, one.name, value)
            require_number(one.name, value, signed=note.signed, zero=note.zero)
            continue
        for i, each in enumerate(value, start=1):
            require_number(f"{one.name} [{i}]", each, signed=note.signed, zero=note.zero)


@cache
def unit_registry() -> "pint.UnitRegistry[Any]":
    """Return the project's only pint registry, with the workshop units ``lpm`` and ``rev`` added."""
    import pint

    registry: pint.UnitRegistry[Any] = pint.UnitRegistry()
    registry.define("lpm = liter / minute")
    registry.define("rev = revolution")
    return registry


LOWER_CASE: Mapping[str, str] = {
    "pa": "Pa",
    "kpa": "kPa",
    "mpa": "MPa",
    "gpa": "GPa",
    "v": "V",
    "mv": "mV",
    "kv": "kV",
    "hz": "Hz",
}
"""Units that column names write in lower case, where pint reads another unit or none (``pa``: pico-year)."""


USUAL: Mapping[str, tuple[str, float]] = {
    "s": ("s", 1.0),
    "ms": ("s", 1e-3),
    "us": ("s", 1e-6),
    "µs": ("s", 1e-6),
    "ns": ("s", 1e-9),
    "min": ("s", 60.0),
    "rad/s": ("rad/s", 1.0),
    "rpm": ("rad/s", 0.10471975511965977),
    "degree/s": ("rad/s", 0.017453292519943295),
    "m": ("m", 1.0),
    "mm": ("m", 1e-3),
    "cm": ("m", 1e-2),
    "um": ("m", 1e-6),
    "µm": ("m", 1e-6),
    "nm": ("m", 1e-9),
    "m/s": ("m/s", 1.0),
    "mm/s": ("m/s", 1e-3),
    "cm/s": ("m/s", 1e-2),
    "um/s": ("m/s", 1e-6),
    "Pa": ("Pa", 1.0),
    "kPa": ("Pa", 1e3),
    "MPa": ("Pa", 1e6),
    "hPa": ("Pa", 1e2),
    "mbar": ("Pa", 1e2),
    "bar": ("Pa", 1e5),
    "psi": ("Pa", 6894.7572931683635),
    "V": ("V", 1.0),
    "mV": ("V", 1e-3),
    "kV": ("V", 1e3),
    "N": ("N", 1.0),
    "kN": ("N", 1e3),
}
"""Common units of logs, with their base unit and their factor from pint. Importing pint takes as long as an
estimate."""


@cache
def converts(unit: str, wanted: str) -> bool:
    """Return whether a unit is known and measures the same quantity as another."""
    try:
        conversion_to(unit, wanted)
    except ValueError:
        return False
    return True


def conversion_to(unit: str, wanted: str) -> tuple[float, float]:
    """Return ``(factor, offset)`` such that ``value * factor + offset`` is in the wanted unit.

    Parameters
    ----------
    unit : str
        Unit of the values, e.g. ``"mm"``, ``"rpm"``, ``"bar"``; ``"-rpm"`` for a sensor that counts in the opposite
        direction.
    wanted : str
        The unit to convert to, e.g. ``"m"``.

    Returns
    -------
    tuple[float, float]
        Factor and offset of the affine conversion.

    Raises
    ------
    ValueError
        If the unit is unknown, or measures another quantity.

    Examples
    --------
    >>> conversion_to("-rad/s", "rad/s")
    (-1.0, 0.0)
    >>> factor, offset = conversion_to("mm", "m")
    >>> round(factor, 12), offset
    (0.001, 0.0)
    """
    if unit.startswith("-"):
        factor, offset = conversion_to(unit[1:], wanted)
        return -factor, offset
    name = plain_unit(LOWER_CASE.get(unit, unit), angular=wanted == "rad/s")
    if name in USUAL and USUAL.get(wanted, ("", 0.0)) == (wanted, 1.0):
        of, factor = USUAL[name]
        if of != wanted:
            raise ValueError(f"unit {unit!r} does not convert to {wanted!r}")
        return factor, 0.0
    return pint_conversion(unit, name, wanted)


def pint_conversion(unit: str, name: str, wanted: str) -> tuple[float, float]:
    """Return the result of `conversion_to` for any unit that Pint knows.

    Parameters
    ----------
    unit, name : str
        The unit as given, and as Pint spells it.
    wanted : str
        The unit to convert to.

    Returns
    -------
    tuple[float, float]
        Factor and offset of the affine conversion.

    Raises
    ------
    ValueError
        As for `conversion_to`.
    """
    import pint

    registry = unit_registry()
    try:
        zero = float(registry.Quantity(0.0, name).to(wanted).magnitude)
        one = float(registry.Quantity(1.0, name).to(wanted).magnitude)
        turns = "radian" in str(registry.Quantity(1.0, name).to_base_units().units)
    except pint.UndefinedUnitError as error:
        raise ValueError(f"unit {unit!r} is unknown, wanted one that converts to {wanted!r}") from error
    except pint.DimensionalityError as error:
        raise ValueError(f"unit {unit!r} does not convert to {wanted!r}") from error
    except Exception as error:  # pint parses with several exception types of its own and of tokenize
        raise ValueError(f"unit {unit!r} cannot be read, wanted one that converts to {wanted!r}") from error
    if turns != ("rad" in wanted):  # pint takes 1 Hz for 1 rad/s
        raise ValueError(
            f"unit {unit!r} leaves the angle out, wanted one that converts to {wanted!r}, with rad, rev or rpm"
        )
    return one - zero, zero
