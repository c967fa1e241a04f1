"""`rejected_if_another_rig(...)`: a log that nothing explains may be that of another actuator than the rig file's.

The piston then does not move as the file's pump would drive it.
"""

from dataclasses import replace
from math import hypot
from math import log as ln

from estimation.eha.result import BulkModulusEstimate
from estimation.finding import Outcome
from estimation.log_checks.channel_names import PRESSURE
from estimation.log_checks.channel_physics import LONG, MIDDLE, TOLD
from estimation.log_checks.clean import CleanLog
from estimation.log_checks.flow_balance import REFUTED, flow_balance
from estimation.notes import EstimateCode
from plant.eha.model import EhaParameters
from plant.log.record import Record
from plant.notes import Note

ANOTHER_RIG_DIFFERENCE = 0.3
"""Difference of the logarithm of displacement over area from that of the rig file, from which the actuator is another
one [dimensionless]. A judgement: the usual uncertainty of both is 0.07 in two deviations, and logs with their own rig
file are up to 0.28 off."""


def rig_contradiction_notes(record: Record, p: EhaParameters) -> tuple[Note, ...]:
    """Return the objection to a rig file whose pump would drive the piston otherwise than it moved.

    Leakage, flow bias and compression are free, so only displacement over area counts. If most of the flow is lost,
    motion absorbs what a balance omits, and different blocks show different ratios.

    Parameters
    ----------
    record : Record
        The log, its channels in their right units.
    p : EhaParameters
        The healthy actuator.

    Returns
    -------
    tuple of Note
        Empty if the log does not determine the ratio, if it is that of the rig file, and without pressure.
    """
    balance = flow_balance(record, p, MIDDLE)
    if balance is None or balance.rig_contradiction < REFUTED:
        return ()
    longer = flow_balance(record, p, LONG)
    std = balance.swept_std if longer is None else hypot(balance.swept_std, balance.swept - longer.swept)
    if balance.swept <= TOLD * std or abs(ln(balance.swept)) < max(ANOTHER_RIG_DIFFERENCE, TOLD * std / balance.swept):
        return ()
    return (EstimateCode.RIG_CONTRADICTED.note(percent=100.0 / balance.swept),)


def slips_or_rig_contradiction(slips: tuple[Note, ...], record: Record, p: EhaParameters) -> tuple[Note, ...]:
    """Return the wrong signs and units that a fit names, or the rig file's error if only pressure seems wrong.

    The unit of pressure does not change how far the pump moves the piston.
    """
    of_pressure = all(one.data.get("channel") == PRESSURE for one in slips)
    return (rig_contradiction_notes(record, p) if of_pressure else ()) or slips


def rejected_if_another_rig(found: BulkModulusEstimate, log: CleanLog, p: EhaParameters) -> BulkModulusEstimate:
    """Return an estimate; a mismatch without a number if it was rejected and the log contradicts the rig file.

    Parameters
    ----------
    found : BulkModulusEstimate
        The estimate. It is unchanged if it passes its check, or already contradicts the rig file.
    log : CleanLog
        Its log. If a sensor is suspected, the rig file is not tested.
    p : EhaParameters
        The healthy actuator.

    Returns
    -------
    BulkModulusEstimate
        With the rig file as the first reason, if it is one.
    """
    reasons = found.gate.reasons
    if found.gate.passed or log.objections or any(one.code == EstimateCode.RIG_CONTRADICTED for one in reasons):
        return found
    if not (said := rig_contradiction_notes(log.record, p)):
        return found
    # the bound is left out: it was computed for the wrong actuator
    spared = [one for one in reasons if one.code != EstimateCode.BOUND_TOO_WIDE]
    gate = replace(found.gate, reasons=(*said, *spared))
    return replace(found, outcome=Outcome.MISMATCH, value=None, std=None, others={}, gate=gate)
