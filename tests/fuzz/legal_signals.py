"""A log with known samples, the names and units in which it is written, and the error of the values read."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from plant.log.record import Record
from tests.log_formats.written import SI

Channels = Mapping[str, "np.ndarray[Any, np.dtype[np.float64]]"]

TIME = SI[0]

UNITS: Mapping[str, tuple[tuple[str, float], ...]] = {
    "time_s": (("s", 1.0), ("ms", 1e-3), ("us", 1e-6)),
    "motor_speed_rad_s": (("rad/s", 1.0), ("rpm", 2.0 * np.pi / 60.0), ("deg/s", np.pi / 180.0)),
    "position_m": (("m", 1.0), ("mm", 1e-3), ("cm", 1e-2), ("um", 1e-6)),
    "velocity_m_s": (("m/s", 1.0), ("mm/s", 1e-3)),
    "differential_pressure_pa": (("Pa", 1.0), ("bar", 1e5), ("MPa", 1e6), ("kPa", 1e3)),
}
"""Units of each channel, with their size in SI units."""

MOST = 3e-3
"""Largest deviation from the written values [fraction of the channel's range]."""


class Written(NamedTuple):
    """A channel as written: its SI name, its name in words, its unit, and its values in that unit."""

    channel: str
    words: str
    unit: str
    values: "np.ndarray[Any, np.dtype[np.float64]]"


def truth(rng: np.random.Generator) -> Channels:
    """Return a log of a moving actuator in which neighbouring samples differ."""
    rows = int(rng.choice([400, 400, 60, 1200]))
    step = float(rng.choice([1e-3, 1e-3, 5e-4, 2e-3]))
    time = step * np.arange(rows)
    rate, phase = rng.uniform(3.0, 30.0, 4), rng.uniform(0.0, 6.0, 2)
    speed = 90.0 * np.sin(6.0 * rate[0] * time + phase[0]) + 20.0 * np.sin(7.3 * rate[1] * time)
    velocity = 2.5e-4 * (speed - 3.0 * np.cos(9.0 * rate[2] * time))
    position = 0.01 + step * np.cumsum(velocity)
    pressure = 3e5 * np.sin(5.0 * rate[3] * time + phase[1]) + 1e5 * np.cos(40.0 * time)
    made: tuple[Any, ...] = (time, speed, position, velocity, pressure + 1e4 * np.sign(velocity))
    return {str(name): values for name, values in zip(SI, made, strict=True)}


def spelt(log: Channels, rng: np.random.Generator) -> list[Written]:
    """Return the channels in random units."""
    made: list[Written] = []
    for channel, values in log.items():
        unit, factor = UNITS[channel][int(rng.integers(len(UNITS[channel])))]
        stem = channel.removesuffix({"time_s": "_s", "differential_pressure_pa": "_pa"}.get(channel, "")).removesuffix(
            {"motor_speed_rad_s": "_rad_s", "position_m": "_m", "velocity_m_s": "_m_s"}.get(channel, "")
        )
        made.append(Written(channel, stem.replace("_", " ").capitalize(), unit, values / factor))
    return made


def heading(one: Written, style: str) -> str:
    """Return a column's heading with its unit: in ``[``, in ``(``, or as a suffix."""
    if style == "suffix":
        unit = one.unit if one.unit in ("MPa", "kPa") else one.unit.lower()
        return f"{one.words.lower().replace(' ', '_')}_{unit.replace('/', '_')}"
    return f"{one.words} [{one.unit}]" if style == "[" else f"{one.words} ({one.unit})"


def wrong(log: Channels, read: Record, later: Mapping[str, int]) -> str:
    """Return how a record differs from the written log, or an empty string.

    Parameters
    ----------
    later : Mapping[str, int]
        Samples by which a channel begins later than others [count].
    """
    step = log[TIME][1]
    if abs(read.sample_time / step - 1.0) > 2e-3:
        return f"sample time {read.sample_time:.6g} s for {step:g} s"
    rows, best = len(log[TIME]), (np.inf, "nothing alike")
    for shift in range(-40, 60):
        off: dict[str, float] = {}
        for channel, values in read.channels.items():
            place = np.arange(len(values)) + shift - later.get(channel, 0)
            there = (place >= 0) & (place < rows)
            apart = np.abs(values[there] - log[channel][place[there]])
            enough = np.isfinite(apart).any() and there.sum() >= 0.5 * min(rows, len(values))
            off[channel] = float(np.nanmax(apart) / np.ptp(log[channel])) if enough else np.inf
        best = min(best, (max(off.values()), f"shift {shift}: {off}"))
    return "" if best[0] <= MOST else best[1]
