"""What a log must satisfy to be trusted: a clock, few enough gaps, finite numbers. Says what it mended."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from plant.arrays import Array
from plant.errors import LogError
from plant.log.columns import TIME, TRUTH
from plant.log.notes import LogCode
from plant.log.plausibility import implausible
from plant.notes import Note

REQUIRED = ("motor_speed_rad_s", "position_m or velocity_m_s")
"""Channels that a log must hold: all of these, either one where a line says "or"."""

FEWEST_SAMPLES = 10
MOST_MISSING = 0.05
MOST_JITTER = 0.01
ROUNDING = 1e-6

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
class Checked:
    """A log on a uniform clock, and what was mended on the way.

    Parameters
    ----------
    sample_time, start_time : float
        The clock [s].
    channels : Mapping[str, ndarray, shape (n,)]
        Values in SI, NaN where a sample is missing.
    notes : tuple[Note, ...]
        What was resampled, masked, dropped, or looks wrong.
    """

    sample_time: float
    start_time: float
    channels: Channels
    notes: tuple[Note, ...] = ()


def trusted(
    columns: Channels, *, source: str, required: Collection[str] = REQUIRED, clock: Clock | None = None
) -> Checked:
    """Return a log on a uniform clock if it can be trusted.

    Parameters
    ----------
    columns : Mapping[str, ndarray, shape (n,)]
        ``time_s`` and the channels, in SI.
    required : Collection[str]
        Channels that must be there; ``"position_m or velocity_m_s"`` asks for one of the two.
    clock : Clock, optional
        The clock that the log was written with; used where the time column agrees with it.

    Returns
    -------
    Checked
        Clock, channels, and notes.

    Raises
    ------
    LogError
        If a required channel is missing or over 5 % empty, a value is infinite, time does not increase or is
        not uniform within 1 %, or there are fewer than 10 samples.

    Examples
    --------
    >>> ramp = np.arange(20.0)
    >>> log = {"time_s": 1e-3 * ramp, "motor_speed_rad_s": ramp, "velocity_m_s": 1e-3 * ramp}
    >>> round(trusted(log, source="a.csv").sample_time, 12)
    0.001
    """
    notes: list[Note] = []
    with np.errstate(over="ignore", invalid="ignore"):  # a hostile 1e308 is refused or noted like others
        complete = _derived(columns)
        _present(complete, [TIME, *required], source)
        _same_length(complete, source)
        _finite(complete, source)
        timed = _rows_with_time(complete, source, notes)
        on_clock = _uniform(timed, source, clock, notes)
        channels = _masked(on_clock.channels, required, source, notes)
        notes += implausible(on_clock.sample_time, channels)
    return Checked(on_clock.sample_time, on_clock.start_time, channels, tuple(notes))


def _alternatives(wanted: str) -> list[str]:
    return [name.strip() for name in wanted.split(" or ")]


def _present(columns: Channels, required: Collection[str], source: str) -> None:
    missing = [wanted for wanted in required if not any(name in columns for name in _alternatives(wanted))]
    if missing:
        known = ", ".join(columns) or "none that is known"
        raise LogError(f"column {' and '.join(missing)} is missing, the log has {known}", source)
    if set(columns) <= {TIME}:
        raise LogError(f"at least one channel is wanted beside {TIME}, the log has none that is known", source)


def _same_length(columns: Channels, source: str) -> None:
    lengths = {name: len(values) for name, values in columns.items()}
    if len(set(lengths.values())) > 1:
        raise LogError(f"columns must have one length, got {lengths}", source)
    if lengths[TIME] < FEWEST_SAMPLES:
        raise LogError(f"at least {FEWEST_SAMPLES} samples are wanted, got {lengths[TIME]}", source)


def _finite(columns: Channels, source: str) -> None:
    for name, values in columns.items():
        infinite = np.isinf(values)
        if infinite.any():
            row = int(np.argmax(infinite))
            raise LogError(f"{name} must be finite, got {values[row]} in row {row + 1}", source)


def _rows_with_time(columns: Channels, source: str, notes: list[Note]) -> Channels:
    """Drop the rows whose time is empty; inside the log they leave gaps, which are counted again there."""
    empty = np.isnan(columns[TIME])
    count, total = int(empty.sum()), len(empty)
    if count == 0:
        return columns
    if count > MOST_MISSING * total or total - count < FEWEST_SAMPLES:
        raise LogError(f"{TIME} is missing in {_share(count, total)}, at most 5 % may be", source)
    notes.append(LogCode.TIME_MISSING.note(channel=TIME, **_counted(count, total)))
    return {name: values[~empty] for name, values in columns.items()}


def _share(count: int, total: int) -> str:
    return f"{count} of {total} samples ({100.0 * count / total:.2g} %)"


def _counted(count: int, total: int) -> dict[str, float]:
    return {"count": count, "total": total, "percent": 100.0 * count / total}


def _uniform(columns: Channels, source: str, clock: Clock | None, notes: list[Note]) -> Checked:
    time = columns[TIME]
    channels = {name: values for name, values in columns.items() if name != TIME}
    if clock is not None and _agrees(time, clock):
        return Checked(clock.sample_time, clock.start_time, channels)
    try:
        ticks = _ticks(time, source)
    except LogError as uneven:
        return _merged(time, channels, source, notes, uneven)
    sample_time = float((time[-1] - time[0]) / ticks.sum())
    jitter = float(np.abs(np.diff(time) / sample_time - ticks).max())
    slots = np.concatenate(([0.0], np.cumsum(ticks)))
    if jitter > max(ROUNDING, _resolution(time, sample_time)):
        notes.append(LogCode.TIME_JITTERS.note(channel=TIME, percent=100.0 * jitter, sample_time_s=sample_time))
        even = time[0] + sample_time * slots
        channels = {name: _resampled(even, time, values) for name, values in channels.items()}
    return Checked(sample_time, float(time[0]), _spread(channels, slots.astype(np.int64)))


def _merged(time: Array, channels: Channels, source: str, notes: list[Note], uneven: LogError) -> Checked:
    """Put channels that were logged at times of their own on the clock of the fastest; else the rows are uneven.

    A slower channel's sample goes to the nearest tick, as interpolated there between the channel's own samples.
    """
    there = {name: np.isfinite(values) for name, values in channels.items()}
    fastest = max(there, key=lambda name: int(there[name].sum()))
    own = time[there[fastest]]
    if len(own) == len(time) or len(own) < FEWEST_SAMPLES or np.diff(time).min() < 0.0:
        raise uneven
    try:
        on_clock = _uniform({TIME: own, fastest: channels[fastest][there[fastest]]}, source, None, notes)
    except LogError:
        raise uneven from None
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
    return Checked(on_clock.sample_time, on_clock.start_time, out)


def _ticks(time: Array, source: str) -> Array:
    """Return how many sample times each step takes, after refusing all that is no whole number of them."""
    step = np.diff(time)
    if step.min() <= 0.0:
        row = int(np.argmax(step <= 0.0))
        got = f"{time[row + 1]:.12g} in row {row + 2} after {time[row]:.12g}"
        raise LogError(f"{TIME} must increase, got {got}", source)
    middle = float(np.partition(step, len(step) // 2)[len(step) // 2])
    nominal = float(np.mean(step[np.abs(step - middle) <= 0.5 * middle]))  # the median of rounded steps is rounded
    ticks = np.rint(step / nominal)
    off = np.abs(step / nominal - ticks)
    off[~(ticks >= 1.0)] = np.inf
    worst = int(np.argmax(off))
    if not off[worst] <= MOST_JITTER + ROUNDING:
        raise LogError(
            f"{TIME} must be uniform within 1 % or leave out whole samples, got a step of "
            f"{step[worst]:.6g} s from row {worst + 1} to {worst + 2} at a sample time of {nominal:.6g} s",
            source,
        )
    total, there = float(ticks.sum()) + 1.0, len(time)
    if total - there > MOST_MISSING * total:
        raise LogError(f"{TIME} leaves out {total - there:.0f} of {total:.0f} samples, wanted at most 5 %", source)
    return ticks


def _agrees(time: Array, clock: Clock) -> bool:
    error = np.abs(clock.start_time + clock.sample_time * np.arange(len(time)) - time).max()
    return bool(error <= (ROUNDING + _resolution(time, clock.sample_time)) * clock.sample_time)


def _resolution(time: Array, sample_time: float) -> float:
    """Return what rounding of the times themselves to floats can look like, in sample times."""
    return 4.0 * float(np.spacing(np.abs(time[[0, -1]]).max())) / sample_time


def _resampled(wanted: Array, time: Array, values: Array) -> Array:
    """Interpolate linearly between the samples that are there; those that are missing stay missing."""
    there = np.isfinite(values)
    if not there.any():
        return values
    moved = np.interp(wanted, time[there], values[there])
    moved[~there] = np.nan
    return moved


def _spread(channels: Channels, slots: NDArray[np.int64]) -> Channels:
    """Put the samples in their slots of the uniform clock, NaN in the slots that the log leaves out."""
    total = int(slots[-1]) + 1
    if total == len(slots):
        return channels
    out = {name: np.full(total, np.nan) for name in channels}
    for name, values in channels.items():
        out[name][slots] = values
    return out


def _derived(channels: Channels) -> Channels:
    wanted, a, b = "differential_pressure_pa", "pressure_a_pa", "pressure_b_pa"
    if wanted in channels or a not in channels or b not in channels:
        return channels
    return {**channels, wanted: channels[a] - channels[b]}


def _slower(values: Array) -> int:
    """Return every how many samples a channel is logged, where it is slower than the clock but steady; 1 for others."""
    present = np.flatnonzero(np.isfinite(values))
    if len(present) < FEWEST_SAMPLES:
        return 1
    usual = float(np.median(np.diff(present)))
    return round(usual) if len(present) >= (1.0 - MOST_MISSING) * (len(values) / usual - 1.0) else 1


def _masked(channels: Channels, required: Collection[str], source: str, notes: list[Note]) -> Channels:
    kept = dict(channels)
    for name, values in channels.items():
        count, total = int(np.isnan(values).sum()), len(values)
        if count == 0 or name.startswith(TRUTH):
            continue
        if count <= MOST_MISSING * total:
            notes.append(LogCode.SAMPLES_MASKED.note(channel=name, **_counted(count, total)))
            continue
        if (rows := _slower(values)) > 1:
            notes.append(LogCode.CHANNEL_SLOWER.note(channel=name, rows=rows))
            continue
        del kept[name]
        if not all(any(other in kept for other in _alternatives(wanted)) for wanted in required):
            raise LogError(f"{name} is missing in {_share(count, total)}, at most 5 % may be", source)
        notes.append(LogCode.CHANNEL_LEFT_OUT.note(channel=name, **_counted(count, total)))
    if not kept:
        raise LogError("no channel has 95 % of its samples", source)
    return kept
