"""Pump delivery from the flow balance; integrated out if a log does not determine it.

With pressure, the balance determines the pump's delivery, or that the log leaves it open (`estimation.fits.flow.fit`).
It follows the oil to the sensors' noise, while a circuit follows the piston to a few percent. So if the balance holds,
a deviating pump of a circuit is an error of its friction. Without pressure, circuits with a worn pump are compared
(`other_faults`). If a log leaves the delivery open, a pump that delivers less implies less leakage, and a larger bulk
modulus. The probability that the pump is worn is then none of the nine's.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from estimation.eha.explanation_notes import WORN_SHARE
from estimation.eha.result import BulkModulusEstimate
from estimation.eha.rig_share import UndeterminedDelivery, undetermined_delivery, undetermined_wear
from estimation.finding import NORMAL_95
from estimation.fits.hypotheses import OFFSET
from estimation.notes import RigCode
from faults.diagnosis.beyond_nine.left_open import DELIVERIES, LEAST_REPORTED, delivery_log_priors
from faults.diagnosis.beyond_nine.near_enough import is_only_outside, is_outside_conditions
from faults.diagnosis.beyond_nine.other_faults import faults_outside
from faults.diagnosis.calibration import Calibration, shipped_calibration
from faults.diagnosis.circuit_verdict import Diagnosis
from faults.diagnosis.circuits.actuator import Actuator
from faults.diagnosis.circuits.circuit_runs import COORDINATES
from faults.diagnosis.circuits.class_fit import LASTING, misfit
from faults.diagnosis.circuits.class_regions import is_stuck
from faults.diagnosis.circuits.friction_shape import bent_information
from faults.diagnosis.circuits.region_scores import region_scores, scores_in_forces
from faults.diagnosis.evidence import Scoreboard, bounded_log_odds
from faults.notes import AgainstCode, ClassCode
from plant.arrays import Array
from plant.notes import Note

OFFSETS = {OFFSET.name, "pressure_drift"}
"""Hypotheses that look like an offset of the speed."""

LARGEST_CHANCE = 0.99
"""Largest probability of a worn pump from slopes alone, without a search [probability]; judged. Slopes hold to first
order, and the nine conditions keep their order below it."""

FLOW_SCALE = np.array([{"leakage": 1.0, "bias": 1.0, "bulk_modulus": -1.0}.get(name, 0.0) for name in COORDINATES])
"""Direction in which all flows of a nearly resting piston scale with the pump's delivery [dimensionless]: pumps that
differ explain the log equally well along it, which is why wear is open."""

TRIED_DELIVERIES = DELIVERIES[::2]
"""Deliveries of pumps for which conditions are scored if pressure is logged [dimensionless]."""

LEAST_LOG_LIKELIHOOD = math.log(1e-3)
"""Log-likelihood of a delivery below the likeliest one's from which it is ignored [dimensionless]."""

FARTHEST, PUMPS = 4.0, 65
"""Range of pumps about the likeliest, in deviations, and their number [dimensionless, count]."""


def with_pump_delivery(
    diagnosis: Diagnosis, actuator: Actuator, estimate: BulkModulusEstimate, strange: Sequence[Note] = ()
) -> Diagnosis:
    """Return a diagnosis with the pump delivery from the flow balance.

    Parameters
    ----------
    diagnosis : Diagnosis
        Diagnosis by a circuit alone.
    actuator : Actuator
        The healthy actuator, with the delivery from the balance.
    estimate : BulkModulusEstimate
        The balance, and what it leaves open.
    strange : sequence of Note
        Notes on what explains the log.

    Returns
    -------
    Diagnosis
        If the balance determines the delivery, without the circuit's objection to it; if it leaves that open, with
        classes averaged over it (`probabilities_over_wear`); otherwise, and without pressure, unchanged. Classes sum to
        the probability that the pump is not worn (`chance_of_wear`).
    """
    chance = chance_of_wear((*estimate.remarks, *strange))
    if known := known_by_flow_balance(estimate):
        told = replace(diagnosis, against=tuple(note for note in diagnosis.against if note.code not in known))
    else:
        board, calibration, left = diagnosis.scoreboard, shipped_calibration(), undetermined_delivery(estimate.remarks)
        found = probabilities_over_wear(board, actuator, estimate.remarks, calibration)
        told = diagnosis if found is None else replace(diagnosis, probabilities=found)
        if left is not None and found is not None:
            chance = chance_by_conditions(board, actuator, left, calibration)
    if chance == 0.0 or (chance < LEAST_REPORTED and not undetermined_wear(estimate.remarks)):
        return told
    note = ClassCode.WEAR_NOT_TOLD.note(percent=100.0 * chance, limit=100.0 * WORN_SHARE)
    left = {name: (1.0 - chance) * share for name, share in told.probabilities.items()}
    return replace(told, probabilities=left, not_told=(*told.not_told, note))


