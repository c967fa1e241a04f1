"""The uniform clock of a log: missing samples become gaps; jitter, repeats, stalls and rounding are repaired."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from plant.arrays import Array
from plant.errors import ClockError, LogError, SparseLogError
from plant.log.clock.jitter import GAP, grid_of, resampled, rounded_clock, usual_step
from plant.log.clock.jumps import stray_ends, without_jumps, without_overruns
from plant.log.clock.stalls import is_sampled_evenly, stalled_clock
from plant.log.columns import TIME
from plant.log.notes import LogCode
from plant.notes import Note

FEWEST_SAMPLES = 10
"""Samples that a log has at least [count]; judged."""

MOST_MISSING, MOST_MISSING_TO_RELATE = 0.05, 0.5
"""Share of a channel's samples, or of the clock's, that may be missing [fraction]: where an actuator is estimated, and
where channels are related. There missing outputs are left out, and a log is split where inputs are missing."""

MOST_JITTER = 0.35
"""Root mean square by which steps may differ from the sample time and still be a clock's, over it [fraction]."""

WHOLE_STEP_TOLERANCE = 0.01
"""A step so near a whole number of sample times is one [fraction]."""

ROUNDING = 1e-6
"""Share of the sample time by which stamps may be off beside what they are rounded to [fraction]; judged."""

MOST_ROUNDED = 0.1
"""Rounding of stamps to floats up to which their steps are still counted [sample times]; judged."""

_ENDS = {0: "first", -1: "last"}

Channels = Mapping[str, Array]


@dataclass(frozen=True)
class Clock:
    """A uniform clock.

    Parameters
    ----------
    sample_time : float
        Time between samples [s].
    start_time : float
        Time of the first sample [s].
    """

    sample_time: float
    start_time: float


@dataclass(frozen=True)
class CheckedLog:
    """A log on a uniform clock, with its repairs.

    Parameters
    ----------
    sample_time, start_time : float
        The clock [s].
    channels : Mapping[str, ndarray, shape (n,)]
        Array in SI, NaN where a sample is missing.
    notes : tuple[Note, ...]
        What was resampled, masked, dropped, or looks wrong.
    """

    sample_time: float
    start_time: float
    channels: Channels
    notes: tuple[Note, ...] = ()


def on_uniform_clock(
    columns: Channels, source: str, clock: Clock | None, notes: list[Note], most_missing: float = MOST_MISSING
) -> CheckedLog:
    """Return a log on a uniform clock; notes list the repairs.

    Parameters
    ----------
    columns : Mapping[str, ndarray, shape (n,)]
        ``time_s`` and the channels, in SI.
    source : str
        What messages call the log.
    clock : Clock or None
        The clock that the log was written with; used where the stamps agree with it.
    notes : list of Note
        Grows by what was mended.
    most_missing : float
        Share of the samples that rows of an even clock may leave out [dimensionless].

    Raises
    ------
    LogError
        If the stamps are no clock's.
    SparseLogError
        If over 5 % of the samples, or the share that is told, are left out.
    """
    time = columns[TIME]
    channels = {name: values for name, values in columns.items() if name != TIME}
    if clock is not None and _agrees_with_clock(time, clock):
        return CheckedLog(clock.sample_time, clock.start_time, channels)
    _steps_of_a_clock(time, source)
    time, jumps = without_jumps(time)
    for row, hours in jumps:
        notes.append(LogCode.TIME_SET.note(channel=TIME, hours=hours, row=row + 1))
    time, overruns = without_overruns(time)
    if overruns is not None:
        count, row, span = overruns
        notes.append(LogCode.TIME_RAN_OVER.note(channel=TIME, count=count, row=row + 1, span_s=span))
    if len(time) > FEWEST_SAMPLES + 2 and (strays := stray_ends(time, most_missing)):
        step = np.diff(time)
        notes += [LogCode.TIME_STRAYS.note(channel=TIME, step_s=float(step[one]), end=_ENDS[one]) for one in strays]
        time, *rest = (np.delete(one, strays) for one in (time, *channels.values()))
        channels = dict(zip(channels, rest, strict=True))
    if _has_own_times(channels):
        return _merge_own_times(time, channels, source, notes)
    ticks = _whole_ticks(time)
    if ticks is None:
        return _repair_stamps(time, channels, source, notes)
    _require_few_left_out(len(time), float(ticks.sum()) + 1.0, source, most_missing, time)
    sample_time = float((time[-1] - time[0]) / ticks.sum())
    jitter = float(np.abs(np.diff(time) / sample_time - ticks).max())
    if jitter > max(ROUNDING, _resolution(time, sample_time)):
        return _repair_stamps(time, channels, source, notes)
    slots = np.concatenate(([0.0], np.cumsum(ticks)))
    return CheckedLog(sample_time, float(time[0]), _place_on_clock(channels, slots.astype(np.int64)))


