"""`beginning_of(record, pressure, velocity) -> Beginning`: the state in which a log begins, and its settling time.

A circuit starts with one chamber at the accumulator's pressure, and the other one above it by the differential
pressure. In a log that begins in motion, both chambers may hold oil at a higher pressure, which fades as it leaks off.
"""

from typing import NamedTuple

import numpy as np

from estimation.log_checks.first_belief import begins_in_motion
from plant.arrays import Array
from plant.log.record import Record

SETTLING = 0.1
"""Time at the start that does not count [s]: the circuit starts at rest, a log may not."""

TURNING_SETTLING = 1.0
"""The same if the motor turns as a log without pressure begins, a fifth of the log at most [s]: pressure that a stuck
piston holds leaks off in about that time, ``V / (beta L)`` of the healthy actuator."""

SLIDING_SETTLING = 3.0
"""The same if the piston slides as well, three tenths of the log at most [s]: the oil that its motion has shut in needs
three times as long."""

LEAST_MOTION = 0.05
"""First motor speed over the log's root mean square from which the log begins in motion [fraction]: a motor also passes
through zero, and the noise of logs that begin at rest is some 0.001."""

LEAST_START_PRESSURE = 0.1
"""First pressure over the log's root mean square from which it is more than noise [fraction]."""


class Beginning(NamedTuple):
    """The state in which a log begins.

    Parameters
    ----------
    start_values : tuple of float, or None
        Differential pressure [Pa] and velocity [m/s]; None at rest, or if unknown.
    raw_start_values : tuple of float, or None
        The same [Pa, m/s] even if it is within noise: under a load a piston without pressure is not at rest.
    start_velocity : float
        Velocity with which a log without pressure begins [m/s]; 0 if motor or piston is at rest, and with pressure.
    settling : float
        Time at the start that does not count [s].
    """

    start_values: tuple[float, float] | None
    raw_start_values: tuple[float, float] | None
    start_velocity: float
    settling: float


def beginning_of(record: Record, pressure: Array | None, velocity: Array) -> Beginning:
    """Return the state in which a log begins.

    Parameters
    ----------
    pressure : ndarray, shape (samples,), or None
        Differential pressure [Pa]; None without.
    velocity : ndarray, shape (n,)
        Mean velocity over blocks [m/s]; NaN where unknown.

    Returns
    -------
    Beginning
        At rest if nothing says otherwise.
    """
    first = float(np.nan_to_num(velocity[0]))
    if pressure is not None:
        values = (float(pressure[0]), first) if np.isfinite(pressure[0]) else None
        least = LEAST_START_PRESSURE * _rms(pressure)
        return Beginning(values if values is not None and abs(values[0]) > least else None, values, 0.0, SETTLING)
    if not begins_in_motion(record, LEAST_MOTION):
        return Beginning(None, None, 0.0, SETTLING)
    slides = abs(first) > LEAST_MOTION * _rms(velocity)
    share, most = (0.3, SLIDING_SETTLING) if slides else (0.2, TURNING_SETTLING)
    settling = float(np.clip(share * record.duration, SETTLING, most))
    return Beginning(None, None, first if slides else 0.0, settling)


def _rms(values: Array) -> float:
    """Return the root mean square of the known values; 0 if none is known."""
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if known.size else 0.0
