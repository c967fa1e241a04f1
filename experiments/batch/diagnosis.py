"""The class of a log, as a batch asks for it: the one place that knows how a log is diagnosed."""

from functools import lru_cache
from typing import Any

from faults.class_fit import Actuator
from faults.diagnosis import diagnose_log
from plant.eha import EhaParameters
from plant.record import Record

TOLD_APART = 1.001
"""Least ratio of the best class's probability to the runner-up's at which a class is named [dimensionless]."""


def diagnosed(record: Record, rig: EhaParameters) -> dict[str, Any]:
    """Say which of the nine conditions a log was taken in, or that it is in none.

    Parameters
    ----------
    record : Record
        The log.
    rig : EhaParameters
        The healthy actuator.

    Returns
    -------
    dict[str, Any]
        Entries of a row: outcome, reason, and where there is a class, it, its runner-up and the ratio of their
        probabilities. A log that is in none of the nine is a mismatch without a class.

    Raises
    ------
    LogError
        If the log cannot be diagnosed.
    RigError
        If no circuit fits around the rig.
    """
    found = diagnose_log(record, _actuator(rig))
    (best, first), (second, other) = sorted(found.probabilities.items(), key=lambda item: -item[1])[:2]
    margin = first / max(other, 1e-300)
    if found.unknown:
        said = f"in none of the nine conditions, the nearest is {best}: {'; '.join(found.reasons)}"
        return {"outcome": "mismatch", "reason": said, "trusted": False}
    if margin < TOLD_APART:
        said = f"no class: under this drive {best} and {second} move alike; drive the actuator, at best with steps"
        return {"outcome": "not_observable", "reason": said, "margin": margin}
    return {"outcome": "ok", "found_condition": best, "runner_up": second, "margin": margin, "trusted": True}


@lru_cache(maxsize=4)
def _actuator(rig: EhaParameters) -> Actuator:
    return Actuator.of(rig)
