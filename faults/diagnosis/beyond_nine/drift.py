"""Classes of a log whose leakage drifts as with warming oil: the reference temperature is integrated out.

A rig file has the leakage at one oil temperature, which it does not state. In a log that warms, the condition at its
end differs from that at its beginning: twice a minor leakage is nearly a major one. Conditions are scored with the rig
file's oil at the end of the log, in the middle and at the beginning, and summed.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from estimation.eha.explanation_notes import LEAKAGE_COURSE
from estimation.finding import Quantity
from estimation.log_checks.clean import CleanLog
from estimation.notes import RigCode
from faults.diagnosis.beyond_nine.load import LoadedDiagnosis
from faults.diagnosis.beyond_nine.wear import with_other_faults
from faults.diagnosis.calibration import Calibration, shipped_calibration
from faults.diagnosis.changes.warming import with_leakage_course
from faults.diagnosis.circuit_verdict import Diagnosis
from faults.diagnosis.circuits.actuator import Actuator, actuator_of
from faults.diagnosis.circuits.circuit_runs import COORDINATES
from faults.diagnosis.circuits.class_fit import LASTING, misfit
from faults.diagnosis.circuits.class_regions import fit_classes
from faults.diagnosis.circuits.rivals import blocks_a_look, model_error_share
from faults.diagnosis.evidence import Scoreboard, models_scores
from faults.diagnosis.severity import severities
from faults.notes import AgainstCode
from plant.arrays import Array
from plant.notes import Note

EARLIER_PLACES = (0.5, 0.0)
"""Other places of the rig file's oil besides the end of a log [fraction of it]: over a factor of 2, as in a log that
warms by some 15 K, neighbouring places are three deviations of actuators of one kind apart, so none is farther than 1.5
away."""

OIL_OBJECTIONS = {AgainstCode.OUTSIDE_CONDITIONS, AgainstCode.BETWEEN_CONDITIONS}
"""Objections to a log with one oil, and not with another."""


def averaged_over_drift(
    diagnosed: Callable[[CleanLog], LoadedDiagnosis], log: CleanLog, notes: Sequence[Note]
) -> LoadedDiagnosis:
    """Return a diagnosis whose classes are averaged over the place in the drift of the rig file's oil.

    All places have the same prior, and count by how well the nine conditions fit the log there. An objection to the
    place of the circuit counts only if it holds at every place.

    Parameters
    ----------
    diagnosed : callable
        Gives the diagnosis of a log.
    log : CleanLog
        The corrected log.
    notes : sequence of Note
        Notes on what explains it.

    Returns
    -------
    LoadedDiagnosis
        The diagnosis at the end of the log; with the classes of all places if `LEAKAGE_DRIFTS` is among the notes, or
        if the diagnosis of a log without pressure found a drift, which is then one of its notes.
    """
    last = diagnosed(log)
    if (drift := last.diagnosis.scoreboard.drift) is not None:
        log, note = with_leakage_course(log, drift)
        last, notes = diagnosed(log), (*notes, note)
        last = last._replace(notes=(note, *last.notes))
        if note.code is RigCode.LEAKAGE_GROWS:
            return last._replace(diagnosis=replace(last.diagnosis, against=(note, *last.diagnosis.against)))
    if all(note.code is not RigCode.LEAKAGE_DRIFTS for note in notes):
        return last
    course = log.record[LEAKAGE_COURSE]
    there = [float(course[round(share * (len(course) - 1))]) for share in EARLIER_PLACES]
    found = [last.diagnosis, *(diagnosed(_with_oil_of(log, one)).diagnosis for one in there)]
    placed = next((one for one in found if _has_no_oil_objection(one)), found[0])
    calibration = shipped_calibration()
    if drift is not None:
        actuator = actuator_of(last.parameters)
        found[0] = _refitted_from_best(found, [1.0, *there], actuator, calibration)
        # a circuit within one of the nine conditions ranks first, then the one with more evidence
        ranks = [(_has_no_oil_objection(one), _evidence(one.scoreboard, calibration)) for one in found]
        likeliest = ranks.index(max(ranks))
        placed = found[likeliest] = with_other_faults(found[likeliest], actuator, calibration)
    diagnosis = replace(
        found[0],
        probabilities=averaged_probabilities(found, calibration),
        against=placed.against,
        severity={name: _severity_over_places(name, found) for name in found[0].severity},
        not_told=placed.not_told if drift is not None else found[0].not_told,
    )
    return last._replace(diagnosis=diagnosis)


def _has_no_oil_objection(one: Diagnosis) -> bool:
    return not any(note.code in OIL_OBJECTIONS for note in one.against)


def _refitted_from_best(
    found: Sequence[Diagnosis], courses: Sequence[float], actuator: Actuator, calibration: Calibration
) -> Diagnosis:
    """Return the diagnosis at the end of a log, its circuit fitted on from another place's where that follows better.

    A doubled leakage is far from all conditions, and a search from these may end too early.
    """
    misfits = [misfit(one.scoreboard.blocks, one.scoreboard.fits.best.fitted) for one in found]
    best, last = int(np.argmin(misfits)), found[0]
    if misfits[0] < misfits[best] + LASTING:
        return last
    start = found[best].scoreboard.fits.best.coordinates.copy()
    start[COORDINATES.index("leakage")] -= np.log(courses[best])
    board = last.scoreboard
    fits = fit_classes(board.blocks, actuator, start=start)
    severity = severities(fits, actuator, calibration.widths(board.blocks.pressure is not None))
    return replace(last, scoreboard=replace(board, fits=fits), severity=severity)


def averaged_probabilities(found: Sequence[Diagnosis], calibration: Calibration) -> Mapping[str, float]:
    """Return the probability of each condition over diagnoses of one log, with equal priors.

    Parameters
    ----------
    found : sequence of Diagnosis
        Diagnoses; they count by their evidences, as far as a wrong model's error lets them (`_evidence_share`), if all
        compare the same part of the log, otherwise equally.

    Returns
    -------
    Mapping[str, float]
        Probability by condition [probability].
    """
    boards = [one.scoreboard for one in found]
    counts = boards[0].blocks.counts
    alike = all(np.array_equal(board.blocks.counts, counts) for board in boards)
    shares = np.ones(len(boards))
    if alike:
        evidences = np.array([_evidence(board, calibration) for board in boards])
        shares = np.exp(min(map(_evidence_share, boards)) * (evidences - np.max(evidences)))
    each: Array = np.array([list(one.probabilities.values()) for one in found])
    return dict(zip(found[0].probabilities, (float(one) for one in shares @ each / np.sum(shares)), strict=True))


def _evidence_share(board: Scoreboard) -> float:
    """Return the share of a log's evidence that counts between places of the rig file's oil [fraction].

    Places differ by friction of a few percent, and so does a friction law from the real one. Residuals beyond noise are
    that law's error, at which a log gives few looks however long it is.
    """
    error = model_error_share(board.blocks, board.fits.best.scales)
    return float(np.min(LASTING / blocks_a_look(board.blocks, error)))


def _evidence(board: Scoreboard, calibration: Calibration) -> float:
    """Return the evidence of all conditions together, with the weights of the evidences that include the drift."""
    weights = calibration.weights(board.blocks.pressure is not None)
    best = {"parameters": float(np.max(board.fits.scores)), "models": float(np.max(models_scores(board.fits)))}
    below = np.sum([weights[name] * board.log_odds[name] for name in best], axis=0)
    return sum(weights[name] * value for name, value in best.items()) + float(np.logaddexp.reduce(below))


def _with_oil_of(log: CleanLog, leakage: float) -> CleanLog:
    """Return a log with the rig file's oil where leakage is a given ratio to that at the end."""
    course = log.record[LEAKAGE_COURSE] / leakage
    return replace(log, record=log.record.replace(**{LEAKAGE_COURSE: course}))


def _severity_over_places(name: str, found: Sequence[Diagnosis]) -> Quantity:
    """Return a severity as at the end of a log, with a total interval that includes those of all places."""
    each = [one.severity[name] for one in found]
    ends = [one.ci95 for one in each if one.ci95 is not None]
    if each[0].ci95 is None:
        return each[0]
    return replace(each[0], ci95_total=(min(low for low, _ in ends), max(high for _, high in ends)))
