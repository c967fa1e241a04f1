"""From logs to channels: columns chosen, gaps of inputs bridged, everything on one sample time."""

import warnings
from collections.abc import Sequence

import numpy as np

from estimation.identification.free_run.data import Channels, channels_from
from estimation.identification.notes import IdentificationCode
from estimation.identification.signals.preprocess import resample
from estimation.log_checks.bridging import bridged
from plant.arrays import Array
from plant.errors import HydrostateError, LogWarning
from plant.log.record import Record

SAME_CLOCK = 1e-3
"""Share by which sample times may differ and still be one."""


def channels_of(
    records: Sequence[Record], inputs: Sequence[str], output: str, sample_time: float | None = None
) -> Channels:
    """Return inputs and one output of logs on one sample time.

    Parameters
    ----------
    records : sequence of Record
        One log or several.
    inputs, output : sequence of str, str
        Channels.
    sample_time : float, optional
        Wanted [s]; the longest of the logs' unless told.

    Returns
    -------
    Channels
        Gaps of the output are NaN; those of inputs are bridged by straight lines.

    Raises
    ------
    HydrostateError
        If a channel is missing, input and output are one, or a channel does not vary.

    Warns
    -----
    LogWarning
        If samples of an input are bridged.
    """
    if output in inputs:
        raise HydrostateError(f"input and output must be different channels, got {output!r} for both")
    wanted = max(one.sample_time for one in records) if sample_time is None else sample_time
    u, y = list[Array](), list[Array]()
    for record in records:
        columns = [_on_clock(without_gaps(record[name], name), record.sample_time, wanted) for name in inputs]
        u.append(np.column_stack(columns))
        y.append(_on_clock(record[output], record.sample_time, wanted))
    return channels_from(u, y, wanted, inputs, output)


def _on_clock(values: Array, sample_time: float, wanted: float) -> Array:
    if abs(sample_time - wanted) <= SAME_CLOCK * wanted:
        return np.array(values, dtype=np.float64)
    return resample(values, sample_time, wanted)


def without_gaps(values: Array, name: str) -> Array:
    """Return an input with its gaps bridged by straight lines, and warn of them.

    Parameters
    ----------
    values : ndarray, shape (n,)
        The input [any unit]; NaN where missing.
    name : str
        Its channel, for the warning.

    Returns
    -------
    ndarray, shape (n,)
        The input without gaps, in its unit.

    Warns
    -----
    LogWarning
        If samples are bridged.
    """
    n_missing = int(np.count_nonzero(np.isnan(values)))
    if n_missing == 0:
        return values
    said = IdentificationCode.INPUT_BRIDGED.note(channel=name, count=n_missing, total=values.size)
    warnings.warn(LogWarning(said), stacklevel=3)
    return bridged(values)