def chance_of_wear(said: Sequence[Note]) -> float:
    """Return the probability that a pump delivers less than `WORN_SHARE`, by the flow balance.

    Parameters
    ----------
    said : sequence of Note
        Notes on what the balance leaves open, and on what explains the log.

    Returns
    -------
    float
        From a normal distribution with the prior of a pump, cut off where oil would leak backwards; at most
        `LARGEST_CHANCE` [probability]. Zero if a worn pump was found, which is a reason against all nine conditions,
        and if wear is excluded.
    """
    if (left := undetermined_delivery(said)) is not None:
        return min(
            _truncated_probability_below(left.least, math.log(WORN_SHARE), left.size, left.deviation), LARGEST_CHANCE
        )
    for note in said:
        if note.code is RigCode.AREA_TO_DISPLACEMENT:
            return _probability_below(100.0 * WORN_SHARE, note.data["percent"], note.data["half_width"] / NORMAL_95)
    return 0.0


def chance_by_conditions(
    board: Scoreboard, actuator: Actuator, left: UndeterminedDelivery, calibration: Calibration
) -> float:
    """Return the probability that a pump delivers less than `WORN_SHARE`, by the flow balance and by the conditions.

    A worn pump looks like a sound one with more leakage than any condition has, in softer oil. The conditions count by
    how well they fit the log with each pump, with their weight in the class.

    Parameters
    ----------
    board : Scoreboard
        The evidences of a sound pump.
    left : UndeterminedDelivery
        What the balance leaves open.

    Returns
    -------
    float
        At most `LARGEST_CHANCE` [probability].
    """
    limit, reach = math.log(WORN_SHARE), FARTHEST * left.deviation
    least = max(left.size - reach, left.least)
    if limit <= least or not left.deviation > 0.0:
        return 0.0
    deliveries = np.linspace(least, max(left.size, left.least) + reach, PUMPS)
    held = np.array([np.logaddexp.reduce(_region_scores_at(board, one * FLOW_SCALE, actuator)) for one in deliveries])
    weight = calibration.weights(board.blocks.pressure is not None)["parameters"]
    likely = weight * held - 0.5 * ((deliveries - left.size) / left.deviation) ** 2
    shares = np.exp(likely - np.max(likely))
    return min(float(np.sum(shares[deliveries < limit]) / np.sum(shares)), LARGEST_CHANCE)


def _truncated_probability_below(least: float, limit: float, mean: float, std: float) -> float:
    """Return the probability that a normal variable, cut off below a least value, is below a limit."""
    if limit <= least:
        return 0.0
    above = 1.0 - _probability_below(least, mean, std)
    return 1.0 if above <= 0.0 else 1.0 - (1.0 - _probability_below(limit, mean, std)) / above


def _probability_below(limit: float, mean: float, std: float) -> float:
    """Return the probability that a normal variable is below a limit."""
    return 0.5 * math.erfc((mean - limit) / (math.sqrt(2.0) * std)) if std > 0.0 else float(mean < limit)


def with_other_faults(diagnosis: Diagnosis, actuator: Actuator, calibration: Calibration) -> Diagnosis:
    """Return a diagnosis with faults outside the nine conditions, without pressure.

    Parameters
    ----------
    diagnosis : Diagnosis
        Diagnosis by circuits without such a fault.

    Returns
    -------
    Diagnosis
        With the fault that the log shows, those that it leaves open, and classes averaged over a worn pump if that is
        one of these: the classes sum to the probability that none of these faults is present. Unchanged with pressure,
        for a sticking piston, and if there is another objection than a place outside the nine (`near_enough`).
    """
    board = diagnosis.scoreboard
    asked = board.blocks.pressure is None and not is_stuck(board.blocks, actuator)
    if not asked or not is_only_outside(diagnosis.against):
        return diagnosis
    others = faults_outside(board.blocks, board.fits, actuator)
    beside = (
        diagnosis.against if diagnosis.against and is_outside_conditions(board.blocks, board.fits, actuator) else ()
    )
    if others.against or beside:
        return replace(diagnosis, against=(*others.against, *beside))
    probabilities = diagnosis.probabilities
    if others.worn_scores is not None:
        probabilities = summed_over_wear(board, others.worn_scores, calibration)
    return replace(
        diagnosis,
        probabilities={name: (1.0 - others.faulty) * share for name, share in probabilities.items()},
        against=(),
        not_told=(*diagnosis.not_told, *others.open),
    )


