"""Levels of a circuit that is in none of the nine conditions, nor between them, and its most unusual part."""

from collections.abc import Mapping

import numpy as np

from faults.conditions import severity
from faults.diagnosis.circuits.actuator import Actuator
from faults.diagnosis.circuits.circuit_runs import COORDINATES, coordinates_of
from faults.diagnosis.circuits.class_fit import CONDITION_SPREAD
from faults.diagnosis.circuits.class_regions import ClassFits
from faults.notes import AgainstCode
from plant.arrays import Array
from plant.notes import Note

PARTS: Mapping[str, str] = {
    "leakage": "leakage coefficient",
    "bias": "flow bias",
    "friction_rest": "friction at rest",
    "friction_quadratic": "quadratic friction",
    "friction_rated": "friction at rated speed",
    "bulk_modulus": "bulk modulus",
    "presliding": "presliding displacement",
}
"""Coordinates of a circuit in words."""

LEVELS = np.linspace(0.0, 2.0, 41)
"""Levels that are tried [dimensionless]: 1 is minor, 2 is major. A log separates a quarter; these are a fifth of
that."""


def beside_note(fits: ClassFits, actuator: Actuator) -> Note:
    """Return the levels of a circuit's leakage and friction, each alone, and the part that fits them least.

    Parameters
    ----------
    fits : ClassFits
        The fits; the best circuit is used.
    """
    place = fits.best.coordinates

    def level(name: str, leakage: float, friction: float) -> float:
        tried = [at(one * leakage, one * friction)[COORDINATES.index(name)] for one in LEVELS]
        return float(LEVELS[np.argmin(np.abs(np.array(tried) - place[COORDINATES.index(name)]))])

    def at(leakage: float, friction: float) -> Array:
        return coordinates_of(severity(leakage, friction, actuator.circuit), actuator.rated)

    leakage, friction = level("leakage", 1.0, 0.0), level("friction_rated", 0.0, 1.0)
    off = place - at(leakage, friction)
    odd = int(np.argmax(off**2 / (np.diag(CONDITION_SPREAD) + np.diag(fits.covariance))))
    return AgainstCode.OUTSIDE_CONDITIONS.note(
        leakage=round(4.0 * leakage) / 4.0,
        friction=round(4.0 * friction) / 4.0,
        part=PARTS[COORDINATES[odd]],
        ratio=float(np.exp(off[odd])),
    )
