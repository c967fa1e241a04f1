"""`with_balance_severities(diagnosis, estimate, record, p)`: severities from the balances of flow and force.

A fitted circuit determines leakage from the whole motion: if real seals yield in another way than its own, leakage
absorbs the difference. The flow balance uses pump, piston and pressure, and no friction. If it explains a log, it
determines leakage some twenty times better, and so all that depends on leakage in the steady state. Friction then comes
from `known_friction`, which does not use the pump. See decision 304.
"""

from collections.abc import Mapping
from dataclasses import replace
from math import isfinite

import numpy as np

from estimation.eha.explanation_notes import total_delay
from estimation.eha.result import BulkModulusEstimate
from estimation.finding import Outcome, Quantity
from estimation.log_checks.channel_names import POSITION, PRESSURE
from faults.diagnosis.circuit_verdict import Diagnosis
from faults.diagnosis.circuits.actuator import actuator_of
from faults.diagnosis.known_friction import friction_by_forces
from faults.diagnosis.not_told import interval_width, not_told_notes
from faults.diagnosis.severity import FRICTION_SEVERITIES, KnownLosses
from plant.eha.model import EhaParameters
from plant.log.record import Record

LOSSES = ("leakage_coefficient", "flow_bias")


def with_balance_severities(
    diagnosis: Diagnosis, estimate: BulkModulusEstimate, record: Record, p: EhaParameters
) -> Diagnosis:
    """Return a diagnosis with severities from the balances of flow and force.

    Parameters
    ----------
    diagnosis : Diagnosis
        Diagnosis of a log.
    estimate : BulkModulusEstimate
        Estimate of that log.
    record : Record
        That log, as it was diagnosed.
    p : EhaParameters
        The healthy actuator.

    Returns
    -------
    Diagnosis
        With leakage and flow bias from the flow balance, and friction from the force balance, each if it is determined
        better than by the circuit; leakage and flow bias only if no further cause is needed. Unchanged if the flow
        balance does not explain the log, or if the circuit is not that of the whole log, because its leakage drifts or
        changes.
    """
    blocks, circuits = diagnosis.scoreboard.blocks, diagnosis.severity
    changes = (
        blocks.leakage_course is not None
        or blocks.earlier_circuit is not None
        or diagnosis.scoreboard.onset is not None
    )
    if (
        not _is_balance_accepted(estimate)
        or changes
        or diagnosis.scoreboard.drift is not None
        or diagnosis.severities_given is None
    ):
        return diagnosis
    losses, severity = known_losses(estimate), circuits
    if losses is not None:
        severity = diagnosis.severities_given(losses, None)
        if interval_width(severity["leakage_flow"]) >= interval_width(circuits["leakage_flow"]):
            losses, severity = None, circuits
    rubbing = None if _has_late_channel(estimate) else friction_by_forces(record, p, actuator_of(p).rated)
    if rubbing is not None:
        rubbed = diagnosis.severities_given(losses, rubbing)
        if _is_friction_narrower(rubbed, severity):
            severity = rubbed
    if severity is circuits:
        return diagnosis
    fits = diagnosis.scoreboard.fits
    by_circuit, told = (not_told_notes(fits, one, pressure=True) for one in (circuits, severity))
    others = [note for note in diagnosis.not_told if note not in by_circuit]
    return replace(diagnosis, severity=severity, not_told=(*told, *others))


def _is_friction_narrower(rubbed: Mapping[str, Quantity], severity: Mapping[str, Quantity]) -> bool:
    """Return whether friction, with all that depends on it, is determined better: a law may have no steady state."""
    narrower = (
        interval_width(rubbed[name]) < interval_width(severity[name]) for name in ("added_friction", "pressure_rise")
    )
    return all(narrower) and all(isfinite(interval_width(rubbed[name])) for name in FRICTION_SEVERITIES)


def _is_balance_accepted(estimate: BulkModulusEstimate) -> bool:
    """Return whether the flow balance, further causes included, explains a log."""
    return estimate.form == "flow" and estimate.outcome is Outcome.OK and estimate.gate.passed


def _has_late_channel(estimate: BulkModulusEstimate) -> bool:
    """Return whether pressure or position was late: a lag corrected as a delay leaves errors at reversals."""
    found = estimate.explanation
    return found is not None and any(total_delay(found, channel) != 0.0 for channel in (PRESSURE, POSITION))


def known_losses(estimate: BulkModulusEstimate) -> KnownLosses | None:
    """Return leakage and flow bias of a log from the flow balance.

    Returns
    -------
    KnownLosses or None
        None if the balance was not fitted, is rejected, or needs a further cause to explain the log.
    """
    if (
        not _is_balance_accepted(estimate)
        or estimate.explanation is not None
        or not set(LOSSES) <= set(estimate.others)
    ):
        return None
    values, deviations = np.array([estimate.others[name] for name in LOSSES]).T
    relative = deviations / values
    if not np.all(np.isfinite(relative)):
        return None
    together = np.array([[1.0, estimate.correlation], [estimate.correlation, 1.0]])
    return KnownLosses(np.log(values), together * np.outer(relative, relative))
