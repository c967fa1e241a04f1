"""`Identified`: a model with the evidence for its choice."""

from dataclasses import dataclass, replace
from math import nan
from typing import Any

from estimation.arrays import Array
from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.model import FreeRunModel
from estimation.identification.free_run.quality import FreeRunQuality
from estimation.identification.notes import IdentificationCode
from plant.notes import Note

LEVEL_DOES_NOT_HOLD = frozenset(
    {
        IdentificationCode.RANDOM_WALK,
        IdentificationCode.WALK_FOLLOWED,
        IdentificationCode.OFFSETS_DIFFER,
        IdentificationCode.TREND,
    }
)
"""Notes by which a free run does not follow the level of another log."""


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

    @property
    def expected_error(self) -> float:
        """Error on logs like the fitted ones, over the output's deviation in these; NaN if their level may differ."""
        if not LEVEL_DOES_NOT_HOLD.isdisjoint(note.code for note in self.notes):
            return nan
        return 1.0 - self.held_back_percent / 100.0

    def at_one_offset(self, data: Channels) -> Channels:
        """Return the fitted logs with the model's offset, if each has its own or drifts."""
        if len(self.above) != len(data.y):  # one offset, or logs that were split at gaps for the fit
            return data
        return replace(data, y=tuple(y - one for y, one in zip(data.y, self.above, strict=True)))
