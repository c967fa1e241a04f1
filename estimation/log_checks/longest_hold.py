"""Refuse a sensor that is constant for long, if nothing else in a log shows whether it froze."""

from collections.abc import Iterable

import numpy as np

from plant.errors import LogError
from plant.log.record import Record

LONGEST_HOLD = 0.05
"""Largest share of a log for which a live sensor is constant [fraction] (judged): it has noise, and follows a drive of
some ten cycles or more."""


def require_live(record: Record, names: Iterable[str]) -> None:
    """Refuse a log in which one of these channels is constant for long.

    Raises
    ------
    LogError
        If one holds a value for more than a twentieth of the log.

    Examples
    --------
    >>> require_live(Record(1e-3, {"position_m": [0.0, 1.0, 2.0, 2.0]}), ["position_m"])
    Traceback (most recent call last):
    plant.errors.LogError: position_m holds one value for 2 ms: the sensor froze, clips, or has too coarse steps
    """
    for name in names:
        moved = np.flatnonzero(np.diff(record[name], prepend=np.nan, append=np.nan))
        held = int(np.max(np.diff(moved)))
        if held > max(1.0, LONGEST_HOLD * len(record)):
            length = f"{1e3 * held * record.sample_time:.3g} ms"
            raise LogError(f"{name} holds one value for {length}: the sensor froze, clips, or has too coarse steps")
