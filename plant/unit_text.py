"""Grammar of units in a header, an option or a rig file: only names and small whole powers.

A unit comes from a file that anybody may have written, and the library that converts units evaluates its input:
``m*9**9**9`` would keep it busy for ever. So this grammar checks the text first.
"""

import re
from collections.abc import Mapping

LONGEST = 40
"""Number of characters of the longest unit that is read."""

_NAME = r"[A-Za-zµμΩ°Δ%][A-Za-zµμΩ°%_]{0,23}"
_POWER = r"(?:(?:\^|\*\*)[-+]?[1-9]|[-+][1-4]|[2-4])?"
_FACTOR = rf"{_NAME}{_POWER}"
_PRODUCT = rf"{_FACTOR}(?:\s*[*·⋅ ]\s*{_FACTOR})*"
_UNDER = rf"(?:{_FACTOR}|\(\s*{_PRODUCT}\s*\))"
_UNIT = re.compile(rf"(?:1|{_PRODUCT})(?:\s*/\s*{_UNDER}){{0,3}}")
_BARE_POWER = re.compile(r"(?<=[A-Za-zµμΩ°])([-+][1-4]|[2-4])(?![0-9])")

_SIGNS = str.maketrans(
    {"²": "^2", "³": "^3", "⁻": "-", "¹": "1", "μ": "µ", "·": "*", "⋅": "*", "\u2212": "-", "\u00d7": "*"}
)

_RUSSIAN = {
    **{"м": "m", "мм": "mm", "см": "cm", "мкм": "um", "с": "s", "сек": "s", "мс": "ms", "В": "V"},  # noqa: PIE800, RUF001
    **{"м/с": "m/s", "мм/с": "mm/s", "рад/с": "rad/s", "об/мин": "rpm", "бар": "bar"},  # noqa: PIE800, RUF001
    **{"Па": "Pa", "кПа": "kPa", "МПа": "MPa", "кгс/см^2": "kgf/cm^2"},  # noqa: PIE800
}

SPELLINGS: Mapping[str, str] = {
    "°": "degree",
    "°/s": "degree/s",
    "°C": "degC",
    "deg": "degree",
    "Grad": "degree",
    "Grad/s": "degree/s",
    "Sekunden": "s",
    "Volt": "V",
    "Volts": "V",
    **_RUSSIAN,
    **dict.fromkeys(("lb/in2", "lb/in^2"), "psi"),
    **dict.fromkeys(("kg/cm2", "kg/cm^2", "kp/cm2", "kp/cm^2"), "kgf/cm^2"),
}
"""Spellings used on benches, and their meaning."""

_REFERRED = re.compile(r"(m?bar|psi|[hkmg]?pa)[ _]?(?:\(([agd]|abs)\)|([agd]|abs|gauge))\.?", re.IGNORECASE)
"""A pressure that states what it is counted from, absolute or gauge, or that it is a difference."""

_TURNS = {
    *("1/min", "min^-1", "u/min", "umdr/min", "tr/min", "r/min", "rev/min", "rpm", "upm"),
    *("revs/min", "rotations/min", "tours/min", "tr/mn", "toer/min"),
    *("giri/min", "obr/min", "ot/min", "varv/min", "omw/min"),
}
"""Revolutions per minute, in lower case; a shaft's speed is often written without the angle."""

