"""Verdict by the errors of nine nominal models alone: outcome, ranking, and whether any model fits."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from estimation.finding import Finding, Outcome
from estimation.log_checks.channel_names import POSITION, VELOCITY
from estimation.notes import RigCode
from faults.diagnosis.rmse import Scores, measured_velocity
from faults.notes import AgainstCode, ClassCode
from plant.errors import LogError
from plant.log.record import Record
from plant.notes import Note

LEAST_MARGIN = 1.001
"""Least ratio of the runner-up's score to the best for a class to be named [dimensionless]."""

POOR_FIT = 0.5
"""Share of the signal that the best model may leave unexplained [fraction]."""


class ModelsVerdict(NamedTuple):
    """Verdict of the nine models.

    Parameters
    ----------
    outcome : Outcome
        Not observable if a channel is 0 throughout, or all models move alike.
    notes : tuple of Note
        Why there is no class, if there is none.
    against : tuple of Note
        Reasons against all nine.
    """

    outcome: Outcome
    notes: tuple[Note, ...]
    against: tuple[Note, ...]


def ranked_conditions(scores: Scores) -> list[tuple[str, float]]:
    """Return the conditions, the least error first.

    Parameters
    ----------
    scores : Scores
        Errors of the nine models.

    Returns
    -------
    list of tuple
        Condition, and score in its unit; one that diverged comes last.
    """
    return sorted(scores.by_condition.items(), key=lambda item: item[1] if math.isfinite(item[1]) else math.inf)


def error_margin(scores: Scores) -> float:
    """Return the ratio of the runner-up's error to the best.

    Parameters
    ----------
    scores : Scores
        Errors of the nine models.

    Returns
    -------
    float
        The ratio [dimensionless]; 1 if both are zero, NaN if all models diverged.
    """
    (_, least), (_, next_least) = ranked_conditions(scores)[:2]
    if not math.isfinite(least):
        return math.nan
    return next_least / least if least > 0.0 else (math.inf if next_least > 0.0 else 1.0)


def models_verdict(scores: Scores, record: Record) -> ModelsVerdict:
    """Judge a log by the errors of nine models.

    Returns
    -------
    ModelsVerdict
        The outcome, and why.
    """
    if unmeasured := _zero_channels(scores.channels, record):
        return ModelsVerdict(Outcome.NOT_OBSERVABLE, (ClassCode.CHANNEL_ZERO.note(channels=unmeasured),), ())
    ratio = error_margin(scores)
    if math.isnan(ratio):
        return ModelsVerdict(Outcome.DIVERGED, (ClassCode.MODELS_DIVERGED.note(),), ())
    unexplained = min(scores.by_condition.values())
    if len(scores.channels) == 1:
        size = float(np.sqrt(np.nanmean(measured_velocity(record) ** 2)))
        unexplained = unexplained / size if size > 0.0 else 0.0
    poor = unexplained > POOR_FIT
    if poor:  # if no model is near the log, two different ones may have equal errors
        finite = [score for score in scores.by_condition.values() if math.isfinite(score)]
        ratio = max(finite) / min(finite)
    if ratio < LEAST_MARGIN:
        return ModelsVerdict(Outcome.NOT_OBSERVABLE, (ClassCode.MODELS_ALIKE.note(),), ())
    return ModelsVerdict(Outcome.OK, (), (AgainstCode.NONE_FITS.note(percent=100.0 * unexplained),) if poor else ())


def without_condition(found: Finding, error: LogError) -> Finding:
    """Return the finding on a log that is too short for a circuit: nominal models alone often name a wrong condition.

    Parameters
    ----------
    found : Finding
        What is known of the log without a circuit.
    error : LogError
        Why no circuit can be fitted.

    Returns
    -------
    Finding
        Not observable, with the reason. The note on pump wear is left out: there is no class that wear could change.
    """
    kept = (note for note in found.notes if note.code is not RigCode.WEAR_NOT_EXCLUDED)
    notes = (*kept, ClassCode.NO_PROBABILITIES.note(reason=error.message))
    return replace(found, outcome=Outcome.NOT_OBSERVABLE, notes=notes)


def _zero_channels(channels: Sequence[str], record: Record) -> str:
    """Return the channels that are 0 in every sample, in words; empty if there are none."""
    values = {name: measured_velocity(record) if name == VELOCITY else record[name] for name in channels}
    silent = [name for name, one in values.items() if not np.any(np.nan_to_num(one))]
    return " and ".join(name if name in record else f"the velocity from {POSITION}" for name in silent)
