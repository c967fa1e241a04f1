"""Breaks in a log: a sensor's zero that was set anew, and rows that were lost without a mark.

Position continues by velocity. Pressure changes by compression and leakage. A row at which one of them steps several
times farther from that than it does anywhere else is no motion. If it steps alone, its zero was set anew: a step of
position is subtracted. A step of pressure is not known as well as a fit requires, and if several channels jump at once,
an unknown number of rows was lost: the longest part without a step is kept.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from estimation.log_checks.channel_names import POSITION, PRESSURE, SPEED, VELOCITY
from estimation.notes import SensorCode
from plant.arrays import Array
from plant.log.record import Record
from plant.notes import Note

FEWEST_ROWS, MOST_PLACES = 500, 10
"""Least rows of a log that show the usual changes, and most places that are looked for [count]."""

SLOWEST, SLOWEST_PRESSURE = 5.5e-3, 2.5e-3
"""Sample times above which velocity, and pressure, change within a row as much as they ever do [s]."""

APART = 10
"""Rows about a place that are excluded from the usual changes, and over which a step must last [samples]."""

STEP, STEP_ALONE, STEP_OF_PRESSURE = 3.0, 4.0, 2.2
"""Ratio of a step to the largest one elsewhere [dimensionless]: of a position; of one without a velocity; of a
pressure. 640 logs reach 1.9, 2.0 and 1.5 (training, shared), 2.5 just after a start under load, and 9 where friction
grips."""

NEAR = 4
"""Rows on either side over whose mean a step is computed [samples]."""

LASTING_SHARE = 0.5
"""Share of a step that must remain some rows later; of an outlier nothing remains [fraction]."""

MOST_STRAY_BESIDE = 0.5
"""Share of a step of pressure by which the rows beside it stray at most if a zero was set anew [fraction]: 0.06 in the
middle of 153 made ones, 0.33 at most. Where a piston bounces off a stop, or chambers change places, it is 0.7 to 46."""

JUMP_IF_ROWS_LOST = 8.0
"""Deviations of noise by which another channel jumps in the same row if rows were lost [dimensionless]."""

MOST_PAST_STOP = 0.1
"""Share of its travel before a stop by which a piston moves on after it, or stays short of it [fraction]; judged."""

SOFT_STOP = 1e-3
"""Share of a log's travel by which a stop yields [fraction]; judged."""

STOP_YIELD_TIME = 1e-3
"""Sample time at which a stop has yielded after `NEAR` rows, and `APART` more show that it holds [s]; judged. Faster
logs need more rows: a stop yields over milliseconds, and that may be a large part of the travel."""

START_SPEEDS = 0.02, 0.5
"""Shares of the log's highest speed between which a motor starts from rest [fraction]; judged."""

LONGEST_START = 0.1
"""Longest time of a motor's start [s]: if it turns slowly at first, its pressure may be zeroed then."""

REST = 10
"""Rows of constant position before a jump that mean that its logger held it [samples]."""


class _Step(NamedTuple):
    """A step of a channel from a row to the next."""

    channel: str
    row: int
    size: float


def without_discontinuities(record: Record) -> tuple[Record, tuple[Note, ...]]:
    """Return a log whose sensors have one zero throughout and whose clock misses no rows.

    Parameters
    ----------
    record : Record
        The log, without outliers; position is needed, and another channel that belongs to it.

    Returns
    -------
    tuple of (Record, tuple of Note)
        The log, with steps of a zero subtracted, or its longest part; and notes.
    """
    if POSITION not in record or len(record) < FEWEST_ROWS or record.sample_time > SLOWEST:
        return record, ()
    moved = _steps_of_position(record)
    places = [step.row for step in moved]
    pressed = (
        step
        for step in _steps_of_pressure(record)
        if _is_beside(step.row, places) or not (_is_driven(record, step.row) or _meets_stop(record, step.row))
    )
    if not (steps := [*moved, *pressed]):
        return record, ()
    if any(
        step.channel == PRESSURE or (not _held_before(record, step) and _other_jumping_channels(record, step, steps))
        for step in steps
    ):
        return _longest_part(record, steps)
    notes: list[Note] = []
    position = record[POSITION].copy()
    for step in steps:
        at = float(record.time[step.row + 1])
        if (held := _held_before(record, step)) > 0:
            position[step.row + 1 - held : step.row + 1] = np.nan
            seconds = held * record.sample_time
            said = SensorCode.HELD_ALONE.note(channel=POSITION, seconds=seconds, count=1, begin_s=at - seconds)
        else:
            position[step.row + 1 :] -= step.size
            said = SensorCode.POSITION_REZEROED.note(channel=POSITION, step=step.size, at_s=at)
        notes.append(said)
    return record.replace(**{POSITION: position}), tuple(notes)


def _by_row(record: Record, steps: list[_Step]) -> dict[int, set[str]]:
    """Return the channels that jump at each place; steps in neighbouring rows count as one place."""
    out: dict[int, set[str]] = {}
    for step in sorted(steps, key=lambda one: one.row):
        row = next((one for one in out if step.row - one <= APART), step.row)
        out.setdefault(row, set()).update((step.channel, *_other_jumping_channels(record, step, steps)))
    return out


