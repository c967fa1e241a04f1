"""Merges loggers of one test onto the clock of the faster one, for the time in which both ran."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from plant.arrays import Array
from plant.errors import LogError
from plant.log.clock.jitter import GAP, Grid, resampled
from plant.log.clock.uniform import FEWEST_SAMPLES, CheckedLog, on_uniform_clock
from plant.log.columns import TIME
from plant.log.notes import LogCode
from plant.notes import Note

_LATEST = np.datetime64("2262-01-01", "ns")

SAME_TIME_TOLERANCE = 1e-3
"""Share of a step by which stamps of one clock may differ [fraction]."""


@dataclass(frozen=True, eq=False)
class LoggerChannels:
    """Channels of one logger, or of one group in a file.

    Parameters
    ----------
    source : str
        What messages call it.
    time : ndarray, shape (n,)
        When its rows were taken: seconds, or datetime64[ns].
    channels : Mapping[str, ndarray, shape (n,)]
        The rest, in SI.
    label : str
        The group in the file.
    """

    source: str
    time: Any
    channels: Mapping[str, Array]
    label: str = ""

    @property
    def name(self) -> str:
        """Name in notes: the label, else the file's name."""
        return self.label or self.source.replace("\\", "/").rsplit("/", 1)[-1]


@dataclass(frozen=True, eq=False)
class MergedChannels:
    """Channels on a common clock.

    Parameters
    ----------
    channels : Mapping[str, ndarray, shape (n,)]
        ``time_s`` and the channels.
    notes : tuple of Note
        What was put together.
    """

    channels: Mapping[str, Any]
    notes: tuple[Note, ...] = ()


def merge_loggers(parts: Sequence[LoggerChannels], source: str) -> MergedChannels:
    """Return the channels of several loggers on the clock of the fastest, for the time in which all ran.

    Stamps with dates are compared directly. Seconds are assumed to count from the same moment in all loggers.

    Returns
    -------
    MergedChannels
        Channels on one time; those of slower loggers are missing between their samples, and those of a logger that took
        no sample everywhere.

    Raises
    ------
    LogError
        If some have dates and others have not, they do not overlap, or the stamps of one are no clock's.
    """
    parts = [one for one in parts if one.channels]
    if len(kept := [one for one in parts if _has_samples(one)]) < len(parts) and kept:
        merged = merge_loggers(kept, source)
        nothing = np.full(len(merged.channels[TIME]), np.nan)
        empty = {name: nothing for one in parts if not _has_samples(one) for name in one.channels}
        return MergedChannels({**merged.channels, **empty}, merged.notes)
    if len(parts) == 1 or all(_same_time(parts[0].time, one.time) for one in parts[1:]):
        together = {name: values for one in parts for name, values in one.channels.items()}
        return MergedChannels({TIME: parts[0].time, **together} if parts else {})
    dated = [one.time.dtype.kind == "M" for one in parts]
    if any(dated) and not all(dated):
        raise LogError(
            f"{parts[dated.index(True)].name} has dates and {parts[dated.index(False)].name} has not, so they cannot "
            "be laid beside each other; give both the same kind of time",
            source,
        )
    epoch = min(one.time[~np.isnat(one.time)].min(initial=_LATEST) for one in parts) if dated[0] else None
    notes: list[Note] = []
    checked = [_on_own_clock(one, epoch, source, notes) for one in parts]
    fastest = min(checked, key=lambda one: one.sample_time)
    T = fastest.sample_time
    begin = max(one.start_time for one in checked)
    end = min(one.start_time + one.sample_time * (_length(one) - 1) for one in checked)
    first = int(np.ceil((begin - fastest.start_time) / T - SAME_TIME_TOLERANCE))
    count = int(np.floor((end - fastest.start_time) / T + SAME_TIME_TOLERANCE)) - first + 1
    if count < FEWEST_SAMPLES:
        spans = " and ".join(f"{one.name} ({_span(one.time)})" for one in parts)
        few = f"overlap in {count} samples, at least {FEWEST_SAMPLES} are needed"
        apart = few if count > 0 else f"do not overlap in time{_exchanged_date_advice(parts) if dated[0] else ''}"
        raise LogError(f"{spans} {apart}", source)
    even: Array = fastest.start_time + T * (first + np.arange(count, dtype=np.float64))
    channels: dict[str, Any] = {}
    for one in checked:
        channels |= _at_common_times(even, T, one, is_fastest=one is fastest, first=first)
    names = " and ".join(one.name for one in parts)
    notes.append(LogCode.LOGGERS_MERGED.note(loggers=names, duration_s=T * (count - 1), sample_time_s=T))
    time: Any = even if epoch is None else epoch + np.rint(1e9 * even).astype("timedelta64[ns]")
    return MergedChannels({TIME: time, **channels}, tuple(notes))


