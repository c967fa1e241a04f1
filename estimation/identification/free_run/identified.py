"""`Identified`: a model with what it was chosen by."""

from dataclasses import dataclass
from typing import Any

from estimation.identification.free_run.model import FreeRunModel, FreeRunQuality
from plant.notes import Note


@dataclass(frozen=True, eq=False)
class Identified:
    """A model with what it was chosen by.

    Parameters
    ----------
    quality : FreeRunQuality
        On the data that it was fitted to.
    held_back_percent : float
        Fit of the free run on blocks held back, each by a fit to the others; NaN where there were none.
    candidates : tuple of dict
        Everything that was compared: structure, order, delays, held-back fit and information criteria.
    notes : tuple of Note
        What was passed over, or is doubtful.
    sound : bool
        Whether the model may be believed.
    """

    model: FreeRunModel
    quality: FreeRunQuality
    held_back_percent: float
    candidates: tuple[dict[str, Any], ...]
    notes: tuple[Note, ...]
    sound: bool
