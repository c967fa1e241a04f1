"""`vague_areas(found)`: a single rod that explains a log, and whose areas are known no better than a rig file's."""

from estimation.eha.explanation_notes import b_over_a
from estimation.eha.result import is_vague
from estimation.finding import NORMAL_95
from estimation.fits.hypothesis_search.explanation import Explanation
from estimation.notes import RigCode
from plant.eha.doubts import DOUBTS
from plant.notes import Note

VAGUE_AREAS = 0.5 * max(DOUBTS["piston_area"].usual)
"""Relative standard deviation of the ratio of a piston's areas from which an explanation by it is doubted [fraction]:
half that of an area in a rig file. Right ones are known to 0.7 % at most; one that was wrong, with bulk modulus 14 to
22 % too high, to 2 to 3 %."""


def vague_areas(found: Explanation | None) -> tuple[Note, ...]:
    """Return the objection to an explanation by two areas whose ratio is known no better than a rig file's areas are.

    Parameters
    ----------
    found : Explanation or None
        What explains a log, if anything does.

    Returns
    -------
    tuple of Note
        Nothing where areas are no part of it, or their ratio is known.
    """
    if found is None or "area_difference" not in found.values:
        return ()
    ratio = b_over_a(found.values["area_difference"][0])
    std = 2.0 * found.values["area_difference"][1] / (1.0 + found.values["area_difference"][0]) ** 2
    if not is_vague(ratio, std, VAGUE_AREAS):
        return ()
    return (RigCode.AREAS_VAGUE.note(percent=min(100.0 * NORMAL_95 * std / ratio, 999.0)),)
