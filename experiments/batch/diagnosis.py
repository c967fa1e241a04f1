"""The class of a log, as a batch asks for it: the one place that knows how a log is diagnosed."""

import math
from collections.abc import Mapping
from typing import Any

from faults.classify import score_mathematical
from plant.eha import EhaParameters
from plant.record import Record

TOLD_APART = 1.001
"""Least ratio of the runner-up's score to the best at which a class is named [dimensionless]."""


def diagnosed(record: Record, bank: Mapping[str, EhaParameters]) -> dict[str, Any]:
    """Say which of the bank's conditions a log fits best.

    Parameters
    ----------
    record : Record
        The log.
    bank : Mapping[str, EhaParameters]
        Parameters by condition name.

    Returns
    -------
    dict[str, Any]
        Entries of a row: outcome, reason, and where there is a class, it, its runner-up and the ratio of their scores.

    Raises
    ------
    LogError
        If the log cannot be scored.
    """
    scores = score_mathematical(record, bank).by_condition
    ranked = sorted(scores.items(), key=lambda item: item[1] if math.isfinite(item[1]) else math.inf)
    (best, least), (second, next_least) = ranked[:2]
    if not math.isfinite(least):
        return {"outcome": "diverged", "reason": "no condition's model stayed finite; check units and rig"}
    margin = next_least / least if least > 0.0 else (math.inf if next_least > 0.0 else 1.0)
    if margin < TOLD_APART:
        said = "no class: under this drive the models move alike; drive the actuator, at best with steps"
        return {"outcome": "not_observable", "reason": said, "margin": margin}
    return {"outcome": "ok", "found_condition": best, "runner_up": second, "margin": margin}