def _steps_of_a_clock(time: Array, source: str) -> None:
    """Refuse stamps whose steps are too large to represent."""
    with np.errstate(over="ignore", invalid="ignore"):
        step = np.diff(time)
        span = float(time[-1] - time[0])
    if not (np.isfinite(step).all() and np.isfinite(span)):
        row = int(np.argmin(np.isfinite(step)))
        raise LogError(
            f"steps of {TIME} must be finite, got {time[row + 1]:.6g} s after {time[row]:.6g} s in row {row + 2}",
            source,
        )


def _repair_stamps(time: Array, channels: Channels, source: str, notes: list[Note]) -> CheckedLog:
    """Put stamps that are rounded, stalled, repeated or jittered on a uniform clock; refuse all others."""
    step = np.diff(time)
    again = np.flatnonzero(step == 0.0) + 1
    if step.min() < 0.0 or len(again) == len(step):
        raise _not_increasing_error(time, source)
    copied = all(np.array_equal(one[again], one[again - 1], equal_nan=True) for one in channels.values())
    if len(again) and copied:
        return _without_repeats(again, time, channels, source, notes)
    whole = step if len(again) else np.maximum(1.0, np.rint(step / usual_step(step)))
    for slots in (np.arange(float(len(time))), np.concatenate(([0.0], np.cumsum(whole)))):
        if (found := rounded_clock(time, slots)) is not None:
            start, sample_time, quantum = found
            _require_few_left_out(len(time), slots[-1] + 1.0, source)
            notes.append(LogCode.TIME_ROUNDED.note(channel=TIME, quantum_s=quantum, sample_time_s=sample_time))
            return CheckedLog(sample_time, start, _place_on_clock(channels, slots.astype(np.int64)))
    if (behind := stalled_clock(time)) is not None and is_sampled_evenly(time, channels, behind.sample_time):
        start, sample_time, count, longest = behind
        note = LogCode.TIME_STALLS.note(channel=TIME, count=count, longest_s=longest, sample_time_s=sample_time)
        notes.append(note)
        return CheckedLog(sample_time, start, channels)
    if not len(again):
        return _resampled(time, channels, source, notes)
    if len(again) > MOST_MISSING * len(time):
        raise _not_increasing_error(time, source)
    return _without_repeats(again, time, channels, source, notes)


def _without_repeats(
    again: NDArray[np.int64], time: Array, channels: Channels, source: str, notes: list[Note]
) -> CheckedLog:
    """Drop rows with repeated stamps; rows that held new values leave a gap."""
    count, percent = len(again), 100.0 * len(again) / len(time)
    notes.append(LogCode.TIME_REPEATS.note(channel=TIME, count=count, total=len(time), percent=percent))
    kept = {name: np.delete(values, again) for name, values in {TIME: time, **channels}.items()}
    long_enough(kept, source)
    return on_uniform_clock(kept, source, None, notes)


def _resampled(time: Array, channels: Channels, source: str, notes: list[Note]) -> CheckedLog:
    shortest = GAP * usual_step(np.diff(time))
    if not shortest > 0.0:
        raise _not_increasing_error(time, source)
    _require_few_left_out(len(time), (float(time[-1]) - float(time[0])) / shortest, source, time=time)
    grid = grid_of(time)
    if not grid.scatter <= MOST_JITTER:
        raise LogError(
            f"steps of {TIME} must scatter by at most {100.0 * MOST_JITTER:g} % of the sample time, "
            f"got {100.0 * grid.scatter:.0f} % of {grid.sample_time:.6g} s",
            source,
        )
    _require_few_left_out(len(grid.times) - int(grid.lacking(time).sum()), float(len(grid.times)), source)
    notes.append(
        LogCode.TIME_JITTERS.note(
            channel=TIME,
            percent=100.0 * grid.most,
            rms_percent=100.0 * grid.scatter,
            sample_time_s=grid.sample_time,
        )
    )
    even = {name: resampled(grid, time, values) for name, values in channels.items()}
    return CheckedLog(grid.sample_time, float(time[0]), even)


def _not_increasing_error(time: Array, source: str) -> ClockError:
    if (np.diff(time) < 0.0).all():
        raise ClockError(
            f"{TIME} must increase, but falls from row to row; if the newest row stands first, turn the rows round; "
            "if it counts down, --sample-time S takes the rows as evenly spaced by S seconds",
            source,
        )
    row = int(np.argmax(np.diff(time) <= 0.0))
    got = f"{time[row + 1]:.12g} in row {row + 2} after {time[row]:.12g}"
    return ClockError(
        f"{TIME} must increase, got {got}; if the clock was set there, or another test begins, keep one side of it; "
        "if its steps are too coarse, or it runs over, --sample-time S takes the rows as evenly spaced by S seconds",
        source,
    )


