"""Doubt about an output that leaves its course for one and the same number, as a sensor without contact does."""

import numpy as np

from estimation.arrays import Array
from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.model import FreeRunModel
from estimation.identification.notes import IdentificationCode
from estimation.log_checks.order import median
from plant.notes import Note

FEWEST_DROPS, LEAST_DROPPED, MOST_DROPPED = 5, 0.005, 0.5
"""Times that an output drops out [count], and shares of the samples that are then lost [fraction]; judged."""

AWAY, RETURNS, UNEXPLAINED = 0.3, 0.2, 2.0
"""Median distance of the number from its neighbours over the deviation of other samples, median difference between
neighbours before and after over that distance, and the model's median error there over that elsewhere
[dimensionless]; judged."""

FEWEST_NEIGHBOURS = 5
"""Distinct neighbours of the number: a converter that chatters between two counts has two [count]."""


def dropped_value(y: Array) -> float | None:
    """Return the number to which an output drops again and again, from wherever it is; None if there is none.

    Parameters
    ----------
    y : ndarray, shape (n,)
        NaN where missing.

    Returns
    -------
    float or None
        In the output's unit.

    Examples
    --------
    >>> course = np.sin(0.1 * np.arange(200))
    >>> dropped_value(course), dropped_value(np.where(np.arange(200) % 9 == 5, 0.0, course))
    (None, 0.0)
    """
    values = y[np.isfinite(y)]
    if not values.size:
        return None
    distinct, counts = np.unique(values, return_counts=True)
    value, count = float(distinct[np.argmax(counts)]), int(counts.max())
    if not max(FEWEST_DROPS, LEAST_DROPPED * values.size) <= count <= MOST_DROPPED * values.size:
        return None
    there = np.concatenate([[True], values == value, [True]]).astype(int)
    begins = np.flatnonzero(np.diff(there) == 1)  # of a run, or the end of the log
    ends = np.flatnonzero(np.diff(there) == -1)
    inner = values[begins[:-1] - 1], values[ends[1:]]
    if begins.size - 1 < FEWEST_DROPS:
        return None
    away = median(np.abs(value - (inner[0] + inner[1]) / 2.0))
    back = median(np.abs(inner[1] - inner[0]))
    varied = np.unique(np.concatenate(inner)).size >= FEWEST_NEIGHBOURS
    far = away > AWAY * float(np.std(values[values != value]))
    return value if varied and far and back < RETURNS * away else None


def dropout_notes(model: FreeRunModel, data: Channels) -> list[Note]:
    """Return a note if an output drops to one number that the model does not follow.

    Parameters
    ----------
    model : FreeRunModel
        Fitted to the logs.
    data : Channels
        In units of the channels.
    """
    y = np.concatenate(data.y)
    value = dropped_value(y)
    if value is None:
        return []
    left = np.abs(np.concatenate([model.simulate(u, one) for u, one in zip(data.u, data.y, strict=True)]) - y)
    there, known = y == value, np.isfinite(left)
    dropped, others = left[there & known], left[~there & known]
    if not (len(dropped) and len(others) and median(dropped) > UNEXPLAINED * median(others)):
        return []
    told = {"value": value, "count": int(np.count_nonzero(there)), "total": int(np.count_nonzero(np.isfinite(y)))}
    return [IdentificationCode.DROPS_OUT.note(output=data.output, **told)]
