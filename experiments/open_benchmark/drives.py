"""Commands to the motor or to the position loop at every tick; each keeps the piston within its travel."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from experiments.open_benchmark.run import TICK
from plant.arrays import Array


@dataclass(frozen=True)
class DriveLimits:
    """Limits of a drive.

    Parameters
    ----------
    duration : float
        Duration [s].
    rated : float
        Motor speed at 4 V [rad/s].
    travel : float
        Maximum travel of the piston to either side [m].
    glide : float
        Approximate ratio of piston velocity to motor speed [m/rad].
    """

    duration: float
    rated: float
    travel: float
    glide: float

    @property
    def ticks(self) -> int:
        """Number of rows of a course."""
        return round(self.duration / TICK)


def _piecewise_speed(room: DriveLimits, move: Callable[[float], tuple[float, float]]) -> Array:
    """Return a piecewise constant speed; `move` takes the estimated position [m] and returns a time [s] and a speed.

    A speed that would take the piston too far is reversed.
    """
    speed, at, where = np.zeros(room.ticks), 0, 0.0
    while at < room.ticks:
        seconds, asked = move(where)
        if abs(where + room.glide * asked * seconds) > room.travel:
            asked = -abs(asked) * np.sign(where)
        ticks = max(1, round(seconds / TICK))
        speed[at : at + ticks] = asked
        where += room.glide * asked * seconds
        at += ticks
    return speed


def steps(room: DriveLimits, rng: np.random.Generator) -> Array:
    """Return steps of 30 to 100 % of the rated speed with short pauses; shape (n,) [rad/s]."""
    longest = np.clip(room.travel / (room.glide * room.rated), 0.4, 3.0)

    def move(_: float) -> tuple[float, float]:
        if rng.random() < 0.12:
            return float(rng.uniform(0.1, 0.4)), 0.0
        return float(rng.uniform(0.3, 1.0) * longest), float(rng.choice((-1, 1)) * rng.uniform(0.3, 1.0) * room.rated)

    return _piecewise_speed(room, move)


def prbs(room: DriveLimits, rng: np.random.Generator) -> Array:
    """Return a binary signal held 20 to 100 ms, drawn towards a sequence of random positions; shape (n,) [rad/s]."""
    hold, amplitude = float(rng.choice((0.02, 0.05, 0.1))), rng.uniform(0.5, 1.0) * room.rated
    goals = list(rng.uniform(-room.travel, room.travel, 4 * room.ticks))

    def move(where: float) -> tuple[float, float]:
        if abs(goals[-1] - where) < room.glide * amplitude * 0.2:
            goals.pop()
        towards = np.sign(goals[-1] - where)
        return hold, float(amplitude * (towards if rng.random() < 0.7 else -towards))

    return _piecewise_speed(room, move)


def multisine(room: DriveLimits, rng: np.random.Generator) -> Array:
    """Return twelve sines from 0.2 to 25 Hz of random phase, weaker at higher frequency; shape (n,) [rad/s]."""
    time = TICK * np.arange(room.ticks)
    lowest = np.clip(0.5 * room.glide * room.rated / (2.0 * np.pi * room.travel), 0.05, 1.0)
    signal = np.zeros(room.ticks)
    for f in np.geomspace(lowest, 25.0, 12):
        signal += f**-0.2 * np.sin(2.0 * np.pi * (f * time + rng.random()))
    return rng.uniform(0.8, 1.0) * room.rated * signal / np.max(np.abs(signal))


def sines(room: DriveLimits, rng: np.random.Generator) -> Array:
    """Return a slow sine that uses the travel, plus a faster one; shape (n,) [rad/s]."""
    time = TICK * np.arange(room.ticks)
    slow = np.clip(0.6 * room.glide * room.rated / (2.0 * np.pi * room.travel), 0.05, 1.0)
    phase, fast = rng.choice((0.0, 0.5)), rng.uniform(2.0, 6.0)
    return room.rated * (0.6 * np.sin(2.0 * np.pi * (slow * time + phase)) + 0.4 * np.sin(2.0 * np.pi * fast * time))


def position_steps(room: DriveLimits, rng: np.random.Generator) -> Array:
    """Return positions that are held long enough for the loop to reach them; shape (n,) [m]."""
    asked, at, last = np.zeros(room.ticks), 0, 0.0
    while at < room.ticks:
        goal = rng.uniform(-1.0, 1.0) * room.travel
        ticks = round((abs(goal - last) / (room.glide * room.rated) + rng.uniform(0.2, 0.8)) / TICK)
        asked[at : at + ticks] = goal
        at, last = at + ticks, goal
    return asked


def tracking(room: DriveLimits, rng: np.random.Generator) -> Array:
    """Return a position that follows four sines, at up to 80 % of the rated speed; shape (n,) [m]."""
    time = TICK * np.arange(room.ticks)
    signal = np.zeros(room.ticks)
    for f in np.geomspace(0.15, 3.0, 4) * rng.uniform(0.8, 1.2):
        signal += np.sin(2.0 * np.pi * (f * time + rng.random())) / f
    signal -= signal[0]
    fastest = 0.8 * room.glide * room.rated / (np.max(np.abs(np.diff(signal))) / TICK)
    return signal * min(fastest, room.travel / np.max(np.abs(signal)))


Draw = Callable[[DriveLimits, np.random.Generator], Array]

OPEN: Mapping[str, Draw] = {"steps": steps, "multisine": multisine, "prbs": prbs, "sines": sines}
"""Drives that demand a motor speed."""

CLOSED: Mapping[str, Draw] = {"posn": position_steps, "track": tracking}
"""Drives that demand a position."""

DRIVES: Mapping[str, Draw] = {**OPEN, **CLOSED}
"""All drives, by their name in the truth."""
