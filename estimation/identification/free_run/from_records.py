"""From logs to channels: columns chosen, gaps of inputs bridged or split at, everything on one sample time."""

import warnings
from collections.abc import Sequence

import numpy as np

from estimation.arrays import BoolArray
from estimation.identification.free_run.data import FEWEST, Channels, channels_from
from estimation.identification.notes import IdentificationCode
from estimation.identification.signals.preprocess import resample
from estimation.log_checks.bridging import bridged, gaps
from estimation.log_checks.sent_twice import without_rows_sent_twice
from estimation.stretches import stretches
from plant.arrays import Array
from plant.errors import HydrostateError, LogWarning
from plant.log.record import Record

SAME_CLOCK = 1e-3
"""Relative difference up to which sample times count as equal."""

LARGEST_BRIDGING_ERROR = 0.05
"""Sum of squared errors of a line over a gap, over the input's variance, from which a log is split there [samples]."""

MOST_GAPS = 30
"""Most gaps of one input at which a log is split, the worst ones: each part has an initial state to estimate."""

LONGEST_RESPONSE = 20
"""Most outputs that are left out after a gap of an input: about the length of dead times [samples]."""

MOST_TRIED_PARTS = 400
"""Most parts of an input that are bridged for comparison."""


def channels_of(
    records: Sequence[Record],
    inputs: Sequence[str],
    output: str,
    sample_time: float | None = None,
    *,
    split: bool = False,
) -> Channels:
    """Return inputs and one output of logs on one sample time.

    Parameters
    ----------
    records : sequence of Record
        One log or several.
    inputs, output : sequence of str, str
        Channels.
    sample_time : float, optional
        Requested sample time [s]; by default the longest of the logs'.
    split : bool
        Whether a log is split where an input is unknown, see `pieces`. Otherwise a model is fitted and judged on inputs
        that never were.

    Returns
    -------
    Channels
        Gaps of the output are NaN; those of inputs are bridged by straight lines.

    Raises
    ------
    HydrostateError
        If a channel is missing or named twice, input and output are one, or a channel does not vary.

    Warns
    -----
    LogWarning
        If samples of an input are bridged, a log is split, or it has fewer samples a second than are wanted.
    """
    if output in inputs:
        raise HydrostateError(f"input and output must be different channels, got {output!r} for both")
    if len(set(inputs)) < len(inputs):
        raise HydrostateError(f"each input must be named once, got {', '.join(inputs)}")
    wanted = max(one.sample_time for one in records) if sample_time is None else sample_time
    u, y = list[Array](), list[Array]()
    for record in records:
        if record.sample_time > (1.0 + SAME_CLOCK) * wanted:
            said = IdentificationCode.LOG_INTERPOLATED.note(sample_time_s=record.sample_time, wanted_s=wanted)
            warnings.warn(LogWarning(said), stacklevel=2)
        parts = pieces(record, inputs) if split else [record]
        for name in inputs:  # one warning for each input, however many parts there are
            _warn_of_bridged([part[name] for part in parts], name, stacklevel=3)
        for part in parts:
            columns = [_resampled(bridged(part[name]), part.sample_time, wanted) for name in inputs]
            answer = _resampled(part[output], part.sample_time, wanted)
            if part.start_time > record.start_time:  # after a dead time the output may still respond to unknown inputs
                answer[: min(LONGEST_RESPONSE, answer.size // 20)] = np.nan
            u.append(np.column_stack(columns))
            y.append(answer)
    return channels_from(u, y, wanted, inputs, output)


def channels_to_run(record: Record, inputs: Sequence[str], output: str, sample_time: float | None = None) -> Channels:
    """Return the channels on which a model is run: its inputs, and its output as far as the log has one.

    Parameters
    ----------
    record : Record
        The log.
    inputs, output : sequence of str, str
        Channels; the output may be missing.
    sample_time : float, optional
        Requested sample time [s]; by default the log's.

    Returns
    -------
    Channels
        A missing output is NaN throughout.

    Raises
    ------
    LogError
        If an input is missing.

    Warns
    -----
    LogWarning
        As `channels_of` does.
    """
    if output in record:
        return channels_of([record], inputs, output, sample_time)
    wanted = record.sample_time if sample_time is None else sample_time
    columns: list[Array] = []
    for name in inputs:
        _warn_of_bridged([record[name]], name, stacklevel=3)
        columns.append(_resampled(bridged(record[name]), record.sample_time, wanted))
    u = np.column_stack(columns)
    return Channels(tuple(inputs), output, wanted, (u,), (np.full(len(u), np.nan),))


def without_repeated_rows(record: Record, names: Sequence[str]) -> Record:
    """Return a log without rows that its logger wrote twice, whatever its columns are.

    Returns
    -------
    Record
        The log itself if there are none.

    Warns
    -----
    LogWarning
        If there are such rows.
    """
    found, notes = without_rows_sent_twice(record, list(dict.fromkeys(names)))
    for note in notes:
        warnings.warn(LogWarning(note), stacklevel=2)
    return found


def pieces(record: Record, inputs: Sequence[str]) -> list[Record]:
    """Split a log where an input misses samples that a straight line would get wrong.

    The error of a line is found from the input itself: complete parts as long as the gap are bridged and compared.

    Returns
    -------
    list of Record
        The log itself if nothing is wrong; otherwise its parts with at least `FEWEST` samples and a two-hundredth of
        it.

    Warns
    -----
    LogWarning
        If it is split.
    """
    unknown = np.zeros(len(record), dtype=np.bool_)
    for name in inputs:
        unknown |= _unbridged_samples(record[name])
    least = max(FEWEST, len(record) // 200)
    known = zip(*stretches(~unknown), strict=True)
    parts = [record.slice(int(a), int(b)) for a, b in known if b - a >= least]
    if not unknown.any() or not parts:
        return [record]
    worst = max(inputs, key=lambda name: int(np.isnan(record[name]).sum()))
    count = int(np.isnan(record[worst]).sum())
    said = IdentificationCode.INPUT_SPLIT.note(channel=worst, count=count, total=len(record), pieces=len(parts))
    warnings.warn(LogWarning(said), stacklevel=3)
    return parts


def _unbridged_samples(values: Array) -> BoolArray:
    """Return a mask of missing input that is not bridged: the worst `MOST_GAPS` gaps, and both ends."""
    missing = np.isnan(values)
    unknown = np.zeros(values.size, dtype=np.bool_)
    known = np.flatnonzero(~missing)
    if not missing.any() or known.size < 2:
        return unknown
    unknown[: known[0]], unknown[known[-1] + 1 :] = True, True
    wide = np.flatnonzero(gaps(values)[1])
    spoilt = [(_bridging_error(values, int(known[i + 1] - known[i] - 1)), i) for i in wide]
    for much, i in sorted(spoilt, reverse=True)[:MOST_GAPS]:
        if much > LARGEST_BRIDGING_ERROR:
            unknown[known[i] + 1 : known[i + 1]] = True
    return unknown


def _bridging_error(values: Array, length: int) -> float:
    """Return the sum of squared errors of a line over a gap, over the input's variance [samples]."""
    # at random, since evenly spaced stretches may be in step with the input's own clock
    starts = np.random.default_rng(0).integers(0, max(values.size - length - 1, 1), MOST_TRIED_PARTS)
    stretches = values[np.minimum(starts[:, None] + np.arange(length + 2), values.size - 1)]
    stretches = stretches[np.isfinite(stretches).all(axis=1)]
    spread = float(np.nanvar(values))
    if not len(stretches) or spread == 0.0:
        return float(length)
    share = np.arange(1, length + 1) / (length + 1)
    lines = stretches[:, :1] + share * (stretches[:, -1:] - stretches[:, :1])
    return float(np.mean(np.sum((stretches[:, 1:-1] - lines) ** 2, axis=1))) / spread


def _resampled(values: Array, sample_time: float, wanted: float) -> Array:
    if abs(sample_time - wanted) <= SAME_CLOCK * wanted:
        return np.array(values, dtype=np.float64)
    return resample(values, sample_time, wanted)


def without_gaps(values: Array, name: str) -> Array:
    """Return an input with its gaps bridged by straight lines, with a warning.

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
    return bridged(values) if _warn_of_bridged([values], name, stacklevel=4) else values


def _warn_of_bridged(parts: Sequence[Array], name: str, *, stacklevel: int) -> bool:
    """Warn of missing samples of an input in parts; return whether there are any."""
    lacking = sum(int(np.count_nonzero(np.isnan(one))) for one in parts)
    if lacking:
        said = IdentificationCode.INPUT_BRIDGED.note(channel=name, count=lacking, total=sum(map(len, parts)))
        warnings.warn(LogWarning(said), stacklevel=stacklevel)
    return lacking > 0
