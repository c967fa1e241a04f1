"""Whether a model does clearly worse on another log than on held-back blocks of the logs to which it was fitted."""

from estimation.identification.free_run.model import FreeRunModel
from estimation.identification.free_run.quality import FreeRunQuality
from estimation.identification.notes import IdentificationCode
from plant.notes import Note

CLEARLY_WORSE = 1.5
"""Ratio of the errors from which another log counts as unlike the fitted ones [dimensionless]."""


def validation_notes(model: FreeRunModel, quality: FreeRunQuality, expected: float, logs: str) -> list[Note]:
    """Return a note if a model leaves clearly more of another log than of held-back blocks.

    The error must be larger in the output's unit and as a share of its deviation: a larger drive raises the first
    alone, and noise in a log of small motion the second alone.

    Parameters
    ----------
    model : FreeRunModel
        The fitted model.
    quality : FreeRunQuality
        Its quality on the other log.
    expected : float
        `Identified.expected_error` [dimensionless].
    logs : str
        Name of the other log for the reader.

    Returns
    -------
    list of Note
        One at most.
    """
    left, bar = 1.0 - quality.fit_percent / 100.0, CLEARLY_WORSE * expected
    # comparisons with NaN are false: without an expected error, or without a fit, nothing is told
    if left > bar and quality.rmse > bar * model.scaling.y_std:
        return [IdentificationCode.VALIDATED_WORSE.note(output=model.output, logs=logs, left=left, held_back=expected)]
    return []
