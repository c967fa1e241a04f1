"""Logs made in a millisecond from a piston's motion, its pressure and its pump; and logs of the circuit."""

from typing import Any

import numpy as np

from estimation.log_checks import sensor_check
from plant.arrays import Array
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH, Sensors
from tests.edges import edge
from tests.numbers import told

SPEED, POSITION, VELOCITY = "motor_speed_rad_s", "position_m", "velocity_m_s"
PRESSURE, PORTS = "differential_pressure_pa", ("pressure_a_pa", "pressure_b_pa")
HEALTHY = EhaParameters()
T = 2e-3
N = 1500


def noise(size: float, count: int = N, seed: int = 5) -> Array:
    return size * np.random.default_rng(seed).standard_normal(count)


def circuit_log(drive: str, sensors: Sensors = BENCH) -> Record:
    """Return four seconds of the healthy circuit at 1 kHz."""
    rng = np.random.default_rng(4)
    signal = make_drive(drive, 4.0, 1e-3, HEALTHY, rng)
    return simulate(CIRCUIT, signal, 1e-3, HEALTHY, sensors=sensors, rng=rng)


def made_log(count: int = N, *, leakage: float = 1.0, size: float = 1.0, noisy: float = 1.0) -> Record:
    """Return a log of a piston that moves in two sines, with the friction and leakage of its parameters."""
    p, t = HEALTHY, T * np.arange(count)
    waves = ((0.03 * size, 7.0, 0.0), (0.015 * size, 24.0, 1.0))
    velocity = sum((a * np.sin(w * t + s) for a, w, s in waves), np.zeros(count))
    position = sum((-a / w * np.cos(w * t + s) for a, w, s in waves), np.zeros(count))
    pressure = (p.friction_coulomb * np.tanh(velocity / 2e-3) + p.friction_linear * velocity) / p.piston_area
    stored = p.chamber_volume / p.bulk_modulus * np.gradient(pressure, T)
    net = p.piston_area * velocity + stored + leakage * p.leakage_coefficient * pressure
    speed = (net + p.flow_bias * np.sign(net)) / p.pump_displacement
    return Record(
        T,
        {
            SPEED: speed + noise(0.05 * noisy, count, 1),
            POSITION: np.round(position + noise(2e-6 * noisy, count, 2), 6) if noisy else position,
            VELOCITY: velocity + noise(2e-4 * noisy, count, 3),
            PRESSURE: pressure + noise(3e3 * noisy, count, 4),
        },
        start_time=0.25,
    )


ROWS = np.arange(N)
LOG = made_log()


def stands(values: Array, begin: int, count: int) -> Array:
    """Return a channel that holds one value for ``count`` samples."""
    out = values.copy()
    out[begin : begin + count] = out[begin]
    return out


def gone(values: Array, *rows: int) -> Array:
    out = values.copy()
    out[list(rows)] = np.nan
    return out


def accused(**change: Any) -> list[Any]:
    return told(sensor_check.sensor_objections(LOG.replace(**change), HEALTHY))


def names(**change: Any) -> list[str]:
    return [f"{one['code']} {one['channel']}" for one in accused(**change)]


def first_with(told_of: Any, low: int, high: int) -> int:
    """Return the least whole number at which a verdict differs from that at the lowest number, -1 if there is none."""
    return (
        int(np.ceil(float(edge(lambda one: told_of(int(one)), low, high + 0.5, 12)) - 0.5))
        if told_of(low) != told_of(high)
        else -1
    )