def _has_samples(one: LoggerChannels) -> bool:
    """Return whether a logger took any sample: a bus may never have sent a message."""
    return bool(np.any(~np.isnat(one.time) if one.time.dtype.kind == "M" else np.isfinite(one.time)))


def _same_time(one: Any, other: Any) -> bool:
    if len(one) != len(other) or one.dtype.kind != other.dtype.kind or len(one) < 2:
        return False
    apart, step = np.abs(one - other).max(), np.abs(one[-1] - one[0]) / (len(one) - 1)
    return bool(apart <= SAME_TIME_TOLERANCE * step)


def _span(time: Any) -> str:
    """Return the first and last time of stamps, in words."""
    if time.dtype.kind != "M":
        there = time[np.isfinite(time)]
        return f"{there.min():g} to {there.max():g} s"
    first, last = (str(end.astype("datetime64[s]")).replace("T", " ") for end in (np.nanmin(time), np.nanmax(time)))
    return f"{first} to {last}"


def _exchanged_date_advice(parts: Sequence[LoggerChannels]) -> str:
    """Return advice if loggers would be of the same day with day and month exchanged in one of them."""
    days = [str(np.nanmin(one.time).astype("datetime64[D]")).split("-") for one in parts]
    turned = {(year, day, month) for year, month, day in days} & {tuple(day) for day in days}
    if not turned or len({tuple(day) for day in days}) == 1:
        return ""
    return "; day and month may be exchanged in one of them: write dates as 2026-03-31"


def _length(one: CheckedLog) -> int:
    return len(next(iter(one.channels.values())))


def _on_own_clock(one: LoggerChannels, epoch: Any, source: str, notes: list[Note]) -> CheckedLog:
    """Return a logger's channels on its own uniform clock."""
    time = (
        one.time if epoch is None else np.where(np.isnat(one.time), np.nan, (one.time - epoch).astype(np.int64) * 1e-9)
    )
    there = np.isfinite(time)
    if there.sum() < FEWEST_SAMPLES:
        raise LogError(f"{one.name} must have at least {FEWEST_SAMPLES} samples with a time, got {there.sum()}", source)
    columns = {name: values[there] for name, values in {TIME: time, **one.channels}.items()}
    return on_uniform_clock(columns, source, None, notes)


def _at_common_times(even: Array, T: float, one: CheckedLog, *, is_fastest: bool, first: int) -> dict[str, Array]:
    """Return a logger's channels at the times of the common clock; missing where it has no sample nearby."""
    if is_fastest:
        return {name: values[first : first + len(even)] for name, values in one.channels.items()}
    times: Array = one.start_time + one.sample_time * np.arange(_length(one), dtype=np.float64)
    slots = np.unique(np.rint((times - even[0]) / T).astype(np.int64))
    slots = slots[(slots >= 0) & (slots < len(even))]
    grid = Grid(even[slots], one.sample_time, GAP * one.sample_time, 0.0, 0.0)
    out: dict[str, Array] = {}
    for name, values in one.channels.items():
        out[name] = np.full(len(even), np.nan)
        out[name][slots] = resampled(grid, times, values)
    return out
