"""The balance of flows judges the pump, and where a log does not tell what it delivers, that is integrated out.

Where pressure is logged, the balance says what the pump delivers, or that the log does not tell
(`estimation.fits.flow.fit`). It follows the oil to the sensors' noise, and a circuit follows the piston to a few
percent: what a circuit says of the pump beside a balance that holds is what it leaves of friction. Without pressure,
circuits with a worn pump are compared (`other_faults`). If a log does not tell, a pump that delivers less leaves less
leakage to it, and bulk modulus is larger by as much.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from estimation.eha.result import BulkModulusEstimate
from estimation.eha.rig_share import wear_left_open
from estimation.fits.hypotheses import OFFSET
from faults.diagnosis.beyond_nine.near_enough import lies_beside, only_beside
from faults.diagnosis.beyond_nine.other_faults import DELIVERIES, faults_outside, presumed_of_wear
from faults.diagnosis.calibration import Calibration, shipped_calibration
from faults.diagnosis.circuit_verdict import Diagnosis
from faults.diagnosis.circuits.actuator import Actuator
from faults.diagnosis.circuits.class_regions import fit_classes, is_stuck
from faults.diagnosis.evidence import Scoreboard, bounded
from faults.notes import AgainstCode
from plant.arrays import Array
from plant.notes import Note

OFFSETS = {OFFSET.name, "pressure_drift"}
"""Hypotheses that an offset of the speed may pass for."""


def whatever_the_pump_delivers(diagnosis: Diagnosis, actuator: Actuator, estimate: BulkModulusEstimate) -> Diagnosis:
    """Return a diagnosis with what the balance of flows says of the pump.

    Parameters
    ----------
    diagnosis : Diagnosis
        Of a circuit alone.
    actuator : Actuator
        The healthy actuator, with a pump that delivers what the balance found.
    estimate : BulkModulusEstimate
        The balance, and what it leaves open.

    Returns
    -------
    Diagnosis
        Where the balance tells what the pump delivers, without the circuit's doubt of it; where it leaves that open,
        with classes weighed over it (`probabilities_over_wear`); else, and without pressure, the same.
    """
    if known := known_of_flow(estimate):
        return replace(diagnosis, against=tuple(note for note in diagnosis.against if note.code not in known))
    found = probabilities_over_wear(diagnosis.scoreboard, actuator, estimate.remarks, shipped_calibration())
    if found is None:
        return diagnosis
    return replace(diagnosis, probabilities=found)


def whatever_fault(diagnosis: Diagnosis, actuator: Actuator, calibration: Calibration) -> Diagnosis:
    """Return a diagnosis with what is said of faults outside the nine conditions, without pressure.

    Parameters
    ----------
    diagnosis : Diagnosis
        Of circuits without such a fault.
    actuator : Actuator
        The healthy actuator.
    calibration : Calibration
        Weights of the evidences.

    Returns
    -------
    Diagnosis
        With the fault that the log shows, those that it does not tell, and classes weighed over a worn pump where that
        is one of these: they sum to the probability that none of these faults is there, which are none of the nine. The
        same with pressure, of a piston that sticks, and where more than a place beside the nine (`near_enough`) speaks
        against them already.
    """
    board = diagnosis.scoreboard
    asked = board.blocks.pressure is None and not is_stuck(board.blocks, actuator)
    if not asked or not only_beside(diagnosis.against):
        return diagnosis
    others = faults_outside(board.blocks, board.fits, actuator)
    beside = diagnosis.against if diagnosis.against and lies_beside(board.blocks, board.fits, actuator) else ()
    if others.against or beside:
        return replace(diagnosis, against=(*others.against, *beside))
    probabilities = diagnosis.probabilities
    if others.worn is not None:
        probabilities = summed_over_wear(board, others.worn, calibration)
    return replace(
        diagnosis,
        probabilities={name: (1.0 - others.faulty) * share for name, share in probabilities.items()},
        against=(),
        not_told=(*diagnosis.not_told, *others.open),
    )


def known_of_flow(estimate: BulkModulusEstimate) -> frozenset[AgainstCode]:
    """Return what the balance of flows knows better than a circuit.

    Parameters
    ----------
    estimate : BulkModulusEstimate
        Of a log.

    Returns
    -------
    frozenset of AgainstCode
        What the pump delivers, if this is a balance that holds and does not leave wear open; and whether motor speed is
        offset, unless an offset of the pressure, which leaks as much, was found in its place. None else.
    """
    if estimate.form != "flow" or not estimate.gate.passed or wear_left_open(estimate.remarks):
        return frozenset()
    names = estimate.explanation.names if estimate.explanation is not None else ()
    return frozenset({AgainstCode.PUMP_OFF} if OFFSETS & set(names) else {AgainstCode.PUMP_OFF, AgainstCode.SPEED_BIAS})


def probabilities_over_wear(
    board: Scoreboard, actuator: Actuator, remarks: Sequence[Note], calibration: Calibration
) -> Mapping[str, float] | None:
    """Return the probability of each condition, whatever the pump delivers, where a log does not tell.

    The conditions are scored again for pumps that deliver `DELIVERIES` of their displacement; see `summed_over_wear`.

    Parameters
    ----------
    board : Scoreboard
        The evidences of a sound pump.
    actuator : Actuator
        The healthy actuator.
    remarks : sequence of Note
        What the balance of flows leaves open.
    calibration : Calibration
        Weights of the evidences.

    Returns
    -------
    Mapping[str, float] or None
        Probability by condition [probability]; None where wear is excluded or found, and without pressure.
    """
    if board.blocks.pressure is None or not wear_left_open(remarks):
        return None
    healthy, scores = actuator.circuit, [board.fits.scores]
    for share in DELIVERIES:
        worn = replace(healthy, pump_displacement=share * healthy.pump_displacement)
        fits = fit_classes(board.blocks, replace(actuator, circuit=worn), start=board.fits.best.coordinates)
        scores.append(fits.scores)
    return summed_over_wear(board, np.array(scores), calibration)


def summed_over_wear(board: Scoreboard, scores: Array, calibration: Calibration) -> Mapping[str, float]:
    """Return the probability of each condition, summed over what a pump may deliver.

    Pumps count by what is presumed of one before the log is seen: half a normal distribution of the logarithm of what
    it delivers over its displacement, of deviation `PRESUMED`.

    Parameters
    ----------
    board : Scoreboard
        The evidences of a sound pump.
    scores : ndarray, shape (1 + pumps, 9)
        How well each condition holds the log with a sound pump, then with one that delivers each of `DELIVERIES`:
        log-likelihoods [dimensionless].
    calibration : Calibration
        Weights of the evidences.

    Returns
    -------
    Mapping[str, float]
        Probability by condition [probability].
    """
    summed = np.logaddexp.reduce(scores + presumed_of_wear([1.0, *DELIVERIES])[:, None], axis=0)
    return replace(board, log_odds={**board.log_odds, "parameters": bounded(summed)}).probabilities(calibration)
