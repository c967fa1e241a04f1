"""With pressure: a class may stand although the flow balance does not explain a log to the sensors' noise.

The balance predicts each sample, and its residuals are compared with the sensors' noise. A motor that reverses between
two samples, a search that ends in a wrong minimum, spikes, or a valve that chatters reject bulk modulus, though they
hardly change the 10 ms means with which a circuit is compared. Worn pumps and valves, for which the balance would test,
are then tested by circuits with these faults, as without pressure (`other_faults`). See decision 303.
"""

import numpy as np

from estimation.eha.result import BulkModulusEstimate
from estimation.notes import EstimateCode
from faults.diagnosis.beyond_nine.faulty_circuits import STUCK, WORN
from faults.diagnosis.beyond_nine.other_faults import GAIN, NOT_EXCLUDED, SOUND, OtherCircuits, other_circuits
from faults.diagnosis.circuit_verdict import Diagnosis
from faults.diagnosis.circuits.actuator import Actuator
from faults.diagnosis.circuits.blocks import Blocks
from faults.diagnosis.circuits.class_fit import PointFit
from faults.diagnosis.circuits.class_regions import is_stuck
from faults.diagnosis.severity import severities_at
from faults.notes import ClassCode
from plant.notes import Note

RESIDUAL_REASONS = {
    EstimateCode.PRESSURE_RESIDUALS_LARGE,
    EstimateCode.PRESSURE_RESIDUALS_CORRELATED,
    EstimateCode.PRESSURE_SMOOTHED,
    EstimateCode.CHANNEL_LATE,
    EstimateCode.TEETH_LEFT,
    EstimateCode.SEARCH_ENDED,
    EstimateCode.INNOVATIONS_LARGE,
    EstimateCode.INNOVATIONS_FOLLOW_DRIVE,
    EstimateCode.INNOVATIONS_BESIDE_DRIVE,
    EstimateCode.ESTIMATE_WANDERS,
}
"""Reasons that state the size of the balance's residuals, or that the search for their cause was too long, and none
that names a cause."""

CLOSE_RESIDUALS = (0.03, 0.04)
"""Share of velocity and of pressure, root mean square, up to which a circuit follows a log closely [dimensionless]: a
quarter and a half of the general limit. In training logs of the open benchmark with faults outside the nine that
circuits alone would accept, the residual is 7 % of the velocity and more."""

LARGEST_GAINS = {WORN: NOT_EXCLUDED, STUCK: GAIN, SOUND: -NOT_EXCLUDED}
"""Log-likelihood up to which another circuit is no objection to the class; 0 for circuits that are not named here
[dimensionless]. A worn pump may belong to another class, so it must be excluded. A valve that never opens leaves no
trace, so it must be believed to count. Each other fault then has a probability of 2 % at most, by its prior. Sound
circuits that differ in what no rig file states gained up to 1.2 on sound logs of the project's own plant and up to 36
on others, and up to 73 if a relief valve opens early."""

COMPARED_SEVERITIES = ("leakage_flow", "velocity_lost", "added_friction", "pressure_rise")
"""Severities that another sound circuit must leave within their intervals."""


def class_without_balance(
    doubts: tuple[Note, ...], diagnosis: Diagnosis, estimate: BulkModulusEstimate, actuator: Actuator
) -> Note | None:
    """Return a note if a class stands although the flow balance is rejected.

    Parameters
    ----------
    doubts : tuple of Note
        Objections to a log because of its estimate.
    diagnosis : Diagnosis
        Its diagnosis by circuits.
    estimate : BulkModulusEstimate
        Its estimate.
    actuator : Actuator
        The healthy actuator around which the circuits were fitted.

    Returns
    -------
    Note or None
        A note if the balance is rejected for its residuals alone, a circuit follows the log within `CLOSE_RESIDUALS`,
        and no other circuit, with a fault outside the nine or without, gains more than `LARGEST_GAINS`; otherwise None.
        A circuit without a fault may gain more if it changes nothing (`changes_nothing`).
    """
    board = diagnosis.scoreboard
    blocks, fits = board.blocks, board.fits
    of_balance = estimate.form == "flow" and bool(doubts) and all(note.code in RESIDUAL_REASONS for note in doubts)
    if not of_balance or diagnosis.against or board.drift is not None or blocks.leakage_course is not None:
        return None
    if blocks.pressure is None or is_stuck(blocks, actuator) or not follows_closely(blocks, fits.best):
        return None
    others = other_circuits(blocks, fits, actuator)
    objecting = {name for name, gain in others.gains.items() if gain > LARGEST_GAINS.get(name, 0.0)}
    if objecting and not (objecting == {SOUND} and changes_nothing(others, diagnosis)):
        return None
    velocity, pressure = (100.0 * fits.best.scales / blocks.rms).tolist()
    return ClassCode.BALANCE_REFUSED.note(velocity_percent=velocity, pressure_percent=pressure)


def changes_nothing(others: OtherCircuits, diagnosis: Diagnosis) -> bool:
    """Return whether the best sound circuit has the class and the severities of the rig file's.

    Parameters
    ----------
    others : OtherCircuits
        That circuit, among those that explain a log.
    diagnosis : Diagnosis
        The diagnosis around the rig file's circuit.

    Returns
    -------
    bool
        Whether it excludes every other condition, and its severities lie in the 95 % intervals of the diagnosis.
    """
    if others.condition != diagnosis.condition:
        return False
    sound, told = others.sound, diagnosis.severity
    found = severities_at(sound.fits.best.coordinates, sound.actuator)
    for name in COMPARED_SEVERITIES:
        interval = told[name].ci95
        if interval is not None and not interval[0] <= found[name] <= interval[1]:
            return False
    return True


def follows_closely(blocks: Blocks, fit: PointFit) -> bool:
    """Return whether a circuit leaves little of velocity and of pressure.

    Parameters
    ----------
    blocks : Blocks
        The log, with pressure.
    fit : PointFit
        The circuit.

    Returns
    -------
    bool
        Whether it leaves no more than `CLOSE_RESIDUALS`, noise included: much noise may hide a fault.
    """
    return bool(np.all(fit.scales <= np.array(CLOSE_RESIDUALS) * blocks.rms))
