"""`Identified`: a model with what it was chosen by."""

from dataclasses import dataclass, replace
from typing import Any

from estimation.arrays import Array
from estimation.identification.free_run.data import Channels
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
    above : tuple of float, or of ndarray, shape (n,)
        How much each log's offset is above the model's, or its trend; empty where they have none [output unit].
    gain_std : tuple of float
        Standard deviation of the steady gain from each of several inputs of a linear model [output unit / input unit].
    """

    model: FreeRunModel
    quality: FreeRunQuality
    held_back_percent: float
    candidates: tuple[dict[str, Any], ...]
    notes: tuple[Note, ...]
    sound: bool
    above: tuple[float | Array, ...] = ()
    gain_std: tuple[float, ...] = ()

    def at_one_offset(self, data: Channels) -> Channels:
        """Return the fitted logs with the model's offset, where each has its own or drifts."""
        if len(self.above) != len(data.y):  # one offset, or logs that were split at gaps for the fit
            return data
        return replace(data, y=tuple(y - one for y, one in zip(data.y, self.above, strict=True)))
