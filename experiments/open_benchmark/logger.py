"""Sensors and logger: the log of a run, with noise, delays and other errors of a test bench."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
import pandas as pd

from experiments.open_benchmark.equations import STATES
from experiments.open_benchmark.run import RECORD
from plant.arrays import Array
from plant.errors import HydrostateError

SPEED, POSITION, VELOCITY = "motor_speed_rad_s", "position_m", "velocity_m_s"
DIFFERENCE, PRESSURE_A, PRESSURE_B = "differential_pressure_pa", "pressure_a_pa", "pressure_b_pa"
PRESSURES = (DIFFERENCE, PRESSURE_A, PRESSURE_B)
PLAIN_CHANNELS = (SPEED, POSITION, VELOCITY, DIFFERENCE)


@dataclass(frozen=True)
class Sensor:
    """Sensor of one channel: its errors, in the channel's own unit.

    Parameters
    ----------
    noise, quantum : float
        Standard deviation and resolution; 0 for no quantisation [unit of the channel].
    gain : float
        Ratio of the logged value, less the offset, to the true one [dimensionless].
    offset : float
        Logged value at a true value of zero [unit of the channel].
    lag, delay : float
        Time constant of a first-order lag, and pure delay [s].
    corner : float
        Corner frequency of a second-order Butterworth low-pass; 0 for no filter [Hz].
    hold : int
        Number of logger rows over which the sensor repeats its last sample [samples].
    average : int
        Number of rows in the logger's moving average [samples].
    drift : float
        Change of the offset from the first row to the last, linear in time [unit of the channel].
    play : float
        Backlash: movement after a reversal before the sensor follows [unit of the channel].
    hum : float
        Amplitude of mains hum picked up by the cable; the third harmonic has a fifth of it [unit of the channel].
    hum_frequency : float
        Mains frequency [Hz].
    """

    noise: float = 0.0
    quantum: float = 0.0
    gain: float = 1.0
    offset: float = 0.0
    lag: float = 0.0
    delay: float = 0.0
    corner: float = 0.0
    hold: int = 1
    average: int = 1
    drift: float = 0.0
    play: float = 0.0
    hum: float = 0.0
    hum_frequency: float = 50.0

    def read(self, time: Array, fine: Array, values: Array, rng: np.random.Generator) -> Array:
        """Return the logged channel.

        Parameters
        ----------
        time : ndarray, shape (n,)
            Sample times of the sensor [s].
        fine, values : ndarray, shape (m,)
            Times and values of the quantity in the run [s, unit of the channel].
        rng : numpy.random.Generator
            Source of noise.

        Returns
        -------
        ndarray, shape (n,)
            Logged values [unit of the channel].
        """
        sensed = _backlash(values, self.play) if self.play > 0.0 else values
        sensed = _first_order_lag(sensed, self.lag / RECORD) if self.lag > 0.0 else sensed
        sensed = _low_pass(sensed, self.corner * RECORD) if self.corner > 0.0 else sensed
        sampled = np.interp(time - self.delay, fine, sensed)
        offset = self.offset + self.drift * np.linspace(0.0, 1.0, len(time))
        logged = self.gain * sampled + offset + self.noise * rng.standard_normal(len(time))
        logged = logged + self._hum(time) if self.hum > 0.0 else logged
        logged = _moving_average(logged, self.average) if self.average > 1 else logged
        logged = self.quantum * np.round(logged / self.quantum) if self.quantum > 0.0 else logged
        rows = np.arange(len(time))
        return logged[rows - rows % self.hold]

    def _hum(self, time: Array) -> Array:
        """Return the mains hum in a channel."""
        phase = 2.0 * np.pi * self.hum_frequency * time
        return self.hum * (np.sin(phase + 1.0) + 0.2 * np.sin(3.0 * phase))


def _first_order_lag(values: Array, records: float) -> Array:
    """Return values after a first-order lag whose time constant is given in records."""
    from scipy.signal import lfilter

    pole = np.exp(-1.0 / records)
    return np.asarray(lfilter([1.0 - pole], [1.0, -pole], values - values[0])) + values[0]


def _low_pass(values: Array, corner: float) -> Array:
    """Return values after a second-order Butterworth low-pass, its corner in units of 1/`RECORD`."""
    from scipy.signal import butter, lfilter

    over, under = butter(2, 2.0 * corner)
    return np.asarray(lfilter(over, under, values - values[0])) + values[0]


def _moving_average(values: Array, rows: int) -> Array:
    """Return the moving average of the last rows, with the first value extended to before the first row."""
    sums = np.cumsum(np.concatenate([np.full(rows, values[0]), values]))
    return (sums[rows:] - sums[:-rows]) / rows


def _backlash(values: Array, play: float) -> Array:
    """Return the output of a play (backlash) that starts in its middle."""
    out, at = np.empty_like(values), float(values[0])
    for k, value in enumerate(values.tolist()):
        at = min(max(at, value - 0.5 * play), value + 0.5 * play)
        out[k] = at
    return out


def _sensors() -> Mapping[str, Sensor]:
    pressures = {name: Sensor(noise=5e3, quantum=500.0) for name in PRESSURES}
    motion = {SPEED: Sensor(noise=0.05), POSITION: Sensor(quantum=1e-6), VELOCITY: Sensor(noise=1e-3)}
    return MappingProxyType({**motion, **pressures})


@dataclass(frozen=True)
class Logger:
    """A logger with its sensors.

    Parameters
    ----------
    sensors : Mapping[str, Sensor]
        Sensors by channel.
    channels : tuple of str
        Logged channels, in column order.
    headings : Mapping[str, str]
        Column name of a channel, if it differs from the channel's name.
    sample_time : float
        Sample time [s].
    jitter : float
        Half width of the clock's jitter, as a fraction of the sample time; the log has the true times.
    begin : float
        Time that the machine runs before the log begins [s].
    stalls : int
        Number of times that the computer that stamps rows is busy; rows sampled meanwhile wait and are then stamped
        together.
    stall : float
        Duration of a stall [s].
    """

    sensors: Mapping[str, Sensor] = field(default_factory=_sensors)
    channels: tuple[str, ...] = PLAIN_CHANNELS
    headings: Mapping[str, str] = field(default_factory=dict[str, str])
    sample_time: float = 1e-3
    jitter: float = 0.0
    begin: float = 0.0
    stalls: int = 0
    stall: float = 0.0

    def log(self, states: Array, rng: np.random.Generator) -> pd.DataFrame:
        """Return the log of a run, shape (samples, 1 + channels), with the column names of its file.

        Parameters
        ----------
        states : ndarray, shape (m, 7)
            States of the run, named as in `STATES`.
        rng : numpy.random.Generator
            Source of noise and jitter.
        """
        if not np.all(np.isfinite(states)):
            raise HydrostateError("a run of the open benchmark must stay finite, got one that ran away")
        fine = RECORD * np.arange(len(states), dtype=np.float64)
        true = dict(zip(STATES, states.T, strict=True))
        a, b = true["pressure_a"], true["pressure_b"]
        quantities = {SPEED: true["motor_speed"], POSITION: true["position"], VELOCITY: true["velocity"]}
        quantities |= {DIFFERENCE: a - b, PRESSURE_A: a, PRESSURE_B: b}
        count = round((fine[-1] + RECORD - self.begin) / self.sample_time)
        clock = self.sample_time * np.arange(count)
        if self.jitter > 0.0:
            clock[1:-1] += self.jitter * self.sample_time * rng.uniform(-1.0, 1.0, count - 2)
        columns = {"time_s": self._stamped(clock, rng) if self.stalls else clock}
        for name in self.channels:
            read = self.sensors[name].read(self.begin + clock, fine, quantities[name], rng)
            columns[self.headings.get(name, name)] = read
        return pd.DataFrame(columns)

    def _stamped(self, clock: Array, rng: np.random.Generator) -> Array:
        """Return the stamps of a computer that is busy at times [s]; a row takes it a twentieth of the sample time."""
        stamps = clock.copy()
        for begin in rng.uniform(0.05, 0.9, self.stalls) * clock[-1]:
            waits = np.flatnonzero((clock > begin) & (clock < begin + self.stall))
            stamps[waits] = begin + self.stall + 0.05 * self.sample_time * np.arange(len(waits))
        return np.maximum.accumulate(stamps)
