"""With pressure: a class may stand where the balance of flows does not explain a log to the sensors' noise.

The balance predicts each sample, and what it leaves is measured by the sensors' noise: a motor that turns between two
samples, a search that ends in a wrong valley, spikes, or a valve that chatters refuse bulk modulus, though they hardly
change the means over 10 ms by which a circuit is compared. What the balance would have told of a worn pump and of
valves is then asked of circuits with these faults, as without pressure (`other_faults`). See decision 303.
"""

import numpy as np

from estimation.eha.result import BulkModulusEstimate
from estimation.notes import EstimateCode
from faults.diagnosis.beyond_nine.other_faults import GAIN, NOT_EXCLUDED, SOUND, STUCK, WORN, gains_of_others
from faults.diagnosis.circuit_verdict import Diagnosis
from faults.diagnosis.circuits.actuator import Actuator
from faults.diagnosis.circuits.blocks import Blocks
from faults.diagnosis.circuits.class_fit import PointFit
from faults.diagnosis.circuits.class_regions import is_stuck
from faults.notes import ClassCode
from plant.notes import Note

LEFT_BY_BALANCE = {
    EstimateCode.PRESSURE_RESIDUALS_LARGE,
    EstimateCode.PRESSURE_RESIDUALS_CORRELATED,
    EstimateCode.CHANNEL_LATE,
    EstimateCode.TEETH_LEFT,
    EstimateCode.INNOVATIONS_LARGE,
    EstimateCode.INNOVATIONS_FOLLOW_DRIVE,
    EstimateCode.INNOVATIONS_BESIDE_DRIVE,
    EstimateCode.ESTIMATE_WANDERS,
}
"""Reasons that say how much the balance leaves, and none that names what is wrong."""

CLOSELY = (0.03, 0.04)
"""Share of velocity and of pressure, root mean square, up to which a circuit follows a log closely [dimensionless]: a
quarter and a half of what it may leave of any log. On training logs of the open benchmark with faults outside the nine
that circuits alone would pass, it leaves 7 % of the velocity and more."""

MOST_GAINED = {WORN: NOT_EXCLUDED, STUCK: GAIN, SOUND: -NOT_EXCLUDED}
"""Log-likelihood up to which another circuit does not speak against the class; 0 of any that is not named here
[dimensionless]. A worn pump may belong to another class, so it has to be excluded. A valve that never opens leaves no
trace, so it has to be believed. Each other fault then has a probability of 2 % at most, by what is presumed of it. What
no rig file knows gained up to 1.2 on sound logs, and up to 73 where a relief valve opens early."""


def class_without_balance(
    doubts: tuple[Note, ...], diagnosis: Diagnosis, estimate: BulkModulusEstimate, actuator: Actuator
) -> Note | None:
    """Return a note where a class stands, though the balance of flows is refused.

    Parameters
    ----------
    doubts : tuple of Note
        What speaks against a log because of its estimate.
    diagnosis : Diagnosis
        What circuits say of it.
    estimate : BulkModulusEstimate
        Its estimate.
    actuator : Actuator
        The healthy actuator around which the circuits were fitted.

    Returns
    -------
    Note or None
        One where the balance is refused for what it leaves alone, a circuit follows the log `CLOSELY`, and no other
        circuit, with a fault outside the nine conditions or without, gains more than `MOST_GAINED`; else None.
    """
    board = diagnosis.scoreboard
    blocks, fits = board.blocks, board.fits
    of_balance = estimate.form == "flow" and bool(doubts) and all(note.code in LEFT_BY_BALANCE for note in doubts)
    if not of_balance or diagnosis.against or board.drift is not None or blocks.course is not None:
        return None
    if blocks.pressure is None or is_stuck(blocks, actuator) or not follows_closely(blocks, fits.best):
        return None
    gains = gains_of_others(blocks, fits, actuator)
    if any(gain > MOST_GAINED.get(name, 0.0) for name, gain in gains.items()):
        return None
    velocity, pressure = (100.0 * fits.best.scales / blocks.sizes).tolist()
    return ClassCode.BALANCE_REFUSED.note(velocity_percent=velocity, pressure_percent=pressure)


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
        Whether it leaves no more than `CLOSELY`, noise included: within much noise a fault may hide.
    """
    return bool(np.all(fit.scales <= np.array(CLOSELY) * blocks.sizes))
