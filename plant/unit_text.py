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

GAUGE = {"barg": "bar", "bar(g)": "bar", "psig": "psi", "psi(g)": "psi"}
"""Gauge pressure: for a pressure difference, which a log has, it equals the plain unit."""

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
    **GAUGE,
    **dict.fromkeys(("psid", "lb/in2", "lb/in^2"), "psi"),
    **dict.fromkeys(("kg/cm2", "kg/cm^2"), "kgf/cm^2"),
}
"""Spellings used on benches, and their meaning."""

_TURNS = {
    *("1/min", "min^-1", "u/min", "umdr/min", "tr/min", "r/min", "rev/min", "rpm", "upm"),
    *("giri/min", "obr/min", "ot/min", "varv/min", "omw/min"),
}
"""Revolutions per minute, in lower case; a shaft's speed is often written without the angle."""

_CASELESS = {
    **{one.lower(): one for one in ("kPa", "MPa", "GPa", "Pa", "hPa", "V", "mV", "kV", "Hz", "kHz", "N", "kN")},
    **dict.fromkeys(("sec", "secs", "second", "seconds"), "s"),
    **{f"{one}sec": f"{one}s" for one in ("m", "u", "mm/", "cm/", "m/")},
    **{one: one for one in ("bar", "mbar", "psi", "mm", "cm", "um", "µm", "ms", "us", "mm/s", "cm/s", "m/s", "rad/s")},
}
"""Units that are recognised in any case, by their lower-case spelling."""


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
    folded = text.lower().replace(".", "").replace(" ", "").replace("**", "^").replace("min-1", "min^-1")
    if angular and folded in _TURNS:
        return "rpm"
    text = _CASELESS.get(folded, text) if text not in ("Mm", "mPa", "MV", "MHz", "MN", "Ms", "MM/s") else text
    if len(text) > LONGEST or not _UNIT.fullmatch(text) or text == "1":
        raise ValueError(
            f"unit {unit[:LONGEST]!r} is unknown, wanted names with whole powers up to 9, as in mm/s or kgf/cm^2"
        )
    return _BARE_POWER.sub(r"^\1", text)
