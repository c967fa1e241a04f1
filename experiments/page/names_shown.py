"""Short names of severities for columns and titles; each has the same noun on every page."""

from collections.abc import Mapping

QUANTITY_NAMES: Mapping[str, str] = {
    "leakage_flow": "leakage",
    "velocity_lost": "velocity lost",
    "added_friction": "added friction",
    "pressure_rise": "pressure rise",
    "bulk_modulus": "bulk modulus",
    "entrained_air": "entrained air",
}
"""Short name of each severity."""


def quantity_name(name: str) -> str:
    """Return the name of a quantity in a table.

    Examples
    --------
    >>> quantity_name("coulomb_friction"), quantity_name("air_fraction")
    ('Coulomb friction', 'air fraction')
    """
    return name.replace("_", " ").replace("coulomb", "Coulomb")
