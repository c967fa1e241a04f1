"""Objections to a log before circuits are fitted, and whether the fitted circuit removes them.

Without pressure a log is rejected if the fit of motion leaves much of the motion. Its search may have failed, though: a
circuit that follows the log provides values for the motion form, which then follows the log too. Nor are residuals an
objection if the piston hardly moves: no model describes exactly how its seals yield.
"""

from collections.abc import Mapping, Sequence

from estimation.eha.estimate import BULK_MODULUS_REASONS
from estimation.eha.result import BulkModulusEstimate
from estimation.fits.motion.values import share_at
from estimation.log_checks.clean import CleanLog
from estimation.notes import EstimateCode
from faults.diagnosis.circuits.actuator import Actuator, actuator_of
from faults.diagnosis.circuits.circuit_runs import COLUMN, parameter_rows
from faults.diagnosis.circuits.class_fit import PointFit
from faults.diagnosis.circuits.rivals import remaining_doubts
from faults.diagnosis.circuits.yielding import UNEXPLAINED, yields_on_seals
from faults.diagnosis.evidence import Scoreboard
from plant.eha.model import EhaParameters
from plant.notes import Note

FAILED_RATIO = 0.5
"""Residual at the circuit's values over that of the search, up to which the search failed [fraction]; otherwise the
ratio is 0.9 to 1.1."""

SHARED_PARAMETERS = (
    "bulk_modulus",
    "leakage_coefficient",
    "flow_bias",
    "makeup_conductance",
    "friction_quadratic",
    "friction_linear",
    "friction_coulomb",
)
"""Parameters that a circuit and the motion form share."""

LEAST_DRAIN = 1e-3
"""Least share of the leakage that drains to the inner circuit [fraction]: no logarithm starts at zero."""


def doubts_after_fit(
    doubts: Sequence[Note], estimate: BulkModulusEstimate, log: CleanLog, healthy: EhaParameters, board: Scoreboard
) -> tuple[Note, ...]:
    """Return the objections to a log that remain after a circuit is fitted.

    Parameters
    ----------
    doubts : sequence of Note
        Objections before the fit.
    estimate : BulkModulusEstimate
        The estimate whose gate raised some of them.
    healthy : EhaParameters
        The actuator around which the circuit was fitted.
    board : Scoreboard
        The circuit that explains the log best.

    Returns
    -------
    tuple of Note
        Those of `faults.diagnosis.circuits.rivals.remaining_doubts`. Objections of a fit of motion are removed if its
        search failed and the motion form fits as well at the circuit's values, or if the piston hardly moves and the
        circuit follows it within what seals yield.
    """
    left = remaining_doubts(doubts, board.blocks, board.fits.best)
    large = next((note for note in left if note.code is EstimateCode.POSITION_RESIDUALS_LARGE), None)
    if large is None or estimate.form != "motion":
        return left
    actuator, best = actuator_of(healthy), board.fits.best
    if not yields_on_seals(board.blocks, best, actuator):
        share = share_at(log.record, healthy, motion_form_values(best, actuator), log.variances["motor_speed_rad_s"])
        if not share <= min(UNEXPLAINED[0], FAILED_RATIO * float(large.data["motion_percent"]) / 100.0):
            return left
    return tuple(note for note in left if note.code not in BULK_MODULUS_REASONS)


def motion_form_values(fit: PointFit, actuator: Actuator) -> Mapping[str, float]:
    """Return the motion form's unknowns with the values of a fitted circuit.

    Parameters
    ----------
    fit : PointFit
        The circuit.
    actuator : Actuator
        The actuator around it.

    Returns
    -------
    Mapping[str, float]
        By the names of `estimation.models.motion.UNKNOWNS` [SI].
    """
    (row,) = parameter_rows(fit.coordinates[None], actuator.circuit, actuator.rated)
    circuit = {name: float(row[column]) for name, column in COLUMN.items()}
    drain = max(circuit["pump_case_leakage"], LEAST_DRAIN * circuit["leakage_coefficient"])
    stiffness = circuit["friction_coulomb"] / circuit["presliding_displacement"]
    return {name: circuit[name] for name in SHARED_PARAMETERS} | {"case_leakage": drain, "bristle_stiffness": stiffness}
