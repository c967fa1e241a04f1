"""`told_once(record) -> Record`: a reading that an encoder repeats at rest counts once, not in every row.

An encoder rounds. While the piston moves, what it is off by changes from row to row and cancels over each of its steps.
While it rests, all rows are off by the same, and a filter that takes them for samples of their own believes their mean.
"""

import numpy as np

from estimation.log_checks.channel_names import POSITION
from estimation.log_checks.measurement_noise import position_variance
from estimation.trust.whiteness import quantum
from plant.arrays import Array
from plant.log.record import Record

ROUNDED = 2.0
"""Noise over that of rounding alone below which equal readings are one, and no chance [dimensionless]."""

REST = 10
"""Rows of one reading that are a rest [samples]. Of two rows, as at 10 kHz, neither is the middle: with the first of
them alone bulk modulus was 15 deviations off."""


def told_once(record: Record) -> Record:
    """Return a log in which position stands once where it is repeated, if it is rounded more than it is noisy.

    Returns
    -------
    Record
        The log itself where position is missing, never moves, or has noise of its own.

    Examples
    --------
    >>> turned = np.array([0.0, 0.0, 1e-6, 3e-6] + 100 * [4e-6])
    >>> int(np.count_nonzero(np.isfinite(told_once(Record(1e-3, {"position_m": turned}))["position_m"])))
    5
    """
    if POSITION not in record:
        return record
    resolved = quantum(record[POSITION])
    noisy = not 0.0 < resolved < np.inf or position_variance(record[POSITION]) > ROUNDED * resolved**2 / 12.0
    return record if noisy else record.replace(**{POSITION: middles(record[POSITION])})


def middles(values: Array) -> Array:
    """Return values of which each that is repeated for long stands in the middle of its rows alone.

    That is where a slow motion is nearest to it: at both ends it is half a step away. The first row stays: there a
    filter begins.

    Parameters
    ----------
    values : ndarray, shape (n,)
        A channel [any unit]; NaN is missing.

    Returns
    -------
    ndarray, shape (n,)
        [unit of the channel].
    """
    first = np.flatnonzero(np.diff(values, prepend=np.nan) != 0.0)
    after = np.append(first[1:], len(values))
    rests = after - first >= REST
    once = np.where(np.repeat(rests, after - first), np.nan, values)
    rows = np.append((first + after - 1)[rests] // 2, 0)
    once[rows] = values[rows]
    return once
