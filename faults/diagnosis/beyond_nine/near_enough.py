"""Without pressure: does a circuit lie outside the nine conditions by more than its own model error.

Where pressure is logged, a model error that lasts is counted in how far a circuit may lie beside the nine
(`class_regions.ClassFits.told`), as a balance of flows looks for other faults. Without, circuits with such faults are
laid beside the log first (`other_faults`); only where none explains it the error counts.
"""

from collections.abc import Sequence
from dataclasses import replace

from faults.diagnosis.circuits.actuator import Actuator
from faults.diagnosis.circuits.blocks import Blocks
from faults.diagnosis.circuits.class_regions import ClassFits, how_near, lasting_misfit
from faults.diagnosis.circuits.out_of_model import FARTHEST_OUT
from faults.notes import AgainstCode
from plant.notes import Note

BESIDE = (AgainstCode.OUTSIDE_CONDITIONS, AgainstCode.BETWEEN_CONDITIONS)
"""What is said of a circuit beside the nine conditions."""


def only_beside(against: Sequence[Note]) -> bool:
    """Return whether the only objection to the nine is that the circuit lies outside them.

    Returns
    -------
    bool
        Whether it is so; also where nothing does.
    """
    return all(note.code in BESIDE for note in against)


def lies_beside(blocks: Blocks, fits: ClassFits, actuator: Actuator) -> bool:
    """Return whether circuits lie outside the nine conditions by more than a lasting model error.

    Parameters
    ----------
    blocks : Blocks
        The log.
    fits : ClassFits
        The circuits fitted to it.
    actuator : Actuator
        The healthy actuator.

    Returns
    -------
    bool
        Whether the nearest condition's region holds none of them.
    """
    lasting = max(fits.lasting, lasting_misfit(fits.best.fitted, blocks))
    return how_near(replace(fits, lasting=lasting), blocks, actuator) < -FARTHEST_OUT
