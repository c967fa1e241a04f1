"""`blocks_of(record) -> Blocks`: a log as it is compared with circuits: mean velocity and pressure over blocks.

The comparison is coarse on purpose: means over blocks of 10 ms, whatever the log's sample rate. So encoder steps,
differentiation and pressure noise hardly count, and the cost depends on the log's length only.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from estimation.arrays import IntArray
from estimation.eha.explanation_notes import LEAKAGE_COURSE
from estimation.log_checks.bridging import bridged, bridged_slow_channel
from estimation.log_checks.channel_names import PRESSURE
from estimation.log_checks.coarse_means import coarse_mean_variance
from estimation.log_checks.dropout import long_gaps
from estimation.log_checks.measurement_noise import measurement_variances, position_variance
from faults.diagnosis.circuits.beginning import SETTLING, beginning_of
from plant.arrays import Array
from plant.errors import LogError
from plant.log.record import Record

BLOCK = 0.01
"""Time over which velocity and pressure are averaged [s]."""

FEWEST = 8
"""Least number of blocks in a log [count]."""

LONGEST = 30.0
"""Longest part of a log that is simulated [s]."""

RATE = 1e-3
"""Sample time to which faster logs are averaged [s]; half of it if that would blur the speed."""

MOST_BLURRED = 0.01
"""Share of the speed, root mean square, that averaging may remove at edges [fraction]. With a motor that lags, sines
lose 0.2 %, steps up to 0.6 %, and binary signals 1.3 %, which put leakage 0.3 to 1.3 % low."""


@dataclass(frozen=True, eq=False)
class Blocks:
    """A log as it is compared with a model.

    Parameters
    ----------
    speed : ndarray, shape (samples,)
        Motor speed [rad/s], whole.
    sample_time : float
        Time between its samples [s].
    block : int
        Samples in a block.
    velocity : ndarray, shape (n,)
        Mean velocity over each block [m/s]; NaN where unknown.
    pressure : ndarray, shape (n,), or None
        Mean differential pressure over each block [Pa], None if it is not logged.
    noise : ndarray, shape (outputs,)
        Standard deviation of sensor noise in velocity [m/s] and pressure [Pa].
    earlier_circuit : tuple of int or ndarray, shape (circuits,), and ndarray, shape (parameters,), or None
        Another circuit that ran up to a sample, or up to one sample per circuit, as a row of parameters; None if one
        ran throughout.
    leakage_course : ndarray, shape (samples,), or None
        Leakage over its value at the end of the log [dimensionless]; None if it does not change.
    stop : float or None
        Distance from the beginning of the log at which the piston ran into a stop [m]; None if only the rig file has
        stops.
    start_values : tuple of float, or None
        Differential pressure [Pa] and velocity [m/s] at the beginning of the log; None at rest, or if unknown.
    raw_start_values : tuple of float, or None
        The same [Pa, m/s] even if it is within noise: under a load a piston without pressure is not at rest.
    start_velocity : float
        Velocity with which a log without pressure begins [m/s]; 0 if motor or piston is at rest, and with pressure.
    place : float
        Position at the beginning of the log [m]; 0 if none is logged.
    settling : float
        Time at the start that does not count [s].
    averaged : bool
        Whether each sample of motor speed is the mean of several logged ones.
    differenced : bool
        Whether velocity is a difference of positions: an error added to one block is subtracted from the next.
    lead : float
        Time by which the motor leads straight lines between logged samples [s], see
        `faults.diagnosis.circuits.between_samples`.
    substeps : int
        Samples of the motor speed from one logged sample to the next.
    """

    speed: Array
    sample_time: float
    block: int
    velocity: Array
    pressure: Array | None
    noise: Array
    earlier_circuit: tuple[int | IntArray, Array] | None = None
    leakage_course: Array | None = None
    stop: float | None = None
    start_values: tuple[float, float] | None = None
    raw_start_values: tuple[float, float] | None = None
    start_velocity: float = 0.0
    place: float = 0.0
    settling: float = SETTLING
    averaged: bool = False
    differenced: bool = False
    lead: float = 0.0
    substeps: int = 1

    @property
    def rows(self) -> int:
        """Logged samples in a block."""
        return self.block // self.substeps

    @cached_property
    def outputs(self) -> Array:
        """Measured outputs, shape (n, outputs): velocity [m/s], and pressure [Pa] if there is one."""
        return np.column_stack([self.velocity] if self.pressure is None else [self.velocity, self.pressure])

    @cached_property
    def valid(self) -> NDArray[np.bool_]:
        """Which outputs are valid in the blocks that count, shape (n - first, outputs)."""
        return np.isfinite(self.outputs[self.first :])

    @cached_property
    def counts(self) -> NDArray[np.intp]:
        """Number of valid values, shape (outputs,)."""
        return np.sum(self.valid, axis=0)

    @cached_property
    def rms(self) -> Array:
        """Their root mean squares, shape (outputs,) [m/s, Pa]."""
        return root_mean_square(self.outputs[self.first :])

    @property
    def travel(self) -> float:
        """Total travel of the piston in both directions [m]."""
        return float(np.ptp(self.distances))

    @cached_property
    def reach(self) -> float:
        """Largest distance of the piston from its start [m], to either side."""
        return float(np.max(np.abs(self.distances), initial=0.0))

    @cached_property
    def distances(self) -> Array:
        """Distance of the piston up to each block [m], gaps bridged at the neighbouring speed."""
        known = bridged(self.velocity) if np.any(np.isfinite(self.velocity)) else np.zeros(len(self.velocity))
        return np.cumsum(known) * self.block * self.sample_time

    @property
    def first(self) -> int:
        """First block that counts."""
        return round(self.settling / (self.block * self.sample_time))


def root_mean_square(values: Array) -> Array:
    """Return the root mean square of each column over its valid samples.

    Parameters
    ----------
    values : ndarray, shape (n, columns)
        Any unit; NaN where missing.

    Returns
    -------
    ndarray, shape (columns,)
        In the same units; NaN if no sample is valid.
    """
    squares = values**2
    mean = np.mean(squares, axis=0)
    return np.sqrt(mean if np.all(np.isfinite(mean)) else np.nanmean(squares, axis=0))


def blocks_of(record: Record) -> Blocks:
    """Return a log in blocks.

    Parameters
    ----------
    record : Record
        A log with motor speed, and position or velocity.

    Returns
    -------
    Blocks
        Means over `BLOCK`, of `LONGEST` at most.

    Raises
    ------
    LogError
        If neither position nor velocity is logged, or the log is shorter than `SETTLING` and a few blocks.
    """
    record = record.slice(0, round(LONGEST / record.sample_time) + 1)
    pooled = _samples_in_one(record)
    sample_time = pooled * record.sample_time
    block = max(2, round(BLOCK / sample_time))
    count = (len(record) // pooled - 1) // block
    if count * block * sample_time < 2.0 * SETTLING or count < FEWEST:
        least = max(2.0 * SETTLING, FEWEST * block * sample_time)
        raise LogError(
            f"the log lasts {record.duration:.3g} s, but a diagnosis needs {least:.3g} s or more; log 10 s of steps "
            "at several speeds"
        )
    given, rows = _without_slow_channels(record, pooled)
    whole = {name: _pooled(given[name], pooled)[: count * block + 1] for name in record if name in _NEEDED}
    velocity = _velocity(whole, block, sample_time)
    if velocity is None:
        raise LogError(f"velocity_m_s or position_m is needed; the log has {', '.join(record)}")
    pressure = _pressure(whole, block, sample_time)
    if pressure is None:
        whole.pop(PRESSURE, None)
    speed = bridged(whole["motor_speed_rad_s"])
    blind = _gap_blocks(whole["motor_speed_rad_s"], block, round(SETTLING / sample_time))
    velocity = np.where(blind | _gap_blocks(whole.get("position_m"), block), np.nan, velocity)
    pressure = None if pressure is None else np.where(blind, np.nan, pressure)
    noise, course = _noise(whole, block, sample_time), whole.get(LEAKAGE_COURSE)
    if pressure is not None and PRESSURE in rows:
        noise[-1] = _slow_noise(record, PRESSURE, rows[PRESSURE] / (block * pooled))
    if "velocity_m_s" in rows and not _uses_position(whole):
        noise[0] = _slow_noise(record, "velocity_m_s", rows["velocity_m_s"] / (block * pooled))
    elif "position_m" in rows:
        share = 2.0 * min(1.0, rows["position_m"] / pooled)
        noise[0] = (position_variance(record["position_m"]) * share) ** 0.5 / (block * sample_time)
    elif _uses_position(whole):
        lasting = (2.0 * coarse_mean_variance(record["position_m"], pooled)) ** 0.5 / (block * sample_time)
        noise[0] = max(float(noise[0]), lasting)
    return Blocks(
        speed,
        sample_time,
        block,
        velocity,
        pressure,
        noise,
        leakage_course=course,
        place=_start_position(whole),
        averaged=pooled > 1,
        differenced=_uses_position(whole),
        **beginning_of(record, whole.get(PRESSURE), velocity)._asdict(),
    )


def _without_slow_channels(record: Record, pooled: int) -> tuple[Record, Mapping[str, int]]:
    """Return a log without the gaps of channels that have a sample only every so many rows, and that number by channel.

    A mean over rows most of which are missing is unknown. Where none is taken, position and speed are bridged later.
    """
    names = [one for one in (*_MOTION, PRESSURE) if one in record and (pooled > 1 or one in ("velocity_m_s", PRESSURE))]
    bridges = {name: bridged_slow_channel(record[name]) for name in names}
    slow = {name: (values, rows) for name, (values, rows) in bridges.items() if rows > 1}
    given = record.replace(**{name: values for name, (values, _) in slow.items()}) if slow else record
    return given, {name: rows for name, (_, rows) in slow.items()}


def _slow_noise(record: Record, channel: str, share: float) -> float:
    """Return the noise of a slow channel's block means: blocks hold fewer samples, and lines between them add none.

    ``share`` is the variance of a mean over that of a sample [dimensionless].
    """
    return (measurement_variances(record, [channel])[channel] * share) ** 0.5


def _samples_in_one(record: Record) -> int:
    """Return the number of samples in a block."""
    pooled = max(1, round(RATE / record.sample_time))
    if pooled == 1 or len(record) < 2 * pooled:
        return pooled
    speed = bridged(record["motor_speed_rad_s"])
    means = _pooled(speed, pooled)
    middles = 0.5 * (pooled - 1) + pooled * np.arange(len(means))
    lost = speed[: pooled * len(means)] - np.interp(np.arange(pooled * len(means)), middles, means)
    blurred = root_mean_square(lost) > MOST_BLURRED * root_mean_square(speed)
    return max(1, round(0.5 * RATE / record.sample_time)) if blurred else pooled


def _velocity(whole: Mapping[str, Array], block: int, sample_time: float) -> Array | None:
    """Return the mean velocity over each block [m/s], None if no motion is logged; position is preferred."""
    if _uses_position(whole):
        return np.diff(bridged(whole["position_m"])[::block]) / (block * sample_time)
    if "velocity_m_s" in whole and np.any(np.isfinite(whole["velocity_m_s"])):
        return _mean(whole["velocity_m_s"], block)
    return None


def _uses_position(whole: Mapping[str, Array]) -> bool:
    """Return whether velocity is taken from a logged position."""
    return "position_m" in whole and bool(np.any(np.isfinite(whole["position_m"])))


def _pressure(whole: Mapping[str, Array], block: int, sample_time: float) -> Array | None:
    """Return the mean pressure over each block [Pa], None if none is logged or its sensor failed throughout."""
    if PRESSURE not in whole:
        return None
    pressure = _mean(whole[PRESSURE], block)
    return pressure if np.any(np.isfinite(pressure[round(SETTLING / (block * sample_time)) :])) else None


def _gap_blocks(values: Array | None, block: int, behind: int = 0) -> NDArray[np.bool_]:
    """Return the blocks that contain, or closely follow, a long gap of a channel: the circuit ran without data."""
    if values is None or not np.any(gone := long_gaps(values)):
        return np.zeros(1, dtype=np.bool_)
    sums = np.cumsum(np.concatenate([np.zeros(behind + 1, dtype=np.intp), gone]))
    within = sums[behind + 1 :] > sums[: -behind - 1]
    return np.any(within[: (len(values) - 1) // block * block].reshape(-1, block), axis=1)


def _start_position(whole: Mapping[str, Array]) -> float:
    """Return the first position of a log, 0 if none is logged [m]."""
    position = whole.get("position_m")
    return 0.0 if position is None or not np.any(np.isfinite(position)) else float(bridged(position)[0])


def _noise(whole: Mapping[str, Array], block: int, sample_time: float) -> Array:
    """Return the white noise of the channels that remains in block means."""
    record, velocity = Record(sample_time, whole), "velocity_m_s"
    if "position_m" in whole:
        noise = [(2.0 * position_variance(whole["position_m"])) ** 0.5 / (block * sample_time)]
    else:
        noise = [(measurement_variances(record, [velocity])[velocity] / block) ** 0.5]
    if PRESSURE in whole:
        noise.append((measurement_variances(record, [PRESSURE])[PRESSURE] / block) ** 0.5)
    return np.array(noise)


_MOTION = ("motor_speed_rad_s", "position_m", "velocity_m_s")
_NEEDED = (*_MOTION, PRESSURE, LEAKAGE_COURSE)


def _pooled(values: Array, pooled: int) -> Array:
    return values if pooled == 1 else _mean(values, pooled, spare=0)


def _mean(values: Array, block: int, spare: int = 1) -> Array:
    """Return block means over valid samples; NaN if more than half are missing.

    Samples that a clipped sensor lost are unlike those it kept, so the mean of a small rest would be biased.
    """
    count = (len(values) - spare) // block
    parts = values[: count * block].reshape(count, block)
    there = np.isfinite(parts)
    if np.all(there):
        return parts.mean(axis=1)
    seen = there.sum(axis=1)
    return np.where(2 * seen >= block, np.where(there, parts, 0.0).sum(axis=1) / np.maximum(seen, 1), np.nan)
