"""Sensors that have stopped telling the truth: frozen, dead, or at the end of their range.

A filter believes a frozen encoder like any other, and an innocent chi-square follows: constant samples agree with each
other. So a log is looked at before it is believed. What is at a stop of the sensor's range is censored, not measured,
and is taken out (`without_saturated`).
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from plant.eha import EhaParameters
from plant.record import Record

Array = NDArray[np.float64]

PRESSURE = "differential_pressure_pa"

LONGEST_HOLD = 0.05
"""A live sensor does not repeat one value for longer while the quantity moves [s]."""

FEWEST_HELD = 20
"""Repeated samples below which nothing is concluded from a hold, whatever its length."""

USUAL_REPEATS = 0.5
"""A channel that repeats its last sample more often is coarse: that it holds a value is no sign there [fraction]."""

SATURATED_RUNS = 3
"""A channel that stays at its largest value so often, for several samples each, is at the end of its range."""

LEAST_RUN = 3
"""Samples at the largest value that count as one stay there."""

NOISE_SHARE = 0.9
"""A channel whose white noise is more than this share of all that it shows, shows nothing [fraction]."""

CLIPPED = 0.98
"""A pressure held above this share of its largest is at the end of its range or at the relief valve [fraction]."""

UNDELIVERED = 5.0
"""Pumped volume that neither motion nor the oil's compression explains, over what compression can take [fraction]."""


def sensor_objections(record: Record, parameters: EhaParameters) -> tuple[str, ...]:
    """Return a sentence for each sensor of a log that cannot be believed.

    Parameters
    ----------
    record : Record
        The log.
    parameters : EhaParameters
        The actuator, to tell what the pump must have moved.

    Returns
    -------
    tuple of str
        None for a sound log.
    """
    pressure = _frozen_pressure(record, parameters) or _dead_pressure(record)
    believed = record.replace(**{PRESSURE: None}) if pressure and PRESSURE in record else record
    found = (pressure, _frozen_velocity(record), _frozen_position(believed, parameters))
    return tuple(sentence for sentence in found if sentence)