def _longest_part(record: Record, steps: list[_Step]) -> tuple[Record, tuple[Note, ...]]:
    """Return the longest part of a log between places at which pressure steps or rows were lost."""
    seams = _by_row(record, steps)
    ends = [0, *(row + 1 for row in seams), len(record)]
    first, behind = max(pairwise(ends), key=lambda part: part[1] - part[0])
    begin, end = (float(record.time[row]) for row in (first, behind - 1))
    where = ", ".join(f"{record.time[row + 1]:.4g}" for row in seams)
    jumped = [name for name in (POSITION, PRESSURE, VELOCITY, SPEED) if any(name in one for one in seams.values())]
    clock = {"where": where, "begin_s": begin, "end_s": end}
    if jumped == [PRESSURE]:
        said = SensorCode.PRESSURE_REZEROED.note(channel=PRESSURE, step=steps[0].size, **clock)
    else:
        channel = SPEED if SPEED in record else POSITION
        said = SensorCode.ROWS_LOST.note(channel=channel, jumped=", ".join(jumped), **clock)
    return record.slice(first, behind), (said,)


def _steps_of_position(record: Record) -> list[_Step]:
    """Return the steps of position that velocity does not explain and that exceed its moves between rows elsewhere.

    Seals that grip stop a piston within a row; it then deviates by less than its own step.
    """
    gone, sure = np.diff(record[POSITION]), VELOCITY in record
    pace = record.sample_time * record[VELOCITY] if sure else np.zeros(len(record))
    strayed = gone - 0.5 * (pace[1:] + pace[:-1])
    rows = _step_rows(strayed, STEP if sure else STEP_ALONE)
    farthest = float(np.nanmax(np.abs(_with_rows_zeroed(gone, rows))))
    return [_Step(POSITION, k, _step_size(strayed, k)) for k in rows if abs(strayed[k]) > farthest]


def _steps_of_pressure(record: Record) -> list[_Step]:
    """Return the steps of pressure that compression of the oil does not explain."""
    if PRESSURE not in record or SPEED not in record or record.sample_time > SLOWEST_PRESSURE:
        return []
    strayed = pressure_strays(record, noisy=True)
    strayed[_starting_rows(record[SPEED], record.sample_time)] = 0.0
    rows = _step_rows(strayed, STEP_OF_PRESSURE)
    strayed = np.nan_to_num(pressure_strays(record)) if rows else strayed
    alone = [k for k in rows if max(abs(strayed[k - 1]), abs(strayed[k + 1])) < MOST_STRAY_BESIDE * abs(strayed[k])]
    return [_Step(PRESSURE, k, _step_size(strayed, k)) for k in alone]


def _starting_rows(speed: Array, sample_time: float) -> slice:
    """Return the rows in which a motor starts from rest; none if it turns when the log begins.

    Both chambers are at the accumulator's pressure then. Until one of them draws make-up flow, pressure rises twice as
    fast as it ever does again.
    """
    size = np.nan_to_num(np.abs(speed))
    turns, away = (int(np.argmax(size > share * np.max(size))) for share in START_SPEEDS)
    away = min(away, turns + round(LONGEST_START / sample_time))
    return slice(turns, away + APART if turns > 0 else 0)


def _is_beside(row: int, places: list[int]) -> bool:
    return any(abs(row - place) <= 1 for place in places)


def _is_driven(record: Record, row: int) -> bool:
    """Return whether motor speed jumps near a row, which may move pressure within that row."""
    return any(_jumps(record[SPEED], one) for one in range(row - 2, row + 3))


def _meets_stop(record: Record, row: int) -> bool:
    """Return whether the piston meets an end stop near a row: it stops for good, at its farthest place.

    The pump's delivery, or the pull of a load, then raises pressure at once.
    """
    position = record[POSITION]
    near, apart = (max(rows, round(rows * STOP_YIELD_TIME / record.sample_time)) for rows in (NEAR, APART))
    first, before, after, last = (row + k for k in (-near - apart, -near, near, near + apart))
    if first < 0 or last >= len(position):
        return False
    came, went = abs(position[before] - position[first]), abs(position[last] - position[after])
    low, high = float(np.nanmin(position)), float(np.nanmax(position))
    beside = max(MOST_PAST_STOP * came, SOFT_STOP * (high - low))
    return bool(went < MOST_PAST_STOP * came and min(position[after] - low, high - position[after]) < beside)


def _with_rows_zeroed(values: Array, rows: list[int]) -> Array:
    """Return values with zeros about some rows."""
    out = np.nan_to_num(values)
    for k in rows:
        out[max(0, k - APART) : k + APART + 1] = 0.0
    return out


