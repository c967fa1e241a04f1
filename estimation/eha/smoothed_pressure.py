"""`told_if_smoothed(found, record)`: a fit that is refused, where a filter took the noise by which fits are judged."""

from dataclasses import replace

from estimation.eha.result import BulkModulusEstimate
from estimation.log_checks.channel_names import PRESSURE
from estimation.log_checks.filtered import is_smoothed
from estimation.notes import EstimateCode
from plant.log.record import Record

JUDGED_BY_NOISE = {EstimateCode.PRESSURE_RESIDUALS_LARGE, EstimateCode.PRESSURE_RESIDUALS_CORRELATED}
"""Reasons that compare residuals with the sensor's noise."""


def told_if_smoothed(found: BulkModulusEstimate, record: Record) -> BulkModulusEstimate:
    """Return an estimate that names a filter of the pressure first, if it is refused for what noise does not explain.

    The noise of a smoothed channel does not show what its filter left out, so no check can tell.

    Parameters
    ----------
    found : BulkModulusEstimate
        The estimate.
    record : Record
        The log.
    """
    refused = any(note.code in JUDGED_BY_NOISE for note in found.gate.reasons)
    if not refused or PRESSURE not in record or not is_smoothed(record[PRESSURE]):
        return found
    said = EstimateCode.PRESSURE_SMOOTHED.note(channel=PRESSURE)
    return replace(found, gate=replace(found.gate, reasons=(said, *found.gate.reasons)))
