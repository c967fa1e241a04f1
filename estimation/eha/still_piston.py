"""`unless_stuck(...)`: what a piston that stands still says of bulk modulus, and what it does not.

A motion confirms the units of speed and pressure: the piston goes as far as it is pumped, and slides from the pressure
on that friction takes. Oil that is compressed behind a piston that stands still is known on their scale alone.
"""

from dataclasses import replace
from math import log as ln

from estimation.eha.result import BulkModulusEstimate, without_number
from estimation.finding import Outcome
from estimation.fits.flow.misread import KIN
from estimation.log_checks.standstill import travels
from estimation.notes import EstimateCode
from plant.eha.model import EhaParameters
from plant.log.record import Record
from plant.notes import Note


def at_rest_throughout(record: Record, p: EhaParameters) -> tuple[Note, ...]:
    """Return the objection to a log in which neither pump nor piston moves.

    Parameters
    ----------
    record : Record
        The log.
    p : EhaParameters
        The healthy actuator.

    Returns
    -------
    tuple of Note
        Empty where one of them moves.
    """
    gone = travels(record, p)
    return (EstimateCode.NOTHING_MOVES.note(),) if gone is not None and gone.at_rest else ()


def unless_stuck(found: BulkModulusEstimate, record: Record, p: EhaParameters) -> BulkModulusEstimate:
    """Return an estimate with what a piston that stands still leaves open.

    Parameters
    ----------
    found : BulkModulusEstimate
        The estimate. One without a value stays as it is.
    record : Record
        Its log.
    p : EhaParameters
        The healthy actuator.

    Returns
    -------
    BulkModulusEstimate
        Without a number where the oil is no kin of the rig file's.
    """
    gone = travels(record, p)
    if found.value is None or gone is None or not gone.still:
        return found
    said = (EstimateCode.PISTON_STANDS_STILL.note(moved_m=gone.piston, pumped_m=gone.pump),) if gone.stuck else ()
    if abs(ln(found.value / p.bulk_modulus)) < ln(KIN):
        return replace(found, remarks=(*found.remarks, *said))
    reasons = (*said, EstimateCode.STILL_AND_FOREIGN.note(ratio=found.value / p.bulk_modulus), *found.gate.reasons)
    return without_number(Outcome.NOT_OBSERVABLE, reasons, found.form, found.channels, found.bound)
