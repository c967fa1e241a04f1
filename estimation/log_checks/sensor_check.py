"""Sensors that cannot be trusted: frozen, dead, or at the end of their range.

A filter believes a frozen encoder like any other, with an innocent chi-square: constant samples agree with each other.
So a log is checked before it is used. Values at the end of a sensor's range are censored, not measured, and are removed
(`without_saturated`).
"""

import numpy as np
from numpy.typing import NDArray

from estimation.log_checks.bridging import bridged
from estimation.log_checks.channel_names import CHAMBERS, POSITION, PRESSURE, PRESSURES, SPEED, VELOCITY
from estimation.log_checks.filtered import independent_rows
from estimation.log_checks.frozen_encoder import ends_with_jump, misses_motion, misses_yield_of_seals
from estimation.log_checks.measurement_noise import measurement_variances
from estimation.log_checks.order import median
from estimation.log_checks.velocity_strays import strays_unusually
from estimation.notes import SensorCode
from plant.arrays import Array
from plant.eha.model import EhaParameters
from plant.log.record import Record
from plant.notes import Note

LONGEST_HOLD = 0.05
"""Longest time for which a live sensor repeats one value while the quantity changes [s]."""

FEWEST_HELD = 20
"""Repeated samples below which a hold means nothing, whatever its length."""

USUAL_REPEATS = 0.5
"""Share of repeated samples above which a channel is coarse: a constant value then means nothing [fraction]."""

CHANCE_OF_REPEATS = 1e-9
"""Probability of so many repetitions of the extreme value, for a sensor that repeats itself as often as this one does
elsewhere, below which it is at the end of its range [probability]."""

LEAST_RUN = 3
"""Samples at the largest value that count as one stay there."""

ARRIVING, LEAST_ARRIVAL = 2.0, 0.1
"""A channel arrives at a stay in motion if just before it was farther away than so many of its quanta, or than this
share of its usual step [dimensionless]."""

AROUND, BAND = 0.01, 4.0
"""For a pressure near the end of the range only the lower half of its noise is seen, so samples near a clipped one in
time [s] and in level [standard deviations] are left out with it."""

LEAST_END_HEAP = 2.0
"""Ratio of samples at the end of a sensor's range to those close by [dimensionless]."""

NOISY = 0.3
"""Relative difference of successive steps that noise causes [fraction]."""

COARSE = 0.2
"""Share of repeated samples above which a channel shows no noise, and a relief valve's plateau is flat [fraction]."""

FEWEST_DEAD = 100
"""Samples below which a pressure sensor is not called dead: with 20, many a live one looks like noise."""

NOISE_SHARE = 0.9
"""Share of white noise in a channel above which it shows nothing [fraction]."""

CLIPPED = 0.98
"""Share of its largest value above which a constant pressure is at the end of its range or at the relief valve
[fraction]."""

MOTION_QUANTA = 5.0
"""Quanta of the encoder by which a velocity sensor must show motion [dimensionless]."""


def sensor_objections(record: Record, parameters: EhaParameters) -> tuple[Note, ...]:
    """Return a note for each sensor of a log that cannot be believed.

    Parameters
    ----------
    parameters : EhaParameters
        The actuator, for the motion due to its pump.

    Returns
    -------
    tuple of Note
        Empty for a sound log.
    """
    accused = {
        PRESSURE: _frozen_pressure(record, parameters) or _dead_pressure(record),
        VELOCITY: _frozen_velocity(record),
    }
    believed = record.replace(**{channel: None for channel, note in accused.items() if note})
    found = (*accused.values(), _frozen_position(believed, parameters))
    return tuple(note for note in found if note)


