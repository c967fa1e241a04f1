"""The verdict on a log: which condition, how probable, how bad, or "unknown" and why."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from estimation.identification.linear_model import LinearModel
from faults.calibration import Calibration, shipped_calibration
from faults.class_fit import Actuator
from faults.class_regions import region_scores
from faults.evidence import Scoreboard, weigh
from faults.out_of_model import reasons_against
from faults.severity import Severity, severities, severities_at, what_is_not_told
from plant.record import Record


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What is wrong with an actuator, by its log, when the log ends.

    Parameters
    ----------
    condition : str
        The most probable of the nine conditions.
    probabilities : Mapping[str, float]
        Of each, should the log be in one of them [probability].
    unknown : bool
        Whether something speaks against all nine.
    reasons : tuple of str
        What.
    severity : Mapping[str, Severity]
        How bad, by the names of `faults.severity.UNITS` [each in the unit given there].
    healthy : Mapping[str, float]
        The same of the healthy actuator [each in the same unit].
    not_told : tuple of str
        What the log does not determine.
    scoreboard : Scoreboard
        The evidences, and the circuit that was fitted.
    """

    condition: str
    probabilities: Mapping[str, float]
    unknown: bool
    reasons: tuple[str, ...]
    severity: Mapping[str, Severity]
    healthy: Mapping[str, float]
    not_told: tuple[str, ...]
    scoreboard: Scoreboard


def diagnose_log(
    record: Record,
    actuator: Actuator,
    library: Mapping[str, LinearModel] | None = None,
    calibration: Calibration | None = None,
) -> Diagnosis:
    """Diagnose a log by all evidences.

    Parameters
    ----------
    record : Record
        Motor speed, and position or velocity; differential pressure where it is logged.
    actuator : Actuator
        The healthy actuator.
    library : Mapping[str, LinearModel], optional
        Its transfer functions, by condition.
    calibration : Calibration, optional
        Fitted numbers; those shipped if not given.

    Returns
    -------
    Diagnosis
        The verdict.

    Raises
    ------
    LogError
        If the log has neither position nor velocity, or is too short.
    """
    numbers = shipped_calibration() if calibration is None else calibration
    board = weigh(record, actuator, library)
    pressure = board.blocks.pressure is not None
    probabilities = board.probabilities(numbers)
    region = float(np.max(region_scores(board.fits.best, board.fits.information, actuator)))
    reasons = reasons_against(board.window, board.blocks, board.fits, region, actuator)
    found = severities(board.fits, actuator, numbers.widths(pressure))
    return Diagnosis(
        max(probabilities, key=lambda name: probabilities[name]),
        probabilities,
        bool(reasons),
        tuple(reasons),
        found,
        severities_at(actuator.conditions[0], actuator),
        tuple(what_is_not_told(board.fits, found, pressure=pressure)),
        board,
    )
