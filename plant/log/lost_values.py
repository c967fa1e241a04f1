"""Numbers such as -9999 that a logger writes for a lost sample."""

import numpy as np

from plant.arrays import Array
from plant.log.notes import LogCode
from plant.notes import Note

_WRITTEN = (
    *(999.0, 9999.0, 99999.0, 999999.0, 999.25, 9999.25, 32767.0, 32768.0, 65535.0, 2147483647.0, 2147483648.0),
    *(4294967295.0, 1e20, 1e30, 1e31, 1e36, 1e37, 9.9e37, 9.91e37, 1e38, float(np.finfo(np.float32).max)),
)
LOST_VALUES = frozenset(sign * float(kind(one)) for one in _WRITTEN for sign in (1, -1) for kind in (float, np.float32))
"""Such numbers in the file's own unit: nines, ends of integers, SCPI's 9.91e37 and others (judged)."""

FEWEST, MOST = 2, 0.5
"""How often it must come, and the share of the samples that it may have [count, fraction]; judged."""

MANY, FAR = 0.1, 10.0
"""Above this share [fraction], the number must be so many ranges of the other samples away [dimensionless]; judged."""


KNOWN, IN_A_ROW = 100, 50
"""In a stream: samples before one can stand out, and as many in a row that are left out [count]; judged."""


class LostInStream:
    """Tells which samples of a stream are numbers that a logger writes for lost ones.

    A number is lost if it lies outside the range of all earlier samples by more than that range. A number that stays is
    accepted after `IN_A_ROW` samples.

    Examples
    --------
    >>> lost = LostInStream()
    >>> any(lost.is_lost(0.01 * k) for k in range(KNOWN)), lost.is_lost(-9999.0), lost.is_lost(0.5)
    (False, True, False)
    """

    def __init__(self) -> None:
        self._low, self._high = float("inf"), float("-inf")
        self._known = self._together = 0

    def is_lost(self, value: float) -> bool:
        """Return whether the next sample marks a lost value. NaN does not.

        Parameters
        ----------
        value : float
            As the stream has it [any unit].
        """
        if value != value:
            return False
        reach = self._high - self._low
        stands_out = self._known >= KNOWN and max(self._low - value, value - self._high) > reach > 0.0
        if stands_out and value in LOST_VALUES and self._together < IN_A_ROW:
            self._together += 1
            return True
        self._together = 0
        self._known += 1
        self._low, self._high = min(self._low, value), max(self._high, value)
        return False


def without_lost(values: Array, channel: str) -> tuple[Array, list[Note]]:
    """Return a column without the number that marks lost samples, and a note.

    The number must be one of `LOST_VALUES`, occur at least twice, and lie outside the range of all other samples by
    more than that range; by ten times that range if it is in more than a tenth of the samples.

    Parameters
    ----------
    values : ndarray, shape (n,)
        As the file has them [any unit]; NaN where missing.
    channel : str
        What the note calls the column.

    Returns
    -------
    tuple of ndarray, shape (n,), and list of Note
        The column, NaN where a sample was lost.

    Examples
    --------
    >>> course = np.append(np.linspace(0.0, 0.2, 50), [-9999.0, -9999.0])
    >>> int(np.isnan(without_lost(course, "position_m")[0]).sum())
    2
    """
    notes: list[Note] = []
    if values.dtype.kind != "f" or not len(values):
        return values, notes
    for end in (float(np.fmin.reduce(values)), float(np.fmax.reduce(values))):
        if end not in LOST_VALUES:
            continue
        lost = values == end
        count, rest = int(lost.sum()), values[~lost & np.isfinite(values)]
        if not len(rest) or not FEWEST <= count <= MOST * len(values):
            continue
        low, high = float(rest.min()), float(rest.max())
        apart = max(low - end, end - high)
        if apart > high - low and (count <= MANY * len(values) or apart > FAR * (high - low) > 0.0):
            values = np.where(lost, np.nan, values)
            notes.append(LogCode.LOST_VALUE.note(channel=channel, value=end, count=count, total=len(values)))
    return values, notes
