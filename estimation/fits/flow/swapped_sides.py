"""`swapped_sides(plain, strange, ...)`: a single rod whose rig file has sides A and B the wrong way round.

Side A fills when the pump turns forwards. A file that takes it for the other side describes an actuator whose log no
search explains, or one with the inverse ratio of areas.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

from estimation.fits.flow.plain import FitStart, Logged, PlainFits, plain_fits
from estimation.fits.hypotheses import Hypothesis
from estimation.fits.hypothesis_search.explanation import Explanation
from plant.eha.model import EhaParameters
from plant.notes import Code, Note


class SidesCode(Code):
    """Notes on which side of a single rod is which."""

    SIDES_SWAPPED = (
        "the log is explained with sides A and B of the rig file exchanged: exchange the two numbers of piston_area, "
        "and those of chamber_volume (side A fills when the pump turns forwards)"
    )


def swapped_sides(
    plain: PlainFits,
    strange: Explanation | None,
    logged: Logged,
    begun: Sequence[Hypothesis],
    explained: Callable[[PlainFits, Sequence[Hypothesis]], Explanation | None],
) -> tuple[Note, ...]:
    """Return a note if a log that its rig file does not explain is explained with the sides exchanged.

    Parameters
    ----------
    plain : PlainFits
        The log's fits by the plain form.
    strange : Explanation or None
        What explains the log with the file as it is; only another ratio of areas leaves room for exchanged sides.
    logged : Logged
        The log.
    begun : sequence of Hypothesis
        How the log may begin; none if it begins at rest.
    explained : callable
        ``explained(plain, asked)``: the explanation of a log by hypotheses, None if it is not believed.

    Returns
    -------
    tuple of Note
        None for a through rod, and if exchanged sides do not explain the log.
    """
    rig, modulus = plain.start.parameters, plain.start.bulk_modulus
    if not rig.single_rod or not _leaves_room(plain, strange, rig):
        return ()
    mirrored = replace(rig, area_difference=-rig.area_difference, volume_difference=-rig.volume_difference)
    other = plain_fits(logged, FitStart(mirrored, modulus))
    found = other.explains(other.best) or (bool(begun) and explained(other, begun) is not None)
    return (SidesCode.SIDES_SWAPPED.note(),) if found else ()


def _leaves_room(plain: PlainFits, strange: Explanation | None, rig: EhaParameters) -> bool:
    """Return whether nothing explains a log, or a rod whose larger side is the other one."""
    if strange is None:
        return not plain.explains(plain.best)
    return strange.values.get("area_difference", (rig.area_difference, 0.0))[0] * rig.area_difference < 0.0
