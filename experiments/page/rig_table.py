"""What a rig file, or its default, says of the actuator: a table for the page of a log."""

from dataclasses import fields
from typing import TYPE_CHECKING, Any

from experiments.page.numbers import MINUS, MISSING, number, pretty_unit
from plant.eha.doubts import PRESSURE_GAIN, Spread, default_uncertainties, spreads_of
from plant.units import notes

if TYPE_CHECKING:
    from plant.eha.rig import Rig

MOST_DIGITS = 5
"""Largest number of significant digits of a value [count]."""


def rig_rows(rig: "Rig[Any]") -> list[dict[str, str]]:
    """Return the entries of a rig file, those with an uncertainty first.

    Returns
    -------
    list of dict
        ``entry``, ``value`` with its SI unit, ``uncertainty`` as one standard deviation, and ``meaning``.
    """
    noted = notes(type(rig.parameters))
    spreads = spreads_of(default_uncertainties(rig.parameters), rig.uncertainties, rig.measured)
    rows = [
        {
            "entry": field.name,
            "value": _amount(getattr(rig.parameters, field.name), noted[field.name].unit),
            "uncertainty": _spread(spreads.get(field.name)) + (", measured" if field.name in rig.measured else ""),
            "meaning": noted[field.name].meaning,
        }
        for field in fields(rig.parameters)
        if field.name in noted
    ]
    if PRESSURE_GAIN in spreads:
        meaning = "gain of the differential pressure"
        rows.append(
            {"entry": PRESSURE_GAIN, "value": "1", "uncertainty": _spread(spreads[PRESSURE_GAIN]), "meaning": meaning}
        )
    return sorted(rows, key=lambda row: row["uncertainty"] == MISSING)


def _amount(value: Any, unit: str) -> str:
    if not isinstance(value, int | float):
        return MISSING if value is None else str(value)
    exact = (digits for digits in range(1, MOST_DIGITS) if float(f"{value:.{digits}g}") == value)
    shown = number(float(value), next(exact, MOST_DIGITS))
    return shown if unit == "1" else f"{shown} {pretty_unit(unit)}"


def _spread(one: Spread | None) -> str:
    if one is None or not max(one):
        return MISSING
    down, up = (f"{100.0 * part:.2g} %" for part in one)
    return f"± {up}" if one.down == one.up else f"{MINUS}{down} to +{up}"
