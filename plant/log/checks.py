"""Checks that a log must pass: clock, gaps, finite numbers. Repairs are reported."""

from collections.abc import Collection, Iterable

import numpy as np

from plant.arrays import Array
from plant.errors import LogError, NoChannelError, SparseLogError
from plant.log.chamber_pressures import CHAMBERS, PRESSURE, has_pressure_difference, with_pressure_difference
from plant.log.clock.order import in_order
from plant.log.clock.uniform import FEWEST_SAMPLES, MOST_MISSING, Channels, CheckedLog, long_enough, on_uniform_clock
from plant.log.clock.uniform import Clock as Clock
from plant.log.columns import TIME, TRUTH_PREFIX
from plant.log.guess import missing_columns_clause
from plant.log.notes import LogCode
from plant.log.plausibility import implausibility_notes
from plant.notes import Note, written_out

SHORTEST, LONGEST = 1e-8, 1e4
"""Sample times of logs [s]; nothing is computed of others."""

REQUIRED = ("motor_speed_rad_s", "position_m or velocity_m_s")
"""Channels that a log must hold: all of these, either one where a line says "or"."""

FLOW_BALANCE_CHANNELS = ("motor_speed_rad_s", "position_m", PRESSURE, *CHAMBERS)
"""Channels of the balance of flows. If one begins late or ends early, the rest of the log is worth less than it."""

LEAST_SPAN = 0.5
"""Share of a log that has to be left if it is used only where such a channel is logged [fraction]; judged."""


def checked_log(
    columns: Channels,
    *,
    source: str,
    required: Collection[str] = REQUIRED,
    clock: Clock | None = None,
    most_missing: float = MOST_MISSING,
) -> CheckedLog:
    """Return a log on a uniform clock if it passes all checks.

    Parameters
    ----------
    columns : Mapping[str, ndarray, shape (n,)]
        ``time_s`` and the channels, in SI.
    required : Collection[str]
        Channels that must be there; ``"position_m or velocity_m_s"`` asks for one of the two.
    clock : Clock, optional
        The clock that the log was written with; used where the time column agrees with it.
    most_missing : float
        Share of a channel's samples, or of the clock's, that may be missing [dimensionless].

    Raises
    ------
    LogError
        If a required channel is missing, a value is infinite, time does not increase or is no clock's even if its
        jitter is mended, or there are fewer than 10 samples.
    SparseLogError
        If a required channel, or the clock, lacks over 5 % of its samples, or the share that is told.

    Examples
    --------
    >>> ramp = np.arange(20.0)
    >>> log = {"time_s": 1e-3 * ramp, "motor_speed_rad_s": ramp, "velocity_m_s": 1e-3 * ramp}
    >>> round(checked_log(log, source="a.csv").sample_time, 12)
    0.001
    """
    notes: list[Note] = []
    with np.errstate(over="ignore", invalid="ignore"):  # a hostile 1e308 is refused or noted like other values
        complete = _with_derived_pressure(columns, notes)
        _require_channels(complete, [TIME, *required], source)
        long_enough(complete, source)
        _finite(complete, source)
        timed = in_order(_rows_with_time(complete, source, notes), notes)
        on_clock = on_uniform_clock(timed, source, clock, notes, most_missing)
        first, whole = _logged_together(on_clock, notes, most_missing)
        channels = _without_sparse_channels(whole, required, source, notes, most_missing)
        if not SHORTEST <= on_clock.sample_time <= LONGEST:
            raise LogError(
                f"the sample time must be from {SHORTEST:g} s to {LONGEST:g} s, got {on_clock.sample_time:.3g} s; "
                f"check the unit of {TIME}",
                source,
            )
        notes += implausibility_notes(on_clock.sample_time, channels)
    start_time = on_clock.start_time + first * on_clock.sample_time
    return CheckedLog(on_clock.sample_time, start_time, channels, tuple(notes))


def alternatives(wanted: str) -> list[str]:
    """Return the channels of which at least one is required.

    Parameters
    ----------
    wanted : str
        Such as ``"position_m or velocity_m_s"``.
    """
    return [name.strip() for name in wanted.split(" or ")]


def missing_required(required: Iterable[str], names: Collection[str]) -> list[str]:
    """Return the required channels that are missing from a log.

    Parameters
    ----------
    required : iterable of str
        Channels, as `alternatives` takes them.
    names : collection of str
        Channels that are there.

    Examples
    --------
    >>> missing_required(["motor_speed_rad_s", "position_m or velocity_m_s"], {"velocity_m_s"})
    ['motor_speed_rad_s']
    """
    return [wanted for wanted in required if not any(name in names for name in alternatives(wanted))]


def _count_and_percent(count: int, total: int) -> dict[str, float]:
    return {"count": count, "total": total, "percent": 100.0 * count / total}


def all_missing(name: str, values: Array) -> Note | None:
    """Return a note if a channel has no samples at all.

    Parameters
    ----------
    name : str
        The channel.
    values : ndarray, shape (n,)
        [any unit]; NaN is missing.
    """
    if np.isfinite(values).any():
        return None
    return LogCode.CHANNEL_LEFT_OUT.note(channel=name, **_count_and_percent(len(values), len(values)))


