"""`corrected_case(log, rig, estimate)`: a log and its rig without the effects that the estimate found in them."""

from dataclasses import replace
from typing import NamedTuple

from estimation.eha.another_rod import is_of_another_rod
from estimation.eha.entrained_air import with_air
from estimation.eha.estimate import explanation_and_remarks, rejection_notes
from estimation.eha.explanation_notes import (
    FAULTS_BEYOND_CONDITIONS,
    corrected_log,
    corrected_rig,
    log_at_pump_speed,
    log_with_means_in_time,
)
from estimation.eha.result import BulkModulusEstimate
from estimation.eha.rig_share import SOFT_OIL_RATIO
from estimation.log_checks.clean import CleanLog
from estimation.notes import RigCode
from plant.eha.model import EhaParameters
from plant.eha.rig import Rig
from plant.notes import Note


class CorrectedCase(NamedTuple):
    """A log and its rig, corrected for the effects that explain the log.

    Parameters
    ----------
    log : CleanLog
        The log.
    rig : Rig
        The actuator around which circuits are fitted: it has the measured oil if that contains air or is unlike the
        file's.
    healthy : EhaParameters
        The actuator that severities are relative to.
    written : EhaParameters
        The actuator as its rig file has it.
    estimate : BulkModulusEstimate
        The estimate of the log.
    strange : tuple of Note
        Notes on rig, oil and logger.
    """

    log: CleanLog
    rig: Rig
    healthy: EhaParameters
    written: EhaParameters
    estimate: BulkModulusEstimate
    strange: tuple[Note, ...]

    @property
    def with_whole_oil(self) -> EhaParameters:
        """The actuator with the bulk modulus of its oil, air included: nominal models know no air."""
        if self.healthy.bulk_modulus == self.rig.parameters.bulk_modulus or self.estimate.value is None:
            return self.healthy
        return replace(self.healthy, bulk_modulus=self.estimate.value)

    @property
    def doubts(self) -> tuple[Note, ...]:
        """Reasons against all nine conditions before a circuit is fitted."""
        outside = (note for note in self.strange if note.code in FAULTS_BEYOND_CONDITIONS or is_of_another_rod(note))
        return (*rejection_notes(self.estimate), *outside, *self.log.objections)


def corrected_case(log: CleanLog, rig: Rig, estimate: BulkModulusEstimate) -> CorrectedCase:
    """Return a log and its rig, corrected by what the estimate found.

    Parameters
    ----------
    rig : Rig
        The actuator as its rig file has it.
    """
    written = rig.parameters
    strange = explanation_and_remarks(estimate, written)
    log = log_with_means_in_time(log_at_pump_speed(log, estimate.turning), estimate.mean_late)
    if estimate.explanation is not None:
        log = corrected_log(log, estimate.explanation)
        rig = replace(rig, parameters=corrected_rig(rig.parameters, estimate.explanation))
    healthy = rig.parameters
    around = with_air(healthy, estimate.explanation)
    of_oil = around.bulk_modulus if around is not healthy else estimate.value
    if (other := _other_oil_note(of_oil, estimate, healthy)) is not None:
        strange = (*strange, other)
        around = replace(around, bulk_modulus=of_oil)
    return CorrectedCase(log, replace(rig, parameters=around), healthy, written, estimate, strange)


def _other_oil_note(value: float | None, estimate: BulkModulusEstimate, healthy: EhaParameters) -> Note | None:
    """Return a note if the oil, without its air, is unlike the rig's: the circuit is fitted around the measured oil.

    Stiff oil is no fault. Soft oil shows in its severity, the air that would make it so soft.
    """
    if not estimate.gate.passed or value is None:
        return None
    ratio = value / healthy.bulk_modulus
    if SOFT_OIL_RATIO <= ratio <= 1.0 / SOFT_OIL_RATIO:
        return None
    return (RigCode.OIL_SOFTER if ratio < 1.0 else RigCode.OIL_STIFFER).note(ratio=ratio)
