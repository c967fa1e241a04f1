"""`diagnose_log(record, rig) -> Finding`: which condition, how probable, how bad, or "unknown" and why.

It continues `estimation.eha.estimate.estimate_log`: the log is checked once and bulk modulus is estimated once. If the
gate rejects the fit, the class is unknown for the same reasons.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import inf
from typing import NamedTuple

import numpy as np

from estimation.eha.bulk_modulus import FITTED, EstimateOptions
from estimation.eha.entrained_air import amount_of_air
from estimation.eha.estimate import checked_estimate, finding_of
from estimation.eha.result import BulkModulusEstimate
from estimation.eha.rig_share import scaled_responses, with_total
from estimation.finding import Finding, Outcome, Quantity
from estimation.log_checks.channel_names import PRESSURE
from estimation.log_checks.clean import CleanLog, clean_log
from estimation.notes import ChannelCode, RigCode
from faults.diagnosis.advice import advice_for, oil_advice, rig_advice, sensor_advice
from faults.diagnosis.beyond_nine.accumulator import with_fitted_accumulator
from faults.diagnosis.beyond_nine.another_oil import with_stiffer_oil
from faults.diagnosis.beyond_nine.balance_refused import class_without_balance
from faults.diagnosis.beyond_nine.drift import averaged_over_drift
from faults.diagnosis.beyond_nine.left_open import likelier_fault_notes, with_unseen_valve
from faults.diagnosis.beyond_nine.load import LoadedDiagnosis, with_rod_load
from faults.diagnosis.beyond_nine.near_enough import OUTSIDE_CODES
from faults.diagnosis.beyond_nine.wear import with_pump_delivery
from faults.diagnosis.by_circuits import diagnose_clean
from faults.diagnosis.circuit_verdict import Diagnosis
from faults.diagnosis.circuits.actuator import actuator_of
from faults.diagnosis.circuits.blocks import LONGEST
from faults.diagnosis.corrected_case import CorrectedCase, corrected_case
from faults.diagnosis.doubtful_entries import doubtful_entries
from faults.diagnosis.failed_search import doubts_after_fit
from faults.diagnosis.known_losses import with_balance_severities
from faults.diagnosis.models_verdict import models_verdict, ranked_conditions, without_condition
from faults.diagnosis.not_told import standstill_notes, without_undetermined
from faults.diagnosis.rmse import Scores, score_mathematical
from faults.diagnosis.severity import healthy_severities, limits_of, with_bulk_modulus
from faults.diagnosis.severity_total import with_totals
from faults.diagnosis.wrong_velocity import without_wrong_velocity
from faults.eha.bank import mathematical_bank
from faults.notes import ClassCode
from plant.eha.model import EhaParameters
from plant.eha.rig import Rig
from plant.errors import LogError, RigError
from plant.log.record import Record
from plant.notes import Note, distinct
from plant.spare_processors import start_if_idle


@dataclass(frozen=True, eq=False)
class EhaEvidence:
    """Results of the engines behind a finding.

    Parameters
    ----------
    estimate : BulkModulusEstimate
        Bulk modulus, and what was found with it.
    scores : Scores
        Errors of the nine nominal models.
    diagnosis : Diagnosis or None
        The fitted circuit and its classes; None if no circuit fits around the rig, or the log is too short.
    transfer_functions : Scores or None
        Errors of nine transfer functions, if requested.
    """

    estimate: BulkModulusEstimate
    scores: Scores
    diagnosis: Diagnosis | None
    transfer_functions: Scores | None = None


def diagnose_log(record: Record, rig: Rig, seen: tuple[CleanLog, BulkModulusEstimate] | None = None) -> Finding:
    """Diagnose a log: bulk modulus, its gate, the condition, and how bad it is.

    Parameters
    ----------
    record : Record
        Motor speed, and position or velocity; differential pressure if it is logged.
    rig : Rig
        The healthy actuator.
    seen : tuple of CleanLog and BulkModulusEstimate, optional
        Result of `estimation.eha.estimate.checked_estimate` for this log with default options; computed if not given.

    Returns
    -------
    Finding
        Its evidence is an `EhaEvidence`. If no circuit fits around the rig, there is a condition without probabilities.
        If the log is too short for a circuit, there is no condition.

    Raises
    ------
    LogError
        If the log has neither position nor velocity, or cannot be estimated.
    """
    log = clean_log(record, rig.parameters) if seen is None else seen[0]
    asked = seen is None and not log.mistakes  # otherwise not needed, or the mistake is known
    plain = _begin_plain(log, rig.parameters) if asked else _Plain(log, rig.parameters, None, None)
    estimate = checked_estimate(log, rig, EstimateOptions())[1] if seen is None else seen[1]
    found, case = finding_of(log, estimate, rig), corrected_case(log, rig, estimate)
    again, cleaned = partial(diagnose_log, record, rig), log
    if (sound := without_wrong_velocity(cleaned, (), estimate, case.strange)) is not None:  # it froze or reads 0
        return again((sound, estimate))
    log, rig = case.log, case.rig
    scores = plain.scores_of(log, case.with_whole_oil)
    verdict = models_verdict(scores, log.record)
    absent = () if PRESSURE in scores.channels else (ClassCode.PRESSURE_ABSENT_CLASS.note(),)
    strange = case.strange
    if verdict.outcome is Outcome.NOT_OBSERVABLE:  # the log does not determine what a worn pump would change
        strange = tuple(note for note in strange if note.code is not RigCode.WEAR_NOT_EXCLUDED)
    notes = (*log.left_out, *strange, *verdict.notes, *absent, *doubtful_entries(plain.parameters), *estimate.rig_notes)
    found = replace(found, outcome=verdict.outcome, notes=notes, channels=scores.channels)
    if mistakes := log.mistakes or tuple(one for one in estimate.gate.reasons if isinstance(one.code, ChannelCode)):
        return replace(_without_class(found, log, scores, mistakes), outcome=Outcome.MISMATCH)
    if verdict.outcome is not Outcome.OK:
        return replace(found, evidence=EhaEvidence(estimate, scores, None))
    try:
        judged = partial(_diagnose_with_delivery, parameters=rig.parameters, case=case, plain=plain)
        diagnosis, around, named = averaged_over_drift(judged, log, case.strange)
    except LogError as error:
        return without_condition(replace(found, evidence=EhaEvidence(estimate, scores, None)), error)
    except RigError as error:
        without = _without_class(found, log, scores, distinct((*case.doubts, *verdict.against)))
        return replace(without, notes=(*found.notes, ClassCode.NO_CIRCUIT.note(reason=error.message)))
    if (sound := without_wrong_velocity(cleaned, diagnosis.against, estimate, case.strange)) is not None:
        return again((sound, estimate))
    diagnosis = with_balance_severities(_with_rig_oil(diagnosis, case.healthy), estimate, log.record, case.healthy)
    found = replace(found, notes=(*found.notes, *named), evidence=EhaEvidence(estimate, scores, diagnosis))
    left = doubts_after_fit(case.doubts, estimate, log, around, diagnosis.scoreboard)
    stands = class_without_balance(left, diagnosis, estimate, actuator_of(around))
    if stands is not None:
        left, found = (), replace(found, notes=(*found.notes, stands))
    still = standstill_notes(log.record, case.healthy, diagnosis.not_told)
    return _with_class(found, case, diagnosis, _reasons_against(diagnosis, left, still, verdict.against))


def _reasons_against(
    diagnosis: Diagnosis, left: Sequence[Note], still: Sequence[Note], misfits: Sequence[Note]
) -> tuple[Note, ...]:
    """Return the reasons against all nine conditions once circuits are fitted.

    ``left`` are the doubts that the circuits leave, ``still`` those of a piston that stands still, and ``misfits``
    those of the nominal models.
    """
    # a piston that stands still shows no friction, so friction cannot be outside the nine conditions
    follow = tuple(note for note in diagnosis.against if not (still and note.code in OUTSIDE_CODES))
    against = distinct((*still, *left, *follow))
    # other oil also makes the nominal models misfit, so their misfit is no objection by itself, but it supports others
    if against and not still:
        against = distinct((*against, *misfits))
    return distinct((*against, *likelier_fault_notes(diagnosis.probabilities, diagnosis.not_told)))


def _with_class(found: Finding, case: CorrectedCase, diagnosis: Diagnosis, against: tuple[Note, ...]) -> Finding:
    """Return a finding with its condition, how bad it is, and what to do."""
    notes, board = found.notes, diagnosis.scoreboard
    if (stop := board.blocks.stop) is not None:
        notes = (*notes, ClassCode.END_STOP.note(reach_mm=1e3 * stop))
    pressure = PRESSURE in found.channels
    severity = _severities(diagnosis, case.estimate, case.healthy, case.rig, pressure=pressure)
    not_told = (*diagnosis.not_told, *found.not_told)
    if severity["bulk_modulus"].value is not None and not _is_oil_from_circuit(case.estimate, pressure=pressure):
        not_told = tuple(note for note in not_told if note.code is not ClassCode.BULK_MODULUS_NOT_VISIBLE)
    severity = without_undetermined(severity, [note.code for note in not_told])
    known = case.estimate.gate.passed and not against
    oil = oil_advice(severity, diagnosis.healthy, diagnosis.limits, case.healthy.chamber_volume) if known else ()
    entries = rig_advice(case.strange, case.healthy, case.written)
    unclear = (*diagnosis.not_told, *found.not_told)
    further = advice_for(case.log.record, diagnosis.probabilities, against, unclear, found.channels)
    probabilities, stuck = with_unseen_valve(diagnosis.probabilities, found.not_told)
    return replace(
        found,
        notes=notes,
        condition=diagnosis.condition,
        probabilities=probabilities,
        unknown=bool(against),
        against=against,
        severities=severity,
        healthy=diagnosis.healthy,
        not_told=(*not_told, *stuck),
        since=board.onset,
        advice=(*oil, *entries, *sensor_advice(case.log.left_out), *further),
    )


def _with_rig_oil(diagnosis: Diagnosis, healthy: EhaParameters) -> Diagnosis:
    """Return a diagnosis whose bulk modulus is compared with the rig's oil, even if circuits are fitted around another.

    Otherwise oil half as stiff as the rig's would be compared with itself, and be within its limit.
    """
    if diagnosis.healthy["bulk_modulus"] == healthy.bulk_modulus:
        return diagnosis
    sound = actuator_of(healthy)
    of_oil = {"bulk_modulus": healthy_severities(sound)["bulk_modulus"]}
    limit = {"bulk_modulus": limits_of(sound)["bulk_modulus"]}
    return replace(diagnosis, healthy={**diagnosis.healthy, **of_oil}, limits={**diagnosis.limits, **limit})


class _Plain(NamedTuple):
    """Diagnosis and nominal models of the log as read, around the rig as its file states: most logs need no others.

    They run beside the estimate of bulk modulus, which may correct log and rig; then they are not used. If the
    corrections are already known, nothing is started.
    """

    log: CleanLog
    parameters: EhaParameters
    result: Callable[[], Diagnosis] | None
    scores: Callable[[], Scores] | None

    def of(self, log: CleanLog, parameters: EhaParameters) -> Diagnosis:
        if self.result is not None and self._has(log, parameters):
            return self.result()
        return _diagnose_clean_log(log, parameters)

    def scores_of(self, log: CleanLog, parameters: EhaParameters) -> Scores:
        if self.scores is not None and self._has(log, parameters):
            return self.scores()
        return _scores_of(log, parameters)

    def _has(self, log: CleanLog, parameters: EhaParameters) -> bool:
        return log is self.log and parameters == self.parameters


def _begin_plain(log: CleanLog, parameters: EhaParameters) -> _Plain:
    works = partial(_diagnose_clean_log, log, parameters), partial(_scores_of, log, parameters)
    return _Plain(log, parameters, start_if_idle(works[0]), start_if_idle(works[1]))


def _scores_of(log: CleanLog, parameters: EhaParameters) -> Scores:
    """Return the errors of the nine nominal models on a log, or on its beginning if a channel is wrong."""
    record = log.record.slice(0, round(LONGEST / log.record.sample_time) + 1) if log.mistakes else log.record
    return score_mathematical(record, mathematical_bank(parameters))


def _diagnose_clean_log(log: CleanLog, parameters: EhaParameters) -> Diagnosis:
    return diagnose_clean(log, actuator_of(parameters))


def _diagnose_with_delivery(
    log: CleanLog, parameters: EhaParameters, case: CorrectedCase, plain: _Plain
) -> LoadedDiagnosis:
    """Return a diagnosis with the pump delivery from the flow balance."""
    around = partial(_diagnose_around, log, estimate=case.estimate, plain=plain)
    found = with_fitted_accumulator(around(parameters), around)
    told = with_pump_delivery(found.diagnosis, actuator_of(found.parameters), case.estimate, case.strange)
    return found._replace(diagnosis=told)


def _diagnose_around(
    log: CleanLog, parameters: EhaParameters, estimate: BulkModulusEstimate, plain: _Plain
) -> LoadedDiagnosis:
    """Return a diagnosis; under a load if the flow balance holds and the force balance shows one, else in stiff oil."""

    def of(tried: EhaParameters, doubt: float) -> Diagnosis:
        if doubt > 0.0:
            return diagnose_clean(log, replace(actuator_of(tried), load_doubt=doubt))
        return plain.of(log, tried)

    if estimate.form == "flow" and estimate.gate.passed:
        return with_rod_load(of, parameters, estimate)
    if estimate.form in FITTED:  # no bulk modulus is known
        return with_stiffer_oil(of, parameters)
    return LoadedDiagnosis(of(parameters, 0.0), parameters)


def _severities(
    diagnosis: Diagnosis, estimate: BulkModulusEstimate, healthy: EhaParameters, rig: Rig, *, pressure: bool
) -> Mapping[str, Quantity]:
    """Return the severities, with the estimated bulk modulus and the uncertainty of the rig."""
    oil = estimate.quantity
    if _is_oil_from_circuit(estimate, pressure=pressure):
        laws = scaled_responses(healthy, {}, pressure=pressure)["bulk_modulus"]
        oil = with_total(diagnosis.severity["bulk_modulus"], laws, estimate.spreads)
    found = with_bulk_modulus(diagnosis.severity, oil, actuator_of(healthy))
    air = amount_of_air(estimate.explanation, estimate.responses.get("bulk_modulus"), estimate.spreads)
    found = found if air is None else {**found, "entrained_air": air}
    logged = diagnosis.scoreboard.blocks.pressure
    reached = inf if logged is None else float(np.nanmax(np.abs(logged)))
    return with_totals(found, actuator_of(rig.parameters), estimate.spreads, pressure=pressure, reached=reached)


def _without_class(found: Finding, log: CleanLog, scores: Scores, against: tuple[Note, ...]) -> Finding:
    """Return the verdict without a fitted circuit: the nearest model's name, and the reasons against it."""
    return replace(
        found,
        condition=ranked_conditions(scores)[0][0],
        unknown=bool(against),
        against=against,
        advice=advice_for(log.record, {}, against, (), scores.channels),
        evidence=EhaEvidence(found.evidence, scores, None),
    )


def _is_oil_from_circuit(estimate: BulkModulusEstimate, *, pressure: bool) -> bool:
    """Return whether bulk modulus is the circuit's: a filter, or a fit of motion without pressure, was rejected."""
    return not estimate.gate.passed and not (pressure and estimate.form == "flow")