def _require_channels(columns: Channels, required: Collection[str], source: str) -> None:
    if missing := missing_required(required, columns):
        known = ", ".join(columns) or "none that is known"
        raise NoChannelError(f"{missing_columns_clause(missing)}; the log has {known}", source, columns=tuple(columns))
    if set(columns) <= {TIME}:
        raise NoChannelError(f"at least one channel is needed beside {TIME}, the log has none that is known", source)


def _finite(columns: Channels, source: str) -> None:
    for name, values in columns.items():
        infinite = np.isinf(values)
        if infinite.any():
            row = int(np.argmax(infinite))
            raise LogError(f"{name} must be finite, got {values[row]} in row {row + 1}", source)


def _rows_with_time(columns: Channels, source: str, notes: list[Note]) -> Channels:
    """Drop rows without a time. Inside the log they leave gaps, which are counted there."""
    columns = _without_empty_end(columns, notes)
    empty = np.isnan(columns[TIME])
    count, total = int(empty.sum()), len(empty)
    if count == 0:
        return columns
    if count > MOST_MISSING * total or total - count < FEWEST_SAMPLES:
        raise LogError(f"{TIME} is missing in {_share(count, total)}, at most 5 % may be", source)
    notes.append(LogCode.TIME_MISSING.note(channel=TIME, **_count_and_percent(count, total)))
    return {name: values[~empty] for name, values in columns.items()}


def _without_empty_end(columns: Channels, notes: list[Note]) -> Channels:
    """Drop empty rows at the end, which remain when an array was allocated before the test."""
    if not np.isnan(columns[TIME][-1:]).any():
        return columns
    written = np.flatnonzero(~np.logical_and.reduce([np.isnan(values) for values in columns.values()]))
    taken, total = (int(written[-1]) + 1 if len(written) else 0), len(columns[TIME])
    if taken < FEWEST_SAMPLES or taken == total:
        return columns
    notes.append(LogCode.END_LEFT_OUT.note(count=total - taken, taken=taken))
    return {name: values[:taken] for name, values in columns.items()}


def _share(count: int, total: int) -> str:
    return f"{count} of {total} samples ({written_out(100.0 * count / total, '.2g')} %)"


def _with_derived_pressure(channels: Channels, notes: list[Note]) -> Channels:
    logged = [one for one in CHAMBERS if one in channels]
    if logged and not has_pressure_difference(channels):
        (other,) = set(CHAMBERS) - set(logged)
        notes.append(LogCode.CHAMBER_ALONE.note(channel=logged[0], other=other))
    return with_pressure_difference(channels)


def _rows_per_sample(values: Array) -> int:
    """Return every how many samples a channel is logged that is steady but slower than the clock; 1 for others."""
    present = np.flatnonzero(np.isfinite(values))
    if len(present) < FEWEST_SAMPLES:
        return 1
    usual = float(np.median(np.diff(present)))
    return round(usual) if len(present) >= (1.0 - MOST_MISSING) * (len(values) / usual - 1.0) else 1


def _logged_together(on_clock: CheckedLog, notes: list[Note], most_missing: float) -> tuple[int, Channels]:
    """Return the part in which all channels of `FLOW_BALANCE_CHANNELS` are logged, after its first sample."""
    channels = on_clock.channels
    total = len(next(iter(channels.values())))
    first, behind = 0, total
    for name in [name for name in FLOW_BALANCE_CHANNELS if name in channels]:
        present = np.flatnonzero(np.isfinite(channels[name]))
        if not 0 < len(present) < (1.0 - most_missing) * total:
            continue
        begin, end = int(present[0]), int(present[-1]) + 1
        part = channels[name][begin:end]
        steady = np.count_nonzero(np.isnan(part)) <= most_missing * len(part) or _rows_per_sample(part) > 1
        lost = total - len(part) > most_missing * total
        if not (steady and lost) or min(end, behind) - max(begin, first) < LEAST_SPAN * total:
            continue
        first, behind = max(begin, first), min(end, behind)
        begin_s, end_s = (on_clock.start_time + at * on_clock.sample_time for at in (begin, end - 1))
        notes.append(LogCode.CHANNEL_LOGGED_IN_PART.note(channel=name, begin_s=begin_s, end_s=end_s))
    if behind - first == total:
        return 0, channels
    return first, {name: values[first:behind] for name, values in channels.items()}


def _without_sparse_channels(
    channels: Channels, required: Collection[str], source: str, notes: list[Note], most_missing: float
) -> Channels:
    kept = dict(channels)
    for name, values in channels.items():
        count, total = int(np.isnan(values).sum()), len(values)
        if count == 0 or name.startswith(TRUTH_PREFIX):
            continue
        if count <= most_missing * total:
            notes.append(LogCode.SAMPLES_MASKED.note(channel=name, **_count_and_percent(count, total)))
            continue
        if (rows := _rows_per_sample(values)) > 1:
            notes.append(LogCode.CHANNEL_SLOWER.note(channel=name, rows=rows))
            continue
        del kept[name]
        if missing_required(required, kept):
            raise SparseLogError(
                f"{name} is missing in {_share(count, total)}, at most {100.0 * most_missing:g} % may be", source
            )
        notes.append(LogCode.CHANNEL_LEFT_OUT.note(channel=name, **_count_and_percent(count, total)))
    if not kept:
        raise SparseLogError(f"no channel has {100.0 * (1.0 - most_missing):g} % of its samples", source)
    return kept