def _has_own_times(channels: Channels) -> bool:
    """Return whether a channel was logged at its own times, in rows where the fastest channel is missing."""
    there = {name: np.isfinite(values) for name, values in channels.items()}
    fastest = max(there.values(), key=np.count_nonzero)
    if np.all(fastest) or np.count_nonzero(fastest) < FEWEST_SAMPLES:
        return False
    return any(2 * np.count_nonzero(one & ~fastest) > np.count_nonzero(one) > 0 for one in there.values())


def _merge_own_times(time: Array, channels: Channels, source: str, notes: list[Note]) -> CheckedLog:
    """Put channels that were logged at their own times on the clock of the fastest.

    A sample of a slower channel goes to the nearest tick, with the value interpolated there between the channel's
    samples.
    """
    there = {name: np.isfinite(values) for name, values in channels.items()}
    fastest = max(there, key=lambda name: int(there[name].sum()))
    own = time[there[fastest]]
    if np.diff(time).min() < 0.0:
        raise _not_increasing_error(time, source)
    on_clock = on_uniform_clock({TIME: own, fastest: channels[fastest][there[fastest]]}, source, None, notes)
    even = on_clock.start_time + on_clock.sample_time * np.arange(len(on_clock.channels[fastest]))
    out = dict(on_clock.channels)
    for name, values in channels.items():
        if name != fastest and there[name].any():
            when = time[there[name]]
            slots = np.rint((when - even[0]) / on_clock.sample_time).astype(np.int64)
            slots = slots[(slots >= 0) & (slots < len(even))]
            out[name] = np.full(len(even), np.nan)
            out[name][slots] = np.interp(even[slots], when, values[there[name]])
    notes.append(LogCode.TIMES_OF_THEIR_OWN.note(channel=fastest, sample_time_s=on_clock.sample_time))
    return CheckedLog(on_clock.sample_time, on_clock.start_time, out)


def _whole_ticks(time: Array) -> Array | None:
    """Return the number of sample times in each step; None if a step is not a whole number within 1 %.

    Stamps that count from a distant date are rounded to the digits of a float, which is no jitter.
    """
    step = np.diff(time)
    if step.min() <= 0.0:
        return None
    nominal = usual_step(step)
    ticks = np.rint(step / nominal)
    off = np.abs(step / nominal - ticks)
    rounded = _resolution(time, nominal)
    tolerance = max(WHOLE_STEP_TOLERANCE, rounded if rounded < MOST_ROUNDED else 0.0)
    return ticks if np.all(ticks >= 1.0) and np.max(off) <= tolerance + ROUNDING else None


def _require_few_left_out(
    there: int, total: float, source: str, most: float = MOST_MISSING, time: Array | None = None
) -> None:
    if not there >= (1.0 - most) * total:
        said = "{:.0f} of {:.0f}" if total < 1e15 else "{:.3g} of {:.3g}"
        left_out = said.format(total - there, total)
        where = "" if time is None else f"; the longest gap is before row {int(np.argmax(np.diff(time))) + 2}"
        raise SparseLogError(f"{TIME} leaves out {left_out} samples, wanted at most {100.0 * most:g} %{where}", source)


def _agrees_with_clock(time: Array, clock: Clock) -> bool:
    error = np.abs(clock.start_time + clock.sample_time * np.arange(len(time)) - time).max()
    return bool(error <= (ROUNDING + _resolution(time, clock.sample_time)) * clock.sample_time)


def _resolution(time: Array, sample_time: float) -> float:
    """Return the largest apparent jitter from rounding of times to floats [sample times]."""
    return 4.0 * float(np.spacing(np.abs(time[[0, -1]]).max())) / sample_time


def _place_on_clock(channels: Channels, slots: NDArray[np.int64]) -> Channels:
    """Put the samples in their places on the uniform clock, with NaN where the log has no sample."""
    total = int(slots[-1]) + 1
    if total == len(slots):
        return channels
    out = {name: np.full(total, np.nan) for name in channels}
    for name, values in channels.items():
        out[name][slots] = values
    return out


def long_enough(columns: Channels, source: str) -> None:
    """Refuse columns of different lengths, or too few rows.

    Raises
    ------
    LogError
        If they are.
    """
    lengths = {name: len(values) for name, values in columns.items()}
    if len(set(lengths.values())) > 1:
        raise LogError(f"columns must have one length, got {lengths}", source)
    if lengths[TIME] < FEWEST_SAMPLES:
        raise LogError(f"at least {FEWEST_SAMPLES} samples are needed, got {lengths[TIME]}", source)