def holds(values: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the starts and lengths of runs of one repeated value; missing samples end a run.

    Parameters
    ----------
    values : ndarray, shape (n,)
        A channel [any unit].

    Returns
    -------
    tuple of ndarray, each shape (runs,)
        First samples, and counts of samples.

    Examples
    --------
    >>> starts, lengths = holds(np.array([1.0, 1.0, 2.0, 3.0, 3.0, 3.0]))
    >>> starts.tolist(), lengths.tolist()
    ([0, 2, 3], [2, 1, 3])
    """
    changes = np.flatnonzero(np.concatenate([[True], values[1:] != values[:-1]]))
    return changes.astype(np.int64), np.diff(np.append(changes, len(values))).astype(np.int64)


def _longest_hold(values: Array, sample_time: float) -> slice | None:
    """Return the longest hold, if it is long enough to mean something; missing samples in it do not count."""
    present = np.flatnonzero(np.isfinite(values))
    if not len(present):
        return None
    starts, lengths = holds(values[present])
    longest = int(np.argmax(lengths))
    first, last = present[starts[longest]], present[starts[longest] + lengths[longest] - 1]
    long = lengths[longest] > FEWEST_HELD and (last - first) * sample_time >= LONGEST_HOLD
    return slice(int(first), int(last) + 1) if long else None


def _hold_of(record: Record, channel: str) -> slice | None:
    """Return the longest part over which a channel repeats itself although it usually does not."""
    if channel not in record:
        return None
    hold = _longest_hold(record[channel], record.sample_time)
    if hold is None:
        return None
    outside = np.concatenate([record[channel][: hold.start], record[channel][hold.stop :]])
    outside = outside[np.isfinite(outside)]
    coarse = np.count_nonzero(outside[1:] == outside[:-1]) > USUAL_REPEATS * len(outside)
    return None if len(outside) and coarse else hold


def _frozen_velocity(record: Record) -> Note | None:
    """Compare a constant velocity with the encoder; a stuck piston's velocity is zero, and its encoder constant."""
    stretch = _hold_of(record, VELOCITY)
    if stretch is None or POSITION not in record:
        return None
    position, velocity = record[POSITION][stretch], float(record[VELOCITY][stretch][0])
    there = np.flatnonzero(np.isfinite(position))
    if len(there) < FEWEST_HELD:
        return None
    position = position[there]
    travelled, quantum = float(position[-1] - position[0]), _quantum(record[POSITION])
    said = velocity * record.sample_time * float(there[-1] - there[0])
    strayed = max(abs(travelled - said), float(np.ptp(position)) - abs(said))
    return _frozen_note(VELOCITY, stretch, record) if strayed > MOTION_QUANTA * max(quantum, 1e-6) else None


def _frozen_pressure(record: Record, p: EhaParameters) -> Note | None:
    """Compare a constant pressure with the pump: while that delivers unevenly, pressure is never constant for long."""
    stretch = _hold_of(record, PRESSURE)
    if stretch is None or SPEED not in record:
        return None
    value = record[PRESSURE][stretch.start]
    if np.all(np.isnan(record[PRESSURE]) | (record[PRESSURE] == value)):
        return SensorCode.SENSOR_CONSTANT.note(channel=PRESSURE, value=float(value))
    speed = bridged(record[SPEED])[stretch]
    volume = np.cumsum(_pumped_flow(speed, p)) * record.sample_time
    if np.ptp(speed) == 0.0:
        return None
    if abs(value) > CLIPPED * float(np.nanmax(np.abs(record[PRESSURE]))):
        return None
    return _frozen_note(PRESSURE, stretch, record) if np.ptp(volume) > 0.0 else None


def _pumped_flow(speed: Array, p: EhaParameters) -> Array:
    ideal = p.pump_displacement * speed
    return np.sign(ideal) * np.maximum(np.abs(ideal) - p.flow_bias, 0.0)


def _frozen_note(channel: str, stretch: slice, record: Record) -> Note:
    start, length = stretch.start, stretch.stop - stretch.start
    begin = record.start_time + start * record.sample_time
    return SensorCode.SENSOR_FROZE.note(
        channel=channel,
        value=float(record[channel][start]),
        begin_s=begin,
        length_s=length * record.sample_time,
    )


def _frozen_position(record: Record, p: EhaParameters) -> Note | None:
    """Compare a still encoder with what the other sensors say moved meanwhile; a stuck piston's is still too."""
    stretch = _longest_hold(record[POSITION], record.sample_time) if POSITION in record else None
    if stretch is None:
        return None
    slid, rests = shows_motion(record, stretch)
    missed = not rests and (misses_motion(record, stretch, p) or misses_yield_of_seals(record, stretch, p))
    return _frozen_note(POSITION, stretch, record) if slid or missed or ends_with_jump(record, stretch, p) else None


def shows_motion(record: Record, stretch: slice) -> tuple[bool, bool]:
    """Return whether measured velocity shows motion over a stretch, and whether a live sensor shows rest.

    Velocity may be differentiated from the encoder over a window, so the ends of the stretch do not count, and a
    velocity that is still too says nothing. Nor does one that strays from position no further than elsewhere.

    Returns
    -------
    tuple of bool
        Motion, rest; neither where velocity is not logged or says nothing.
    """
    if VELOCITY not in record:
        return False, False
    quarter = (stretch.stop - stretch.start) // 4
    velocity = record[VELOCITY][stretch.start + quarter : stretch.stop - quarter]
    velocity = velocity[np.isfinite(velocity)]
    if len(velocity) < FEWEST_HELD:
        return False, False
    # averaged noise adds up like that of fewer, longer rows
    alike = independent_rows(record[VELOCITY], record.sample_time)
    noise = float(np.std(velocity[alike:] - velocity[:-alike])) / 2.0**0.5 if len(velocity) > 2 * alike else 0.0
    step = 0.5 * (stretch.stop - stretch.start) * record.sample_time / len(velocity)
    travelled = np.cumsum(velocity) * step
    allowed = 6.0 * noise * step * (alike * len(velocity)) ** 0.5
    resolved = MOTION_QUANTA * _quantum(record[POSITION])
    if np.ptp(travelled) <= max(allowed, resolved):
        return False, noise > 0.0
    return strays_unusually(record, slice(stretch.start + quarter, stretch.stop - quarter), resolved), False


def _quantum(values: Array) -> float:
    steps = np.abs(np.diff(values[np.isfinite(values)]))
    return float(np.min(steps[steps > 0.0], initial=np.inf)) if np.any(steps > 0.0) else 0.0


def _dead_pressure(record: Record) -> Note | None:
    """Look for the load in the pressure: noise and nothing else, while the piston moves, is no live sensor's.

    A pump that rests, or turns more slowly than it leaks, moves no piston and raises no pressure.
    """
    if PRESSURE not in record or SPEED not in record:
        return None
    pressure, speed = (record[name][np.isfinite(record[name])] for name in (PRESSURE, SPEED))
    if min(len(pressure), len(speed)) < FEWEST_DEAD or np.ptp(pressure) == 0.0 or np.ptp(speed) == 0.0:
        return None
    shown = record[POSITION][np.isfinite(record[POSITION])] if POSITION in record else pressure
    if len(shown) and np.ptp(shown) <= _quantum(shown):
        return None
    white, of_speed = (0.5 * float(np.var(np.diff(one))) for one in (pressure, speed))
    if white < NOISE_SHARE * float(np.var(pressure)) or of_speed >= NOISE_SHARE * float(np.mean(speed**2)):
        return None
    return SensorCode.SENSOR_NOISE_ONLY.note(channel=PRESSURE, noise=white**0.5)


def without_saturated(record: Record, parameters: EhaParameters) -> tuple[Record, tuple[Note, ...]]:
    """Take out the samples at which a pressure sensor was at the end of its range.

    A sensor that clips stays at one extreme value, for several samples and more than once, and comes and goes on the
    move; a pressure that settles creeps there, and one that a relief valve holds is noisy. What a clipped sensor would
    have shown is not known, so the samples become missing ones, and those of the differential pressure with them where
    it is the difference of two sensors. Of an absolute pressure only the upper end counts: make-up valves hold the
    lower.

    Parameters
    ----------
    record : Record
        The log, without gross outliers.
    parameters : EhaParameters
        The actuator, for the setting of its relief valve.

    Returns
    -------
    tuple of (Record, tuple of Note)
        The log without them, and a note for each channel that lost samples.
    """
    said: list[Note] = []
    for channel in PRESSURES:
        if channel not in record:
            continue
        values = record[channel]
        levels = _clipping_levels(values, parameters, both=channel == PRESSURE)
        if not levels:
            continue
        clipped = np.isin(values, levels)
        noise = measurement_variances(record.replace(**{channel: np.where(clipped, np.nan, values)}), (channel,))
        close = np.min([np.abs(values - level) for level in levels], axis=0) < BAND * noise[channel] ** 0.5
        reach = round(AROUND / record.sample_time)
        counts = np.cumsum(np.pad(clipped, (reach + 1, reach)))
        around = counts[2 * reach + 1 :] > counts[: -2 * reach - 1]
        share = 100.0 * np.count_nonzero(clipped) / np.count_nonzero(np.isfinite(values))
        at = " and ".join(f"{1e-5 * level:.4g}" for level in levels)
        said.append(SensorCode.SENSOR_CLIPPED.note(channel=channel, levels=at, unit="bar", percent=share))
        lost = (channel, PRESSURE) if _is_difference(record) else (channel,)
        left_out = clipped | (close & around)
        record = record.replace(**{name: np.where(left_out, np.nan, record[name]) for name in lost})
    return record, tuple(said)


def _is_difference(record: Record) -> bool:
    """Return whether differential pressure is only the difference of the two chambers' sensors."""
    if any(channel not in record for channel in PRESSURES):
        return False
    difference = record[CHAMBERS[0]] - record[CHAMBERS[1]]
    there = np.isfinite(difference) & np.isfinite(record[PRESSURE])
    return bool(np.allclose(record[PRESSURE][there], difference[there]))


def _clipping_levels(values: Array, p: EhaParameters, *, both: bool) -> list[float]:
    """Return the extreme values of a channel at which its sensor was at the end of its range."""
    seen = values[np.isfinite(values)]
    if len(seen) < FEWEST_HELD:
        return []
    extremes = (float(np.max(seen)), float(np.min(seen)))[: 2 if both else 1]
    return [level for level in extremes if _is_clipped(seen, level, p)]


def _is_clipped(seen: Array, level: float, p: EhaParameters) -> bool:
    """Return whether a channel without gaps repeats its extreme value as at the end of a sensor's range."""
    depth = np.abs(seen - level)
    count = np.count_nonzero(depth == 0.0)
    if not LEAST_RUN <= count < len(seen):
        return False
    steps = np.abs(np.diff(seen))
    moved = steps[steps > 0.0]
    usual = median(moved)
    far = ARRIVING * max(float(np.min(moved)), LEAST_ARRIVAL * usual)
    if count <= LEAST_END_HEAP * (np.count_nonzero(depth <= far) - count):
        return False
    elsewhere = steps[(depth[1:] > 0.0) | (depth[:-1] > 0.0)]
    repeats = (np.count_nonzero(elsewhere == 0.0) + 1.0) / (len(elsewhere) + 1.0)
    if repeats > COARSE and abs(abs(level) / p.relief_pressure - 1.0) < 1.0 - CLIPPED:
        return False
    bends = np.abs(np.diff(seen, 2))[steps[1:] > 0.0]
    noisy = repeats <= COARSE and len(bends) > 0 and median(bends) > NOISY * usual
    starts, lengths = holds(seen)
    here = (depth[starts] == 0.0) & (lengths >= LEAST_RUN)
    again = sum(
        length - 1
        for start, length in zip(starts[here], lengths[here], strict=True)
        if noisy or (_moves(depth[:start][-LEAST_RUN:], far) and _moves(depth[start + length :][:LEAST_RUN], far))
    )
    return bool(again * np.log(repeats) < np.log(CHANCE_OF_REPEATS))


def _moves(depth: Array, far: float) -> bool:
    """Return whether a channel comes from, or goes, farther away; True if the log shows too little of it."""
    return len(depth) < LEAST_RUN or float(np.max(depth)) > far
