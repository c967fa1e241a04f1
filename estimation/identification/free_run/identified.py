"""`Identified`: a model with the evidence for its choice."""

from dataclasses import dataclass, replace
from typing import Any

from estimation.arrays import Array
from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.model import FreeRunModel, FreeRunQuality
from plant.notes import Note


@dataclass(frozen=True, eq=False)
class Identified:
    """A model with the evidence for its choice.

    Parameters
    ----------
    quality : FreeRunQuality
        On the data to which it was fitted.
    held_back_percent : float
        Fit of the free run on held-back blocks, each by a fit to the others; NaN if there are none.
    candidates : tuple of dict
        Everything that was compared: structure, order, delays, held-back fit and information criteria.
    notes : tuple of Note
        Rejected models, and doubts.
    sound : bool
        Whether the model may be believed.
    above : tuple of float, or of ndarray, shape (n,)
        Offset of each log relative to the model's, or its trend; empty if they have none [output unit].
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
        """Return the fitted logs with the model's offset, if each has its own or drifts."""
        if len(self.above) != len(data.y):  # one offset, or logs that were split at gaps for the fit
            return data
        return replace(data, y=tuple(y - one for y, one in zip(data.y, self.above, strict=True)))
