"""Structures of a linear model, with their names on the command line."""

from collections.abc import Mapping
from typing import Literal, TypeAlias

StructureName: TypeAlias = Literal["ARX", "ARMAX", "output-error", "Box-Jenkins", "SRIV", "subspace", "continuous"]

STRUCTURE_NAMES: Mapping[str, StructureName] = {
    "output-error": "output-error",
    "arx": "ARX",
    "armax": "ARMAX",
    "box-jenkins": "Box-Jenkins",
    "instrumental": "SRIV",
    "subspace": "subspace",
    "continuous": "continuous",
}
"""Structures of one input by what the command line calls them."""
