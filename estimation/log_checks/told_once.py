"""`with_repeats_used_once(record) -> Record`: a repeated encoder reading is used where it changes, and once at rest.

An encoder rounds. Where its reading changes, the piston is halfway between the two readings, and their errors cancel.
Between changes all rows have the same error: a filter that takes them for independent samples believes their mean.
While the piston slows down before a rest or a reversal, that mean lags behind, the more so the faster the samples.
"""

import numpy as np

from estimation.log_checks.channel_names import POSITION
from estimation.log_checks.measurement_noise import position_variance
from estimation.trust.whiteness import quantum
from plant.arrays import Array
from plant.log.record import Record

ROUNDED = 2.0
"""Noise over that of rounding alone below which equal readings are no chance [dimensionless]."""

REST = 10
"""Rows of one reading that are a rest [samples], of which the middle is used. Of two rows neither is the middle: with
the first of them alone bulk modulus was 15 deviations off at 10 kHz."""

ROWS_OF_SLOW_CHANGE = 2
"""Rows of a reading from which its changes are slow [samples]: the piston then moves at most half a step per row, and
the rows beside a change are wrong by half a step in opposite directions. After a faster change it may rest at once,
with the same error as in the middle of the rest, which would count twice: at 1 kHz bulk modulus was half a deviation
high."""


def with_repeats_used_once(record: Record) -> Record:
    """Return a log in which a repeated position is used once, if its rounding exceeds its noise.

    Returns
    -------
    Record
        The log itself if position is missing, never moves, or has noise of its own.

    Examples
    --------
    >>> turned = np.array([0.0, 0.0, 1e-6, 3e-6] + 100 * [4e-6])
    >>> int(np.count_nonzero(np.isfinite(with_repeats_used_once(Record(1e-3, {"position_m": turned}))["position_m"])))
    5
    """
    if POSITION not in record:
        return record
    resolved = quantum(record[POSITION])
    noisy = not 0.0 < resolved < np.inf or position_variance(record[POSITION]) > ROUNDED * resolved**2 / 12.0
    return record if noisy else record.replace(**{POSITION: changes_and_rests(record[POSITION])})


def changes_and_rests(values: Array) -> Array:
    """Return values without the rows in which they repeat themselves, except for the middle of each rest.

    The rows before and after a change are kept, unless a rest follows a fast motion. A rest is represented by its
    middle, where a slow motion is nearest to the reading. The first row is kept: a filter begins there.

    Parameters
    ----------
    values : ndarray, shape (n,)
        A channel [any unit]; NaN is missing.

    Returns
    -------
    ndarray, shape (n,)
        [unit of the channel].
    """
    if not len(values):
        return np.array(values)
    first = np.flatnonzero(np.diff(values, prepend=np.nan) != 0.0)
    after = np.append(first[1:], len(values))
    count = after - first
    rests, slow = count >= REST, np.pad(count >= ROWS_OF_SLOW_CHANGE, 1)
    begins, ends, middles = first[~rests | slow[:-2]], after[~rests | slow[2:]] - 1, (first + after - 1)[rests] // 2
    kept = np.concatenate([[0], begins, ends, middles])
    told = np.full(len(values), np.nan)
    told[kept] = values[kept]
    return told
