"""Without pressure: whether a circuit is outside the nine conditions by more than its own model error.

With pressure, a lasting model error is part of how far a circuit may be outside the nine
(`class_regions.ClassFits.told`), since a flow balance tests for other faults. Without it, circuits with such faults are
compared first (`other_faults`); the error counts only if none of them explains the log.
"""

from collections.abc import Sequence
from dataclasses import replace

from faults.diagnosis.circuits.actuator import Actuator
from faults.diagnosis.circuits.blocks import Blocks
from faults.diagnosis.circuits.class_regions import ClassFits, nearest_score
from faults.diagnosis.circuits.model_doubt import lasting_misfit
from faults.diagnosis.circuits.out_of_model import FARTHEST_OUT
from faults.notes import AgainstCode
from plant.notes import Note

OUTSIDE_CODES = (AgainstCode.OUTSIDE_CONDITIONS, AgainstCode.BETWEEN_CONDITIONS)
"""Objections to a circuit outside the nine conditions."""


def is_only_outside(against: Sequence[Note]) -> bool:
    """Return whether the only objection to the nine is that the circuit is outside them.

    Returns
    -------
    bool
        Also True if there is no objection.
    """
    return all(note.code in OUTSIDE_CODES for note in against)


def is_outside_conditions(blocks: Blocks, fits: ClassFits, actuator: Actuator) -> bool:
    """Return whether circuits are outside the nine conditions by more than a lasting model error.

    Returns
    -------
    bool
        Whether the nearest condition's region contains none of them.
    """
    lasting = max(fits.lasting, lasting_misfit(fits.best.fitted, blocks))
    return nearest_score(replace(fits, lasting=lasting), blocks, actuator) < -FARTHEST_OUT