def known_by_flow_balance(estimate: BulkModulusEstimate) -> frozenset[AgainstCode]:
    """Return the quantities that the flow balance determines better than a circuit.

    Parameters
    ----------
    estimate : BulkModulusEstimate
        Estimate of a log.

    Returns
    -------
    frozenset of AgainstCode
        The pump's delivery, if the balance holds and does not leave wear open; and whether motor speed has an offset,
        unless a pressure offset, which leaks as much, was found in its place. Otherwise none.
    """
    if estimate.form != "flow" or not estimate.gate.passed or undetermined_wear(estimate.remarks):
        return frozenset()
    names = estimate.explanation.names if estimate.explanation is not None else ()
    return frozenset({AgainstCode.PUMP_OFF} if OFFSETS & set(names) else {AgainstCode.PUMP_OFF, AgainstCode.SPEED_BIAS})


def probabilities_over_wear(
    board: Scoreboard, actuator: Actuator, remarks: Sequence[Note], calibration: Calibration
) -> Mapping[str, float] | None:
    """Return the probability of each condition, averaged over the pump's delivery, if a log leaves it open.

    The conditions are scored again for pumps with `TRIED_DELIVERIES`, as far as the flow balance leaves them likely;
    see `summed_over_wear`. Along `FLOW_SCALE` they explain the log equally well, which is why wear is open, so no
    circuit is fitted with them.

    Parameters
    ----------
    board : Scoreboard
        The evidences of a sound pump.
    remarks : sequence of Note
        Notes on what the flow balance leaves open.

    Returns
    -------
    Mapping[str, float] or None
        Probability by condition [probability]; None where wear is excluded or found, and without pressure.
    """
    left = undetermined_delivery(remarks)
    if board.blocks.pressure is None or left is None:
        return None
    deliveries = np.log([1.0, *TRIED_DELIVERIES])
    likely = -0.5 * ((deliveries - left.size) / left.deviation) ** 2
    likely[deliveries < left.least] = -math.inf
    likely -= np.max(likely)
    kept = [0, *(place for place in range(1, len(likely)) if likely[place] >= LEAST_LOG_LIKELIHOOD)]
    worn = [_scores_at(board, deliveries[place] * FLOW_SCALE, actuator) for place in kept[1:]]
    return summed_over_wear(board, np.array([board.fits.scores, *worn]), calibration, likely[kept])


def _scores_at(board: Scoreboard, along: Array, actuator: Actuator) -> Array:
    """Return the scores of another circuit that explains a log as well as the best one, shape (9,)."""
    best = board.fits.best
    return _region_scores_at(board, along, actuator) - misfit(board.blocks, best.fitted, best.scales) / LASTING


def _region_scores_at(board: Scoreboard, along: Array, actuator: Actuator) -> Array:
    """Return how well each condition's region fits such a circuit, shape (9,)."""
    fits = board.fits
    there = replace(fits.best, coordinates=fits.best.coordinates + along)
    if np.any(fits.bend_shifts):
        return scores_in_forces(there, bent_information(fits.information, fits.bend_shifts), actuator)
    return region_scores(there, fits.information, actuator)


def summed_over_wear(
    board: Scoreboard, scores: Array, calibration: Calibration, likely: Array | None = None
) -> Mapping[str, float]:
    """Return the probability of each condition, summed over possible pump deliveries.

    Parameters
    ----------
    board : Scoreboard
        The evidences of a sound pump.
    scores : ndarray, shape (1 + pumps, 9)
        How well each condition fits the log with a sound pump, then with worn ones: log-likelihoods [dimensionless].
    likely : ndarray, shape (1 + pumps,), optional
        Log-likelihoods of these pumps [dimensionless]. By default, the worn ones have `DELIVERIES` and the prior of a
        pump: half a normal distribution of the logarithm of delivery over displacement, with deviation `PRIOR_SPREADS`.

    Returns
    -------
    Mapping[str, float]
        Probability by condition [probability].
    """
    likely = delivery_log_priors([1.0, *DELIVERIES]) if likely is None else likely
    summed = np.logaddexp.reduce(scores + likely[:, None], axis=0)
    return replace(board, log_odds={**board.log_odds, "parameters": bounded_log_odds(summed)}).probabilities(
        calibration
    )
