"""Diagnosis of a log for a batch study. No other module of the batch runs a diagnosis."""

import json
import math
import warnings
from typing import Any

from estimation.eha.result import BulkModulusEstimate
from estimation.finding import Finding, Outcome
from estimation.log_checks.clean import CleanLog
from estimation.notes import ChannelCode, SensorCode
from experiments.eha.plain_verdict import WRONG_INPUT
from experiments.log_pages.entries import quantity_entry
from experiments.page.condition_names import condition_in_words
from faults.diagnosis.diagnose import diagnose_log
from faults.notes import AgainstCode, ClassCode
from plant.eha.rig import Rig
from plant.errors import LogWarning
from plant.log.record import Record

DISTINCT_RATIO = 1.001
"""Minimum ratio of the best class's probability to the runner-up's at which a class is named [dimensionless]."""

NO_CLASS_CODES = {
    ClassCode.CHANNEL_ZERO,
    ClassCode.MODELS_ALIKE,
    ClassCode.MODELS_DIVERGED,
    ClassCode.NO_CIRCUIT,
    ClassCode.NO_PROBABILITIES,
    *ChannelCode,
}


def diagnose_to_row(
    record: Record, rig: Rig, seen: tuple[CleanLog, BulkModulusEstimate] | None = None
) -> dict[str, Any]:
    """Diagnose which of the nine conditions a log was taken in, or that it fits none; see `diagnose_log`.

    Returns
    -------
    dict[str, Any]
        Entries of a row: outcome, reason, severities and, if there is a class, the class, its runner-up and the ratio
        of their probabilities. A log that fits none of the nine is a mismatch without a class.

    Raises
    ------
    LogError
        If the log cannot be diagnosed.

    Warns
    -----
    LogWarning
        If samples were left out.
    """
    found = diagnose_log(record, rig, seen)
    for note in found.notes:
        if isinstance(note.code, SensorCode):
            warnings.warn(LogWarning(note), stacklevel=2)
    return class_row(found)


def class_row(found: Finding) -> dict[str, Any]:
    """Return a diagnosis of the gear-pump actuator as entries of a row.

    Returns
    -------
    dict[str, Any]
        As `diagnose_to_row` returns them.
    """
    if not found.probabilities:
        return _without_class(found)
    (best, first), (second, other) = sorted(found.probabilities.items(), key=lambda item: -item[1])[:2]
    margin, severities = first / max(other, 1e-300), {"quantities": json.dumps(_severities(found))}
    if found.unknown:
        said = f"{_why_unknown(found)}; the nearest of the nine conditions is {condition_in_words(best)}"
        against = json.dumps([{"code": str(one.code), "data": dict(one.data)} for one in found.against])
        return {"outcome": "mismatch", "reason": said, "trusted": False, "against": against, **severities}
    if margin < DISTINCT_RATIO:
        both = f"{condition_in_words(best)} and {condition_in_words(second)}"
        said = f"no class: under this drive {both} look alike; drive the actuator with steps"
        return {"outcome": "not_observable", "reason": said, "margin": margin}
    row = {"outcome": "ok", "found_condition": best, "runner_up": second, "margin": margin, "trusted": True}
    return {**row, **severities}


def _why_unknown(found: Finding) -> str:
    """Return the evidence against the nine conditions; if sensors or columns are wrong, return only that evidence."""
    wrong = [one for one in found.against if one.code in WRONG_INPUT]
    more = [one for one in found.against if one.code != AgainstCode.OUTSIDE_CONDITIONS]
    return "; ".join(map(str, wrong or more or found.against))


def _severities(found: Finding) -> dict[str, Any]:
    """Return the severities that the log determines, each with its healthy value and its limit."""
    healthy, limits = found.healthy, found.evidence.diagnosis.limits
    return {
        name: {**quantity_entry(one), "healthy": float(healthy[name]), "limit": limits.get(name)}
        for name, one in found.severities.items()
        if one.value is not None and math.isfinite(one.value)
    }


def _without_class(found: Finding) -> dict[str, Any]:
    """Return the entries of a log that has no probabilities, because it holds too little or no circuit fits."""
    said = "; ".join(str(note) for note in (*found.notes, *found.against) if note.code in NO_CLASS_CODES)
    outcome = Outcome.FAILED if found.outcome is Outcome.OK else found.outcome
    return {"outcome": outcome.value, "reason": said, "trusted": False}
