"""`without_wrong_velocity(log, ...)`: a velocity sensor that contradicts all other channels is left out."""

from collections.abc import Sequence
from dataclasses import replace

from estimation.eha.result import BulkModulusEstimate
from estimation.log_checks.channel_names import POSITION, VELOCITY
from estimation.log_checks.clean import CleanLog
from estimation.log_checks.late_velocity import velocity_difference, wrong_gain_explains
from estimation.notes import RigCode, SensorCode
from faults.notes import ClassCode
from plant.notes import Note

GAIN_SHARE = 0.5
"""Share of the difference between position and integrated velocity from which it is due to a wrong gain [fraction];
judged."""


def without_wrong_velocity(
    log: CleanLog, against: Sequence[Note], estimate: BulkModulusEstimate, strange: Sequence[Note]
) -> CleanLog | None:
    """Return a log without a velocity that froze or contradicts position, if the flow balance confirms that.

    A wrong position breaks the balance with motor speed and pressure. Only its gain may go unnoticed, and only if a
    worn pump may: at one motor speed. Then the log does not say which of the two sensors is wrong.

    Parameters
    ----------
    log : CleanLog
        The log after its checks.
    against : sequence of Note
        Reasons against its class.
    estimate : BulkModulusEstimate
        Bulk modulus, and what was found with it.
    strange : sequence of Note
        Notes on rig, oil and logger.

    Returns
    -------
    CleanLog or None
        The log, with notes; None if velocity is right, or position may be wrong.
    """
    record, froze = log.record, log.objections_to((VELOCITY,))
    confirmed = estimate.form == "flow" and estimate.gate.passed and estimate.explanation is None
    if VELOCITY not in record or POSITION not in record or not confirmed:
        return None
    if not froze and all(note.code is not SensorCode.SENSORS_DISAGREE for note in against):
        return None
    worn = any(note.code is RigCode.WEAR_NOT_EXCLUDED for note in strange)
    if worn and wrong_gain_explains(record) > GAIN_SHARE:
        return None
    said = ClassCode.VELOCITY_CONTRADICTED.note(channel=VELOCITY, difference_m_s=velocity_difference(record))
    return replace(
        log,
        record=record.replace(**{VELOCITY: None}),
        left_out=(*log.left_out, *froze, said),
        objections=tuple(note for note in log.objections if note not in froze),
    )