def holds(values: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return where runs of one repeated value begin, and how long they are; missing samples end a run.

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


def _longest_hold(values: Array, sample_time: float) -> tuple[int, int] | None:
    """Return the first sample and the length of the longest hold, if it is long enough to mean something."""
    starts, lengths = holds(values)
    longest = int(np.argmax(lengths))
    enough = max(FEWEST_HELD, LONGEST_HOLD / sample_time)
    return (int(starts[longest]), int(lengths[longest])) if lengths[longest] > enough else None


def _hold_of(record: Record, channel: str) -> slice | None:
    """Return the longest stretch over which a channel repeats itself although it usually does not."""
    if channel not in record:
        return None
    values = record[channel]
    hold = _longest_hold(values, record.sample_time)
    if hold is None:
        return None
    start, length = hold
    others = np.count_nonzero(values[1:] == values[:-1]) - (length - 1)
    coarse = length < len(values) and others > USUAL_REPEATS * (len(values) - length)
    return None if coarse else slice(start, start + length)


def _frozen_velocity(record: Record) -> str | None:
    """Compare a still velocity sensor with the encoder; a stuck piston's velocity is zero, and its encoder still."""
    stretch = _hold_of(record, "velocity_m_s")
    if stretch is None or "position_m" not in record:
        return None
    position, velocity = record["position_m"][stretch], float(record["velocity_m_s"][stretch][0])
    position = position[np.isfinite(position)]
    if len(position) < FEWEST_HELD:
        return None
    travelled, quantum = float(position[-1] - position[0]), _quantum(record["position_m"])
    said = velocity * record.sample_time * (len(position) - 1)
    strayed = max(abs(travelled - said), float(np.ptp(position)) - abs(said))
    return _says_frozen("velocity_m_s", stretch, record) if strayed > UNDELIVERED * max(quantum, 1e-6) else None


def _frozen_pressure(record: Record, p: EhaParameters) -> str | None:
    """Compare a still pressure with the pump: while that delivers unevenly, pressure is never the same for long."""
    stretch = _hold_of(record, PRESSURE)
    if stretch is None or "motor_speed_rad_s" not in record:
        return None
    if stretch.stop - stretch.start == len(record):
        return f"{PRESSURE} is {record[PRESSURE][0]:g} Pa throughout: the sensor is dead, or not connected"
    speed = record["motor_speed_rad_s"][stretch]
    volume = np.cumsum(_pumped(speed, p)) * record.sample_time
    if np.nanmax(speed) == np.nanmin(speed):
        return None
    if abs(float(record[PRESSURE][stretch][0])) > CLIPPED * float(np.nanmax(np.abs(record[PRESSURE]))):
        return None
    return _says_frozen(PRESSURE, stretch, record) if np.ptp(volume) > 0.0 else None


def _pumped(speed: Array, p: EhaParameters) -> Array:
    ideal = p.pump_displacement * np.nan_to_num(speed)
    return np.sign(ideal) * np.maximum(np.abs(ideal) - p.flow_bias, 0.0)


def _says_frozen(channel: str, stretch: slice, record: Record) -> str:
    start, length = stretch.start, stretch.stop - stretch.start
    begin = record.start_time + start * record.sample_time
    return (
        f"{channel} repeats {record[channel][start]:.6g} from {begin:.3g} s for {length * record.sample_time:.3g} s "
        "while the others move: the sensor froze"
    )


def _frozen_position(record: Record, p: EhaParameters) -> str | None:
    """Compare a still encoder with what the other sensors say moved meanwhile.

    A stuck piston is still too; then the pump only compresses oil and feeds the leak, which takes a bounded volume.
    """
    if "position_m" not in record:
        return None
    hold = _longest_hold(record["position_m"], record.sample_time)
    if hold is None:
        return None
    stretch = slice(hold[0], hold[0] + hold[1])
    speed = record["motor_speed_rad_s"][stretch] if "motor_speed_rad_s" in record else np.zeros(1)
    pumped = _pumped(speed, p)
    highest = p.relief_pressure
    if PRESSURE in record:
        highest = float(np.nanmax(np.abs(record[PRESSURE][stretch]), initial=0.0))
    taken = 2.0 * highest * p.chamber_volume / p.bulk_modulus
    moved = np.cumsum(pumped - np.sign(pumped) * p.leakage_coefficient * highest) * record.sample_time
    swing = float(np.max(moved) - np.min(moved))
    slid = _slid(record, stretch)
    if swing < UNDELIVERED * taken and not slid:
        return None
    return _says_frozen("position_m", stretch, record)


def _slid(record: Record, stretch: slice) -> bool:
    """Return whether measured velocity shows motion over the stretch.

    Velocity may be differentiated from the encoder over a window, so the ends of the stretch do not count.
    """
    if "velocity_m_s" not in record:
        return False
    quarter = (stretch.stop - stretch.start) // 4
    velocity = record["velocity_m_s"][stretch.start + quarter : stretch.stop - quarter]
    velocity = velocity[np.isfinite(velocity)]
    if len(velocity) < FEWEST_HELD:
        return False
    noise = float(np.std(np.diff(velocity))) / 2.0**0.5
    travelled = np.cumsum(velocity) * record.sample_time
    allowed = 6.0 * noise * record.sample_time * len(velocity) ** 0.5
    return bool(np.ptp(travelled) > max(allowed, UNDELIVERED * _quantum(record["position_m"])))


def _quantum(values: Array) -> float:
    steps = np.abs(np.diff(values))
    return float(np.min(steps[steps > 0.0], initial=np.inf)) if np.any(steps > 0.0) else 0.0


def _dead_pressure(record: Record) -> str | None:
    """Look for the load in the pressure: noise and nothing else, while the motor turns, is no live sensor's."""
    if PRESSURE not in record or "motor_speed_rad_s" not in record:
        return None
    pressure = record[PRESSURE][np.isfinite(record[PRESSURE])]
    if len(pressure) < FEWEST_HELD or np.ptp(pressure) == 0.0 or np.ptp(record["motor_speed_rad_s"]) == 0.0:
        return None
    white = 0.5 * float(np.var(np.diff(pressure)))
    if white < NOISE_SHARE * float(np.var(pressure)):
        return None
    return f"{PRESSURE} shows {white**0.5:.3g} Pa of noise and nothing else while the motor turns: the sensor is dead"


def without_saturated(record: Record, channels: Sequence[str]) -> tuple[Record, Mapping[str, int]]:
    """Take out the samples at which a sensor was at the end of its range.

    A sensor that clips stays at one extreme value, for several samples and more than once. What it would have shown is
    not known, so the samples become missing ones.

    Parameters
    ----------
    record : Record
        The log.
    channels : sequence of str
        Channels to look at.

    Returns
    -------
    tuple of (Record, Mapping[str, int])
        The log without them, and how many samples each channel lost.
    """
    lost: dict[str, int] = {}
    for channel in channels:
        values = record[channel]
        clipped = np.zeros(len(values), dtype=bool)
        for extreme in (np.nanmax(values), np.nanmin(values)):
            starts, lengths = holds(values)
            stays = [(s, n) for s, n in zip(starts, lengths, strict=True) if values[s] == extreme and n >= LEAST_RUN]
            if len(stays) >= SATURATED_RUNS or any(
                n >= max(FEWEST_HELD, LONGEST_HOLD / record.sample_time) for _, n in stays
            ):
                clipped |= values == extreme
        if np.any(clipped) and not np.all(clipped):
            lost[channel] = int(np.count_nonzero(clipped))
            record = record.replace(**{channel: np.where(clipped, np.nan, values)})
    return record, lost