_CASELESS = {
    **{one.lower(): one for one in ("kPa", "MPa", "GPa", "Pa", "hPa", "V", "mV", "kV", "Hz", "kHz", "N", "kN")},
    **dict.fromkeys(("sec", "secs", "second", "seconds"), "s"),
    **{f"{one}sec": f"{one}s" for one in ("m", "u", "n", "mm/", "cm/", "m/")},
    **dict.fromkeys(("msecs", "millisec", "millisecond", "milliseconds", "millisekunden"), "ms"),
    **dict.fromkeys(("usecs", "microsec", "microsecond", "microseconds", "mikrosekunden"), "us"),
    **dict.fromkeys(("sek", "sekunde", "sekunden", "seconde", "secondes", "segundos"), "s"),
    **dict.fromkeys(("hr", "hrs", "hours"), "h"),
    "minutes": "minute",
    "days": "d",
    **dict.fromkeys(("in", "inch", "inches", "zoll"), "in"),
    **dict.fromkeys(("ft", "feet", "foot"), "ft"),
    **dict.fromkeys(("mil", "mils", "thou"), "thou"),
    **dict.fromkeys(("micron", "microns", "micrometer", "micrometre"), "um"),
    **dict.fromkeys(("millimeter", "millimeters", "millimetre", "millimetres"), "mm"),
    **dict.fromkeys(("in/s", "in/sec", "inch/s", "inches/s", "ips"), "in/s"),
    **dict.fromkeys(("in/min", "inch/min", "inches/min", "ipm"), "in/min"),
    **dict.fromkeys(("ft/s", "ft/sec", "fps"), "ft/s"),
    **dict.fromkeys(("ft/min", "fpm"), "ft/min"),
    **dict.fromkeys(("mmps", "mm/sek"), "mm/s"),
    **dict.fromkeys(("lbs/in2", "lbs/in^2"), "psi"),
    **{
        one: one
        for one in (
            "torr",
            "ksi",
            "bar",
            "mbar",
            "psi",
            "mm",
            "cm",
            "um",
            "µm",
            "ms",
            "us",
            "mm/s",
            "cm/s",
            "m/s",
            "rad/s",
        )
    },
}
"""Units that are recognised in any case, by their lower-case spelling."""


def pressure_reference(unit: str) -> tuple[str, str]:
    """Return a unit of pressure without what it is counted from, and that: ``absolute``, ``gauge`` or nothing.

    Parameters
    ----------
    unit : str
        As written; a minus in front is passed over.

    Examples
    --------
    >>> pressure_reference("bar(a)"), pressure_reference("psig"), pressure_reference("kPa")
    (('bar', 'absolute'), ('psi', 'gauge'), ('kPa', ''))
    """
    found = _REFERRED.fullmatch(unit.strip().removeprefix("-"))
    if found is None:
        return unit, ""
    return found[1], {"a": "absolute", "g": "gauge"}.get((found[2] or found[3]).lower()[0], "")


def plain_unit(unit: str, *, angular: bool = False) -> str:
    """Return a unit as the library of units spells it.

    Parameters
    ----------
    unit : str
        The unit as written in a header, an option or a rig file: ``"mm/s²"``, ``"U/min"``, ``"kgf/cm^2"``.
    angular : bool
        Whether it is the speed of a shaft, so that the unit may omit the revolution.

    Returns
    -------
    str
        Names, ``*``, ``/``, ``^`` and small whole powers.

    Raises
    ------
    ValueError
        If it is not a product of names and small whole powers.

    Examples
    --------
    >>> plain_unit("mm/s²"), plain_unit("1/min", angular=True)
    ('mm/s^2', 'rpm')
    """
    text = unit.strip().translate(_SIGNS)
    text = SPELLINGS.get(text, text)
    text = pressure_reference(text)[0]  # for a pressure difference, which a log has, all three are the same
    folded = text.lower().replace(".", "").replace(" ", "").replace("**", "^").replace("min-1", "min^-1")
    if angular and folded in _TURNS:
        return "rpm"
    text = _CASELESS.get(folded, text) if text not in ("Mm", "mPa", "MV", "MHz", "MN", "Ms", "MM/s") else text
    if len(text) > LONGEST or not _UNIT.fullmatch(text) or text == "1":
        raise ValueError(
            f"unit {unit[:LONGEST]!r} is unknown, wanted names with whole powers up to 9, as in mm/s or kgf/cm^2"
        )
    return _BARE_POWER.sub(r"^\1", text)
