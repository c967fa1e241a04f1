"""`by_the_balance(diagnosis, estimate, record, p)`: severities from the balances of flow and force.

A fitted circuit tells leakage with the whole motion: where its seals yield otherwise than real ones do, it makes up for
that by leakage. The balance of flows knows pump, piston and pressure, and nothing of friction. Where it explains a log,
leakage is known some twenty times as well by it, and what hangs on leakage in the steady state is better known too.
Friction is told by `known_friction` then, which knows nothing of the pump. See decision 304.
"""

from collections.abc import Mapping
from dataclasses import replace
from math import isfinite

import numpy as np

from estimation.eha.explanation_notes import lateness
from estimation.eha.result import BulkModulusEstimate
from estimation.finding import Outcome, Quantity
from estimation.log_checks.channel_names import POSITION, PRESSURE
from faults.diagnosis.circuit_verdict import Diagnosis
from faults.diagnosis.circuits.actuator import actuator_of
from faults.diagnosis.known_friction import friction_by_forces
from faults.diagnosis.not_told import extent, what_is_not_told
from faults.diagnosis.severity import OF_FRICTION, KnownLosses
from plant.eha.model import EhaParameters
from plant.log.record import Record

LOSSES = ("leakage_coefficient", "flow_bias")


def by_the_balance(diagnosis: Diagnosis, estimate: BulkModulusEstimate, record: Record, p: EhaParameters) -> Diagnosis:
    """Return a diagnosis with severities from the balances of flow and force.

    Parameters
    ----------
    diagnosis : Diagnosis
        Of a log.
    estimate : BulkModulusEstimate
        Of that log.
    record : Record
        That log, as it was diagnosed.
    p : EhaParameters
        The healthy actuator.

    Returns
    -------
    Diagnosis
        With the leakage and the flow bias of the one, and the friction of the other, each where it is told better than
        by the circuit; leakage and flow bias only where no further cause is needed. The same one where the balance of
        flows does not explain the log, or where the circuit is not that of the whole log: its leakage drifts or
        changes.
    """
    blocks, circuits = diagnosis.scoreboard.blocks, diagnosis.severity
    changes = blocks.course is not None or blocks.earlier is not None or diagnosis.scoreboard.onset is not None
    if not _balances(estimate) or changes or diagnosis.scoreboard.drift is not None or diagnosis.told_by is None:
        return diagnosis
    losses, severity = known_losses(estimate), circuits
    if losses is not None:
        severity = diagnosis.told_by(losses, None)
        if extent(severity["leakage_flow"]) >= extent(circuits["leakage_flow"]):
            losses, severity = None, circuits
    rubbing = None if _was_late(estimate) else friction_by_forces(record, p, actuator_of(p).rated)
    if rubbing is not None:
        rubbed = diagnosis.told_by(losses, rubbing)
        if _told_better(rubbed, severity):
            severity = rubbed
    if severity is circuits:
        return diagnosis
    fits = diagnosis.scoreboard.fits
    by_circuit, told = (what_is_not_told(fits, one, pressure=True) for one in (circuits, severity))
    others = [note for note in diagnosis.not_told if note not in by_circuit]
    return replace(diagnosis, severity=severity, not_told=(*told, *others))


def _told_better(rubbed: Mapping[str, Quantity], severity: Mapping[str, Quantity]) -> bool:
    """Return whether friction is told better, and all that hangs on it is told: a law may have no steady state."""
    narrower = (extent(rubbed[name]) < extent(severity[name]) for name in ("added_friction", "pressure_rise"))
    return all(narrower) and all(isfinite(extent(rubbed[name])) for name in OF_FRICTION)


def _balances(estimate: BulkModulusEstimate) -> bool:
    """Return whether the balance of flows explains a log, further causes taken up."""
    return estimate.form == "flow" and estimate.outcome is Outcome.OK and estimate.gate.passed


def _was_late(estimate: BulkModulusEstimate) -> bool:
    """Return whether pressure or position came late: a lag that is set right as a delay leaves errors at reversals."""
    found = estimate.explanation
    return found is not None and any(lateness(found, channel) != 0.0 for channel in (PRESSURE, POSITION))


def known_losses(estimate: BulkModulusEstimate) -> KnownLosses | None:
    """Return leakage and flow bias of a log as the balance of flows tells them.

    Returns
    -------
    KnownLosses or None
        None where the balance was not fitted, is refused, or needs a further cause to explain the log.
    """
    if not _balances(estimate) or estimate.explanation is not None or not set(LOSSES) <= set(estimate.others):
        return None
    values, deviations = np.array([estimate.others[name] for name in LOSSES]).T
    relative = deviations / values
    if not np.all(np.isfinite(relative)):
        return None
    together = np.array([[1.0, estimate.correlation], [estimate.correlation, 1.0]])
    return KnownLosses(np.log(values), together * np.outer(relative, relative))
