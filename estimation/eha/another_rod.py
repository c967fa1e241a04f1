"""A single rod that explains a log: whether its areas are known, and whether they are those of the rig file."""

import math

from estimation.eha.result import is_vague
from estimation.finding import NORMAL_95
from estimation.fits.hypothesis_search.explanation import Explanation
from estimation.notes import RigCode
from plant.eha.doubts import DEFAULT_UNCERTAINTIES
from plant.notes import Note

VAGUE_AREAS = 0.5 * max(DEFAULT_UNCERTAINTIES["piston_area"].usual)
"""Relative standard deviation of the ratio of a piston's areas from which an explanation by it is doubted [fraction]:
half that of an area in a rig file. Right ratios are known to 0.7 % at most; a wrong one, with bulk modulus 14 to 22 %
too high, to 2 to 3 %."""

THROUGH_ROD_DIFFERENCE = 0.001
"""Difference of the logarithm of a piston's two areas up to which its rod is a through rod [dimensionless]."""

ANOTHER_ROD_DIFFERENCE = 2.0 * 2.0**0.5 * max(DEFAULT_UNCERTAINTIES["piston_area"].usual)
"""Difference of that logarithm between fit and rig file from which the areas are not the file's [dimensionless]: two
deviations."""


def vague_area_notes(found: Explanation | None) -> tuple[Note, ...]:
    """Return the objection to an explanation by two areas whose ratio is known no better than a rig file's areas are.

    Parameters
    ----------
    found : Explanation or None
        The explanation of a log, if there is one.

    Returns
    -------
    tuple of Note
        Empty if areas are not part of it, or their ratio is known.
    """
    if found is None or "area_difference" not in found.values:
        return ()
    ratio = b_over_a(found.values["area_difference"][0])
    std = 2.0 * found.values["area_difference"][1] / (1.0 + found.values["area_difference"][0]) ** 2
    if not is_vague(ratio, std, VAGUE_AREAS):
        return ()
    return (RigCode.AREAS_VAGUE.note(percent=min(100.0 * NORMAL_95 * std / ratio, 999.0)),)


def is_of_another_rod(note: Note) -> bool:
    """Return whether a note reports areas that contradict a rig file with a single rod.

    An error of such a rig file may be absorbed by the areas, such as a displacement 6 % off by 10 % of an area. Bulk
    modulus may then be right, but the force balance is not.
    """
    if note.code is not RigCode.SINGLE_ROD:
        return False
    told, written = (math.log(0.01 * float(note.data[name])) for name in ("percent", "rig_percent"))
    return abs(written) > THROUGH_ROD_DIFFERENCE and abs(told - written) > ANOTHER_ROD_DIFFERENCE


def b_over_a(difference: float) -> float:
    """Return side B over side A.

    Parameters
    ----------
    difference : float
        Difference of sides A and B over their sum [dimensionless].

    Returns
    -------
    float
        Side B over side A [dimensionless].
    """
    return (1.0 - difference) / (1.0 + difference)
