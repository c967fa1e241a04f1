"""Severities as a column or a title has room for; one noun for each on every page."""

from collections.abc import Mapping

SHOWN: Mapping[str, str] = {
    "leakage_flow": "leakage",
    "velocity_lost": "velocity lost",
    "added_friction": "added friction",
    "pressure_rise": "pressure rise",
    "bulk_modulus": "bulk modulus",
    "entrained_air": "entrained air",
}
"""What each severity is called in short."""
