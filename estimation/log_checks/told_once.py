"""`told_once(record) -> Record`: a reading that an encoder repeats counts where it changes, and once at rest.

An encoder rounds. Where its reading changes, the piston is halfway between the two readings, and their errors cancel.
Between changes all rows are off alike: a filter that takes them for samples of their own believes their mean. While the
piston slows down before a rest or a reversal, that mean lies behind it, and more so the faster the samples.
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
"""Rows of one reading that are a rest [samples], of which the middle counts. Of two rows neither is the middle: with
the first of them alone bulk modulus was 15 deviations off at 10 kHz."""

SLOW = 2
"""Rows of a reading from which its changes are slow [samples]: the piston then moves half a step a row at most, and the
rows beside a change are off by half a step, one up and one down. After a faster change it may rest at once, as far off
as in the middle of the rest, and would count twice: at 1 kHz bulk modulus was half a deviation high."""


def told_once(record: Record) -> Record:
    """Return a log in which a repeated position is told once, if it is rounded more than it is noisy.

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
    return record if noisy else record.replace(**{POSITION: changes_and_rests(record[POSITION])})


def changes_and_rests(values: Array) -> Array:
    """Return values without the rows in which they repeat themselves, but for the middle of each rest.

    The rows before and after a change stay, unless a rest lies beside a fast motion. A rest counts in its middle, where
    a slow motion is nearest to the reading. The first row stays: there a filter begins.

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
    rests, slow = count >= REST, np.pad(count >= SLOW, 1)
    begins, ends, middles = first[~rests | slow[:-2]], after[~rests | slow[2:]] - 1, (first + after - 1)[rests] // 2
    kept = np.concatenate([[0], begins, ends, middles])
    told = np.full(len(values), np.nan)
    told[kept] = values[kept]
    return told
