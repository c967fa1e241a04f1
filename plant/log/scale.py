"""Scales of sensors in the unit of a column: ``50 bar/V - 25 bar`` for volts of an oscilloscope."""

import re
from math import isfinite

from plant.units import conversion_to, converts

_NUMBER = r"\d+(?:\.\d*)?(?:[eE][-+]?\d+)?|\.\d+"
_SCALE = re.compile(rf"(-?)\s*({_NUMBER})\s*([A-Za-zµμ°].*?)(?:\s+([-+])\s+({_NUMBER})\s*(\S.*))?")


def conversion_of(unit: str, wanted: str, logged: str | None = None) -> tuple[float, float]:
    """Return ``(factor, offset)`` such that ``value * factor + offset`` is in the wanted unit.

    Parameters
    ----------
    unit : str
        A unit, ``"mm"``, or a sensor's scale: what one unit of the column is worth, ``"50 bar"`` or ``"50 bar/V"``, and
        what it reads at zero if that is not zero, ``"50 bar/V - 25 bar"``. A minus in front turns the sign.
    wanted : str
        The unit that is wanted, e.g. ``"Pa"``.
    logged : str, optional
        The unit that the log itself gives the column; it counts where the scale names what it is divided by.

    Returns
    -------
    tuple[float, float]
        Factor and offset.

    Raises
    ------
    ValueError
        If it cannot be read, or does not convert.

    Examples
    --------
    >>> conversion_of("50 bar/V - 25 bar", "Pa")
    (5000000.0, -2500000.0)
    >>> conversion_of("50 bar/V", "Pa", logged="mV")
    (5000.0, 0.0)
    """
    found = _SCALE.fullmatch(unit.strip())
    if found is None:
        if wanted != "V" and converts(unit, "V"):
            raise ValueError(f"unit {unit!r} does not convert to {wanted!r}, give the sensor's scale, as in 50 bar/V")
        return conversion_to(unit, wanted)
    minus, size, name, direction, start, start_unit = found.groups()
    factor = float(size) * _factor(name.strip(), wanted, logged)
    offset = float(start) * _factor(start_unit.strip(), wanted, None) if direction else 0.0
    if not factor or not isfinite(factor) or not isfinite(offset):
        raise ValueError(f"scale {unit[:40]!r} must be a finite number that is not zero")
    return (-factor if minus else factor), (-offset if direction == "-" else offset)


def measures(unit: str, wanted: str) -> bool:
    """Return whether a unit, or a scale such as ``100 ns``, measures the same quantity as a wanted unit.

    Examples
    --------
    >>> measures("100 ns", "s"), measures("50 bar", "Pa"), measures("V", "Pa")
    (True, True, False)
    """
    try:
        conversion_of(unit, wanted)
    except ValueError:
        return False
    return True


def _factor(name: str, wanted: str, logged: str | None) -> float:
    """Return the factor of a unit, or of a unit divided by the unit in which the column is logged."""
    top, slash, under = name.rpartition("/")
    try:
        factor, offset = conversion_to(name, wanted)
    except ValueError:
        if not slash:
            raise
        factor, offset = conversion_to(top.strip(), wanted)
        if logged is not None:
            factor *= conversion_to(logged, under.strip())[0]
        elif not converts(under.strip(), "V") and not converts(under.strip(), "A"):
            raise ValueError(f"unit {name[:40]!r} must convert to {wanted!r}, or to that for each V or A") from None
    if offset:
        raise ValueError(f"unit {name!r} has a zero of its own, so it cannot be scaled")
    return factor
