"""`by_the_balance(diagnosis, estimate)`: severities of a log whose leakage and flow bias the balance of flows tells.

A fitted circuit tells leakage with the whole motion: where its seals yield otherwise than real ones do, it makes up for
that by leakage. The balance of flows knows pump, piston and pressure, and nothing of friction. Where it explains a log,
leakage is known some twenty times as well by it, and what hangs on leakage in the steady state is better known too.
"""

from dataclasses import replace
from math import inf

import numpy as np

from estimation.eha.result import BulkModulusEstimate
from estimation.finding import Outcome, Quantity
from faults.diagnosis.circuit_verdict import Diagnosis
from faults.diagnosis.not_told import what_is_not_told
from faults.diagnosis.severity import KnownLosses

LOSSES = ("leakage_coefficient", "flow_bias")


def by_the_balance(diagnosis: Diagnosis, estimate: BulkModulusEstimate) -> Diagnosis:
    """Return a diagnosis whose severities have the leakage and the flow bias that the balance of flows tells.

    Parameters
    ----------
    diagnosis : Diagnosis
        Of a log.
    estimate : BulkModulusEstimate
        Of that log.

    Returns
    -------
    Diagnosis
        The same one where the balance does not explain the log without further causes, where the circuit tells leakage
        better, or is not that of the whole log: its leakage drifts or changes.
    """
    known, blocks = known_losses(estimate), diagnosis.scoreboard.blocks
    changes = blocks.course is not None or blocks.earlier is not None or diagnosis.scoreboard.onset is not None
    if known is None or changes or diagnosis.scoreboard.drift is not None or diagnosis.told_by is None:
        return diagnosis
    severity = diagnosis.told_by(known)
    if _extent(severity["leakage_flow"]) >= _extent(diagnosis.severity["leakage_flow"]):
        return diagnosis
    fits, both = diagnosis.scoreboard.fits, (diagnosis.severity, severity)
    by_circuit, told = (what_is_not_told(fits, one, pressure=True) for one in both)
    others = [note for note in diagnosis.not_told if note not in by_circuit]
    return replace(diagnosis, severity=severity, not_told=(*told, *others))


def _extent(one: Quantity) -> float:
    return inf if one.ci95 is None else one.ci95[1] - one.ci95[0]


def known_losses(estimate: BulkModulusEstimate) -> KnownLosses | None:
    """Return leakage and flow bias of a log as the balance of flows tells them.

    Parameters
    ----------
    estimate : BulkModulusEstimate
        Of the log.

    Returns
    -------
    KnownLosses or None
        None where the balance was not fitted, is refused, or needs a further cause to explain the log.
    """
    told = estimate.form == "flow" and estimate.outcome is Outcome.OK and estimate.gate.passed
    if not told or estimate.explanation is not None or not set(LOSSES) <= set(estimate.others):
        return None
    values, deviations = np.array([estimate.others[name] for name in LOSSES]).T
    relative = deviations / values
    if not np.all(np.isfinite(relative)):
        return None
    together = np.array([[1.0, estimate.correlation], [estimate.correlation, 1.0]])
    return KnownLosses(np.log(values), together * np.outer(relative, relative))
