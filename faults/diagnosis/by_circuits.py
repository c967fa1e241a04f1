"""`diagnose_clean(log, actuator) -> Diagnosis`: diagnosis by circuits, without the estimate of bulk modulus."""

from functools import partial

from estimation.log_checks.clean import CleanLog
from faults.diagnosis.beyond_nine.sound_circuit import another_sound_circuit
from faults.diagnosis.beyond_nine.wear import with_other_faults
from faults.diagnosis.calibration import Calibration, shipped_calibration
from faults.diagnosis.circuit_verdict import Diagnosis
from faults.diagnosis.circuits.actuator import Actuator
from faults.diagnosis.circuits.class_regions import nearest_score
from faults.diagnosis.circuits.open_classes import circuits_left_open
from faults.diagnosis.circuits.out_of_model import reasons_against
from faults.diagnosis.circuits.two_sensors import sensor_disagreements
from faults.diagnosis.evidence import weigh_evidence
from faults.diagnosis.not_told import not_told_notes
from faults.diagnosis.severity import healthy_severities, limits_of, severities


def diagnose_clean(log: CleanLog, actuator: Actuator, calibration: Calibration | None = None) -> Diagnosis:
    """Diagnose a log whose sensors have been checked, by all evidences, without its estimate of bulk modulus.

    Parameters
    ----------
    log : CleanLog
        Motor speed, and position or velocity; differential pressure where it is logged.
    calibration : Calibration, optional
        Fitted numbers; those shipped if not given.

    Returns
    -------
    Diagnosis
        Evidence for each class, and against all.

    Raises
    ------
    LogError
        If the log has neither position nor velocity, or is too short.
    """
    numbers = shipped_calibration() if calibration is None else calibration
    found = _diagnose_around(log, actuator, numbers)
    if found.circuit_follows:
        return found
    other = another_sound_circuit(found.scoreboard.blocks, found.scoreboard.fits, actuator)
    return found if other is None else _diagnose_around(log, other, numbers)


def _diagnose_around(log: CleanLog, actuator: Actuator, numbers: Calibration) -> Diagnosis:
    """Return the diagnosis of a log around one healthy circuit."""
    board = weigh_evidence(log.record, actuator)
    pressure = board.blocks.pressure is not None
    region = nearest_score(board.fits, board.blocks, actuator)
    against = (
        *log.objections,
        *board.against,
        *sensor_disagreements(board.window, board.blocks),
        *reasons_against(board.blocks, board.fits, region, actuator),
    )
    probabilities = board.probabilities(numbers)
    circuits = circuits_left_open(board.blocks, board.fits, actuator, probabilities)
    told_by = partial(severities, board.fits, actuator, numbers.widths(pressure), circuits)
    severity = told_by(None, None)
    found = Diagnosis(
        probabilities,
        against,
        severity,
        dict(healthy_severities(actuator)),
        dict(limits_of(actuator)),
        tuple(not_told_notes(board.fits, severity, pressure=pressure)),
        board,
        told_by,
    )
    # if leakage drifts, `averaged_over_drift` diagnoses the log again, and weighs other faults then
    drifts = board.drift is not None or board.blocks.leakage_course is not None
    return found if drifts else with_other_faults(found, actuator, numbers)