def pressure_strays(record: Record, *, noisy: bool = False) -> Array:
    """Return the changes of pressure from row to row that pump, piston and leakage do not explain.

    Valves and seals bend this line, so rows far from it are left out before it is fitted again.

    Parameters
    ----------
    record : Record
        A log with motor speed, position and differential pressure.
    noisy : bool
        Whether the previous change is a regressor: a noisy row is followed by a change the other way, a step is not.

    Returns
    -------
    ndarray, shape (n - 1,)
        The remainder [Pa]; NaN if a sample that it needs is missing.
    """
    pressure, speed, T = record[PRESSURE], record[SPEED], record.sample_time
    rise, swept, turned = np.diff(pressure), np.diff(record[POSITION]), 0.5 * T * (speed[1:] + speed[:-1])
    known = np.zeros((9 if noisy else 8, len(rise)))
    for place, one in enumerate((swept, turned)):
        known[3 * place, 1:-1], known[3 * place + 1, 1:-1], known[3 * place + 2, 1:-1] = one[2:], one[1:-1], one[:-2]
    known[6, 1:-1] = (0.5 * T * (pressure[1:] + pressure[:-1]))[1:-1]
    known[7, 1:-1] = T * np.sign(turned[1:-1])
    if noisy:
        known[8, 1:-1] = rise[:-2]
    whole = np.isfinite(rise) & np.all(np.isfinite(known), axis=0)
    if np.count_nonzero(whole) < FEWEST_ROWS // 2:
        return rise
    known[:, ~whole] = 0.0
    course, left, kept = np.where(whole, rise, 0.0), rise, whole
    gram, pull = known @ known.T, known @ course
    for _ in range(3):
        out = known[:, whole & ~kept]  # few rows: they are subtracted from the sums, which are not computed anew
        inner, toward = gram - out @ out.T, pull - out @ course[whole & ~kept]
        sizes = np.sqrt(np.diag(inner))
        sizes[sizes == 0.0] = 1.0
        found = np.linalg.lstsq(inner / np.outer(sizes, sizes), toward / sizes, rcond=1e-10)[0]
        left = np.where(whole, course - (found / sizes) @ known, np.nan)
        far = np.abs(left)
        place = int(0.99 * (np.count_nonzero(kept) - 1))
        kept = kept & (far <= 3.0 * np.partition(far[kept], place)[place])
    return left


def _step_rows(strayed: Array, least: float) -> list[int]:
    """Return rows after which a channel steps farther than anywhere else, and stays; empty if there are none."""
    sizes = np.nan_to_num(np.abs(strayed))
    sizes[:APART] = sizes[-APART:] = 0.0  # a log may begin during a jerk
    found: list[tuple[int, float]] = []
    for _ in range(MOST_PLACES + 1):
        k = int(np.argmax(sizes))
        found.append((k, float(sizes[k])))
        sizes[max(0, k - APART) : k + APART + 1] = 0.0
    alone = [n for n in range(1, len(found)) if found[n - 1][1] > least * found[n][1] > 0.0]
    rows = [k for k, _ in found[: max(alone, default=0)]]
    sums = (float(np.nansum(strayed[k - APART : k + APART + 1])) / strayed[k] for k in rows)
    return rows if all(lasting > LASTING_SHARE for lasting in sums) else []


def _step_size(strayed: Array, k: int) -> float:
    """Return the size of a step at a row, from the means of some rows on either side."""
    course = np.cumsum(np.nan_to_num(strayed[k - NEAR : k + NEAR + 1]))
    return float(np.mean(course[NEAR:]) - np.mean(course[:NEAR]))


def _held_before(record: Record, step: _Step) -> int:
    """Return the number of rows of constant position before its jump; 0 for no rest, or another channel."""
    if step.channel != POSITION:
        return 0
    before = record[POSITION][: step.row + 1]
    moved = np.flatnonzero(before != before[-1])
    count = step.row - int(moved[-1]) if len(moved) else 0
    if count < REST or VELOCITY not in record:
        return 0
    gone = record.sample_time * float(np.nansum(record[VELOCITY][step.row + 1 - count : step.row + 2]))
    return count - 1 if abs(gone - step.size) < 0.5 * abs(step.size) else 0


def _other_jumping_channels(record: Record, step: _Step, steps: list[_Step]) -> list[str]:
    """Return the other channels that jump in the same row."""
    names = [one.channel for one in steps if one.channel != step.channel and _is_beside(one.row, [step.row])]
    for name in (PRESSURE, VELOCITY, SPEED):
        if name in record and name not in (step.channel, *names) and _jumps(record[name], step.row):
            names.append(name)
    return names


def _jumps(values: Array, row: int) -> bool:
    """Return whether a channel steps away from its trend at a row, by far more than its noise."""
    first = max(0, row - 3 * APART)
    around = values[first : row + 3 * APART + 2]
    steps = np.diff(around)
    k = row - first
    beside = np.delete(steps, k)
    beside = beside[np.isfinite(beside)]
    if len(beside) < APART or not np.isfinite(steps[k]):
        return False
    near = steps[[i for i in (k - 2, k - 1, k + 1, k + 2) if 0 <= i < len(steps)]]
    expected = float(np.nanmedian(near))
    usual = 1.4826 * float(np.median(np.abs(beside - np.median(beside))))
    return abs(float(steps[k]) - expected) > JUMP_IF_ROWS_LOST * usual
